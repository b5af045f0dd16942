"""`kilotwin run --verify`: a recorded run is repeated, and what differs is named."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from .conftest import Kilotwin

Make = Callable[..., tuple[Path, dict[str, Any]]]

SAMPLES = 10  # samples of a run

# Robots that stand still, dark, and say nothing: those of the first two differ in no pose and LED.
PROGRAMS = {
    "quiet": "",
    "broken": "if (kilo_ticks > 90) *(volatile int *)0 = 1;",
    "printing": 'if (kilo_ticks == 90) printf("here\\n");',
    "walking": "set_motors(kilo_straight_left, kilo_straight_right);",
}
EXPERIMENT = """
name = "verify"
seed = 5
duration_s = 4
[arena]
shape = "circle"
diameter_m = 1
[swarm]
size = 4
program = "{program}.c"
profile = "kilobot"
cpu = "native"
[record]
sample_s = 0.5
"""

GRID = """
seed = 1
duration_s = 2
[grid]
columns = 2
rows = 1
buses = 1
cpu = "{cpu}"
[swarm]
profile = "kilobot"
[[robots]]
program = "firmware/examples/talk_and_listen.c"
count = 1
[[site]]
name = "black"
shape = "circle"
centre_m = [0.0, 0.0]
diameter_m = 0.1
"""


@pytest.fixture
def make(tmp_path: Path, kilotwin: Kilotwin) -> Make:
    """Runs a program of PROGRAMS; returns its run folder and its summary."""

    def run(program: str, expect: int = 0) -> tuple[Path, dict[str, Any]]:
        loop = PROGRAMS[program]
        (tmp_path / f"{program}.c").write_text(
            "#include <stdio.h>\n#include <kilolib.h>\nvoid setup(void) {}\n"
            f"void loop(void) {{ {loop} }}\n"
            "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"
        )
        file = tmp_path / f"{program}.toml"
        file.write_text(EXPERIMENT.format(program=program))
        out = tmp_path / f"run-{program}"
        done = kilotwin("run", file, "--out", out, "--json", expect=expect)
        return out, json.loads(done.stdout)

    return run


def test_a_crash_and_a_print_change_the_result_though_not_the_end(make: Make) -> None:
    _, quiet = make("quiet")
    _, broken = make("broken", 4)
    _, printing = make("printing")
    assert quiet["final_hash"] == broken["final_hash"] == printing["final_hash"]
    assert len({run["result_hash"] for run in (quiet, broken, printing)}) == 3


def test_a_run_that_is_repeated_is_the_same(make: Make, kilotwin: Kilotwin) -> None:
    folder, summary = make("walking")
    for recorded in (folder, folder / "manifest.json"):
        done = kilotwin("run", "--verify", recorded, "--json")
        verdict = json.loads(done.stdout)
        assert verdict["same"] is True
        assert verdict["changed"] == []
        assert verdict["rows_compared"] == 4 * SAMPLES
        assert verdict["result_hash"] == verdict["result_hash_now"] == summary["result_hash"]
    assert "the same result" in kilotwin("run", "--verify", folder, "-q").stdout


def test_a_run_is_repeated_elsewhere_without_what_it_was_made_of(
    make: Make, kilotwin: Kilotwin, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder, _ = make("walking")
    there = tmp_path_factory.mktemp("elsewhere") / "run"
    folder.rename(there)
    (there.parent / "walking.c").write_text("another program")
    (folder.parent / "walking.c").write_text("an edited program")
    (folder.parent / "walking.toml").unlink()
    verdict = json.loads(kilotwin("run", "--verify", there, "--json").stdout)
    assert (verdict["same"], verdict["changed"]) == (True, [])


@pytest.mark.parametrize("cpu", ["native", "avr"])
def test_a_grid_with_our_module_program_is_repeated_where_nothing_is_built_yet(
    cpu: str,
    tmp_path: Path,
    kilotwin: Kilotwin,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The program's files include headers two folders above, and the host knows its cells."""
    (tmp_path / "grid.toml").write_text(GRID.format(cpu=cpu))
    kilotwin("run", tmp_path / "grid.toml", "--out", tmp_path / "run")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
    verdict = json.loads(kilotwin("run", "--verify", tmp_path / "run", "--json").stdout)
    assert (verdict["same"], verdict["changed"]) == (True, [])


def test_the_first_sample_that_differs_is_named(make: Make, kilotwin: Kilotwin) -> None:
    folder, _ = make("walking")
    file = folder / "robots.arrows"
    with pa.OSFile(str(file)) as source, pa.ipc.open_stream(source) as reader:
        table = reader.read_all()
    x_m = table["x_m"].to_pylist()
    row = 4 * 3 + 2  # robot 2 in the fourth sample; a later one differs, too
    x_m[row] += 0.25
    x_m[row + 5] += 0.25
    place = table.schema.get_field_index("x_m")
    changed = table.set_column(place, table.field("x_m"), pa.array(x_m, pa.float32()))
    with pa.OSFile(str(file), "wb") as sink, pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(changed)
    done = kilotwin("run", "--verify", folder, "-q", expect=1)
    time_s = table["time_s"][row].as_py()
    assert f"at {time_s:.3f} s robot 2 has x_m" in done.stdout


def test_what_no_sample_shows_is_named_too_and_the_program_that_changed(
    make: Make,
    kilotwin: Kilotwin,
) -> None:
    folder, _ = make("quiet")
    source = folder / "parcel/quiet.c"
    source.write_text(source.read_text().replace("{  }", "{ " + PROGRAMS["printing"] + " }"))
    done = kilotwin("run", "--verify", folder, "-q", expect=1)
    assert "all samples agree, but events are {'print': 4}, and were {}" in done.stdout
    assert "changed since: program quiet: " in done.stdout


def test_a_run_cut_off_is_compared_as_far_as_it_came(make: Make, kilotwin: Kilotwin) -> None:
    folder, _ = make("walking")
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["status"] = "running"
    del manifest["summary"]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    file = folder / "robots.arrows"
    with pa.OSFile(str(file)) as source, pa.ipc.open_stream(source) as reader:
        table = reader.read_all().slice(0, 4 * 5)
    with pa.OSFile(str(file), "wb") as sink, pa.ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    verdict = json.loads(kilotwin("run", "--verify", folder, "--json").stdout)
    assert (verdict["same"], verdict["rows_compared"]) == (True, 20)
    assert verdict["result_hash"] is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"engine": None}, "a recording of real robots or a table; no emulator repeats it"),
        ({"command_line": ["kilotwin", "serve", "world"]}, "hosts outside had a hand in it"),
        ({"summary": {}}, "has no result_hash of every sample"),
    ],
)
def test_what_cannot_be_repeated_is_refused(
    change: dict[str, object],
    said: str,
    make: Make,
    kilotwin: Kilotwin,
) -> None:
    folder, _ = make("quiet")
    manifest = json.loads((folder / "manifest.json").read_text()) | change
    manifest = {key: value for key, value in manifest.items() if value is not None}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    assert said in kilotwin("run", "--verify", folder, expect=2).stderr


def test_verify_goes_with_no_setting(make: Make, kilotwin: Kilotwin) -> None:
    folder, _ = make("quiet")
    done = kilotwin("run", "--verify", folder, "--seed", "3", expect=2)
    assert "--verify repeats a run as it was" in done.stderr
    assert "not a run folder" in kilotwin("run", "--verify", folder.parent, expect=2).stderr
