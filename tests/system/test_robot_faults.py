"""`kilotwin run` and `sweep` with [[faults.robot]]: what people see of robots that fail."""

import json
from pathlib import Path

from .conftest import Kilotwin

PROGRAM = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) { set_color(RGB(0, 1, 0)); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """\
duration_s = 8
[arena]
diameter_m = 1.0
[swarm]
profile = "kilobot"
program = "program.c"
size = 10
[[faults.robot]]
kind = "dead"
at_s = 4
share = 0.2
[[faults.robot]]
kind = "mute"
at_s = 2
until_s = 6
robots = [7]
"""


def experiment(folder: Path) -> Path:
    """The file, beside its program."""
    (folder / "program.c").write_text(PROGRAM)
    file = folder / "experiment.toml"
    file.write_text(EXPERIMENT)
    return file


def test_the_summary_counts_robots_that_fail_and_the_run_is_no_failure(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    done = kilotwin("run", experiment(tmp_path), "--out", tmp_path / "run")
    assert done.returncode == 0
    told = " ".join((done.stdout + done.stderr).split())
    assert "faults of robots 2 dead, 1 mute" in told
    assert "8 RGB(0,1,0), 2 off" in told
    rows = [
        json.loads(line)
        for line in (tmp_path / "run" / "events.jsonl").read_text().split("\n")
        if line
    ]
    faults = [(row["text"], row["uid"]) for row in rows if row["kind"] == "fault"]
    assert sorted(text for text, _ in faults) == ["dead", "dead", "mute"]
    assert ("mute", 7) in faults
    verified = kilotwin("run", "--verify", tmp_path / "run")
    assert verified.returncode == 0


def test_a_sweep_varies_the_share(kilotwin: Kilotwin, tmp_path: Path) -> None:
    experiment(tmp_path)
    sweep = tmp_path / "sweep.toml"
    sweep.write_text(
        'base = "experiment.toml"\nseeds = 1\n[vary]\nfaults.robot.0.share = [0, 0.5]\n'
    )
    done = kilotwin("sweep", sweep, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
