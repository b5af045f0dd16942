"""`kilotwin optimise` and `sensitivity`: what they find, and that a kill changes nothing."""

import json
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from kilotwin.studies.sweep.parts import Parts

from .conftest import KILOTWIN, Kilotwin

# A score with its top at light 700 and temperature 250, and noise.
PROGRAM = """\
#include <kilolib.h>
static volatile uint16_t score;
static void setup(void) {
    int32_t x = get_ambientlight() - 700, y = get_temperature() - 250;
    int32_t lost = x * x / 100 + y * y / 25 + x * y / 200 + rand_hard() % 32;
    score = lost > 30000 ? 0 : 30000 - lost;
}
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""

EXPERIMENT = """\
duration_s = 1
[arena]
diameter_m = 1.0
[swarm]
profile = "kilobot"
program = "light.c"
size = 5
[metric.score]
variable = "score"
[metric.wide]
builtin = "spread"
"""

OVER = ("--over", "light.ambient=0..1000", "--over", "temperature=0..1000")


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    (tmp_path / "light.c").write_text(PROGRAM)
    (tmp_path / "light.toml").write_text(EXPERIMENT)
    return tmp_path / "light.toml"


@pytest.mark.long
def test_a_killed_search_goes_on_to_the_same_result_and_runs_nothing_twice(
    kilotwin: Kilotwin, environment: dict[str, str], experiment: Path, tmp_path: Path
) -> None:
    goal = ("--metric", "score", "--goal", "max", "--points", "12", "--repeats", "1")
    words = ["optimise", experiment, *OVER, *goal, "--confirm", "3", "-q"]
    whole = json.loads(kilotwin(*words, "--json", "-j", "2", "--out", tmp_path / "whole").stdout)
    killed = subprocess.Popen(
        [KILOTWIN, *map(str, words), "-j", "1", "--out", tmp_path / "killed"], env=environment
    )
    end = time.monotonic() + 600
    file = tmp_path / "killed/parts"
    while len(Parts(file)) < 5:
        assert killed.poll() is None
        assert time.monotonic() < end
        time.sleep(0.01)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    Parts(file).mend()  # of a part that the kill cut
    before = file.read_bytes()
    again = kilotwin(*words, "--json", "-j", "1", "--out", tmp_path / "killed")
    assert json.loads(again.stdout) == whole
    assert file.read_bytes().startswith(before)
    assert len(Parts(file)) == whole["trials"]
    assert file.stat().st_size == (tmp_path / "whole/parts").stat().st_size
    tables = [pq.read_table(tmp_path / run / "trials.parquet") for run in ("whole", "killed")]
    assert tables[0].equals(tables[1])
    assert whole["trials"] == tables[0].num_rows
    assert whole["best"][0]["means"][0] > 25_000
    for figure in ("points.png", "history.png", "report.txt"):
        assert (tmp_path / "whole" / figure).stat().st_size > 0


def test_two_goals_have_a_front_that_no_point_beats(
    kilotwin: Kilotwin, experiment: Path, tmp_path: Path
) -> None:
    goals = ("--metric", "score", "--goal", "max", "--metric", "wide", "--goal", "min")
    words = ("--points", "8", "--repeats", "1", "--confirm", "0", "-q", "--json")
    done = kilotwin("optimise", experiment, *OVER, *goals, *words, "--out", tmp_path / "two")
    found = json.loads(done.stdout)
    for one in found["best"]:
        score, wide = one["means"]
        assert not any(
            other["means"][0] > score and other["means"][1] < wide for other in found["tried"]
        )
    assert (tmp_path / "two/front.png").stat().st_size > 0


def test_morris_finds_the_key_that_matters(
    kilotwin: Kilotwin, experiment: Path, tmp_path: Path
) -> None:
    words = ("--metric", "score", "--samples", "3", "--repeats", "1", "-q", "--json")
    nothing = ("--over", "battery.hours=1..10")
    out = ("--out", tmp_path / "morris")
    done = kilotwin("sensitivity", experiment, *OVER, *nothing, *words, *out)
    found = json.loads(done.stdout)
    assert found["trials"] == 3 * 4
    assert found["influences"][-1]["key"] == "battery.hours"
    assert found["influences"][0]["main"] > 100 * found["influences"][-1]["main"]


@pytest.mark.long
def test_points_that_are_bad_early_are_given_up_for_a_share_of_their_cost(
    kilotwin: Kilotwin, experiment: Path, tmp_path: Path
) -> None:
    goal = ("--metric", "score", "--goal", "max", "--points", "12", "--repeats", "2")
    words = ("optimise", experiment, *OVER, *goal, "--confirm", "0", "-q", "--json")
    part = ("--prune-at", "0.5", "--out", tmp_path / "part")
    found = json.loads(kilotwin(*words, *part).stdout)
    given_up = [one for one in found["tried"] if one["repeats"] == 0]
    assert 2 <= len(given_up) <= 8
    trials = pq.read_table(tmp_path / "part/trials.parquet").to_pylist()
    short = [trial for trial in trials if trial["duration_s"] == 0.5]
    assert {trial["seed"] for trial in short} == {1}
    assert len(trials) == 12 + 2 * (12 - len(given_up))
    best = max(one["means"][0] for one in found["tried"] if one["repeats"])
    assert found["best"][0]["means"][0] == best
    assert json.loads(kilotwin(*words, *part).stdout) == found


@pytest.mark.parametrize("share", ["0", "1", "1.5"])
def test_a_share_to_prune_at_is_within_the_run(
    share: str, kilotwin: Kilotwin, experiment: Path
) -> None:
    words = ("--metric", "score", "--goal", "max", "--prune-at", share)
    done = kilotwin("optimise", experiment, *OVER, *words, expect=2)
    assert "--prune-at: a share of the duration, above 0 and below 1" in done.stderr


@pytest.mark.long
def test_the_optimum_of_a_grid_is_found_with_a_tenth_of_its_trials(
    kilotwin: Kilotwin, experiment: Path, tmp_path: Path
) -> None:
    (tmp_path / "grid.toml").write_text(
        'base = "light.toml"\n[vary]\nlight.ambient = { from = 0, to = 1000, step = 50 }\n'
        "temperature = { from = 0, to = 1000, step = 50 }\n"
    )
    kilotwin("sweep", tmp_path / "grid.toml", "--out", tmp_path / "grid", "-q")
    trials = pq.read_table(tmp_path / "grid/trials.parquet").to_pylist()
    best = max(trial["metric_score"] for trial in trials)
    goal = ("--metric", "score", "--goal", "max", "--repeats", "1", "--confirm", "0")
    words = ("--points", str(len(trials) // 10), "--out", tmp_path / "search", "-q", "--json")
    found = json.loads(kilotwin("optimise", experiment, *OVER, *goal, *words).stdout)
    assert found["trials"] <= len(trials) / 10
    assert found["best"][0]["means"][0] > best - 50


@pytest.mark.long
@pytest.mark.skipif(shutil.which("Rscript") is None, reason="irace is not here")
def test_irace_finds_the_top_and_a_second_time_runs_no_trial(
    kilotwin: Kilotwin, experiment: Path, tmp_path: Path
) -> None:
    goal = ("--metric", "score", "--goal", "max", "--points", "60", "--repeats", "3")
    words = ["optimise", experiment, "--with", "irace", *OVER, *goal, "--confirm", "3", "-q"]
    out = ("--json", "-j", "2", "--out", tmp_path / "out")
    found = json.loads(kilotwin(*words, *out).stdout)
    best = found["best"][0]
    assert abs(best["point"]["light.ambient"] - 700) < 100
    assert abs(best["point"]["temperature"] - 250) < 100
    assert found["confirmed"]["best"]["value"] > found["confirmed"]["as_it_is"]["value"]
    assert pq.read_table(tmp_path / "out/trials.parquet").num_rows == found["trials"]
    before = (tmp_path / "out/parts").read_bytes()
    assert json.loads(kilotwin(*words, *out).stdout) == found
    assert (tmp_path / "out/parts").read_bytes() == before
