"""78 programs that mean harm: each is stopped, fails, or goes on as said, and harms no one else."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

ROOT = Path(__file__).resolve().parents[2]
KILOTWIN = Path(sys.executable).with_name("kilotwin")
HERE = Path(__file__).parent

CULPRITS = 60
EXPERIMENT = """\
duration_s = {duration_s}
arena.diameter_m = 6.0
[swarm]
profile = "kilobot"
cpu = "native"
[record]
sample_s = 0.5
[[robots]]
program = "{culprits}"
define = ['VICTIM="{outside}/victim"', 'OUTSIDE="{outside}"', 'WAY={way}', 'FOLDER="{folder}"']
count = {count}
[[robots]]
program = "{here}/innocent.c"
count = 4
"""
REFUSED = "it made a system call that is not allowed here, "

# End of the robot with a uid: the kind of its event, and what the text has behind the place.
STOPPED: dict[int, tuple[str, str]] = {
    **dict.fromkeys(range(1, 27), ("crash", REFUSED)),
    **dict.fromkeys((32, 33, 34, 35, 36, 37), ("crash", REFUSED)),
    **dict.fromkeys((38, 39, 41, 42, 44, 45, 48), ("crash", "Segmentation fault at address")),
    43: ("stack_overflow", "its stack grew over"),
    46: ("crash", "Trace/breakpoint trap"),
    47: ("crash", "Illegal instruction"),
    **dict.fromkeys((51, 55, 56), ("endless", "it computed for 5 s of CPU time, or slept")),
}
NAMED = {3: "kill()", 5: "fork()", 9: "execve()", 15: "connect()", 36: "mmap()"}
# Instructions that end their functions, which the compiler has put one behind the other.
PLACES = {17: "processes", 46: "code", 47: "code"}
DENIED = {27: "open", 28: "make", 29: "unlink", 30: "rename", 31: "mkdir"}
GOES_ON = {40, 49, 50, 52, 53, 54, 57, 58, 59, 60}


def line_of(uid: int) -> int:
    lines = (HERE / "culprits.c").read_text().splitlines()
    (line,) = [number for number, text in enumerate(lines, 1) if f"case {uid}: " in text]
    return line


def run(folder: Path, culprits: Path, count: int, duration_s: float, way: int = 0) -> Any:
    """`kilotwin run --json`, in a folder beside one that no program may touch."""
    outside = folder / "outside"
    outside.mkdir(parents=True)
    (outside / "victim").write_text("mine")
    text = EXPERIMENT.format(
        culprits=culprits,
        outside=outside,
        folder=folder,
        here=HERE,
        count=count,
        way=way,
        duration_s=duration_s,
    )
    (folder / "experiment.toml").write_text(text)
    words = ["run", folder / "experiment.toml", "--out", folder / "run", "--json", "--quiet"]
    done = subprocess.run(
        [KILOTWIN, *map(str, words), "--confine", "require"],
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert [file.name for file in outside.iterdir()] == ["victim"]
    assert (outside / "victim").read_text() == "mine"
    assert sorted(file.name for file in folder.iterdir()) == ["experiment.toml", "outside", "run"]
    return done


def rows_of_innocents(folder: Path, count: int) -> list[dict[str, Any]]:
    rows = pq.read_table(folder / "run/robots.parquet").to_pylist()
    return [row for row in rows if row["robot"] >= count]


def prints(folder: Path, robot: int) -> str:
    return (folder / f"run/prints/robot-{robot + 1}.log").read_text()


@pytest.fixture(scope="module")
def swarm(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, float, Any]:
    """A run with all culprits, one without, CPU-seconds and summary of the first."""
    folder = tmp_path_factory.mktemp("hostile")
    began = os.times()
    done = run(folder / "with", HERE / "culprits.c", CULPRITS, 12)
    ended = os.times()
    took_s = sum(ended[2:4]) - sum(began[2:4])  # of children
    assert done.returncode == 4, done.stderr
    run(folder / "without", ROOT / "firmware/blank.c", CULPRITS, 12)
    return folder / "with", folder / "without", took_s, json.loads(done.stdout)


def events(folder: Path) -> dict[int, list[dict[str, Any]]]:
    found: dict[int, list[dict[str, Any]]] = {}
    for line in (folder / "run/events.jsonl").read_text().splitlines():
        event = json.loads(line)
        found.setdefault(event["robot"] + 1, []).append(event)
    return found


Swarm = tuple[Path, Path, float, Any]


def test_each_culprit_is_stopped_and_named_or_goes_on(swarm: Swarm) -> None:
    of = events(swarm[0])
    for uid, (kind, text) in STOPPED.items():
        failures = [event for event in of[uid] if event["kind"] == kind]
        assert len(failures) == 1, (uid, of[uid])
        assert text in failures[0]["text"], (uid, failures)
    for uid, name in NAMED.items():
        assert of[uid][0]["text"].endswith(name)
    for uid, function in PLACES.items():
        where = f"at culprits.c:{line_of(uid)} in {function}(): "
        assert of[uid][0]["text"].startswith(where)
    for uid, word in DENIED.items():
        assert [event["text"] for event in of[uid]] == [f"{word} -13"]
    failed = {robot["robot"] + 1 for robot in swarm[3]["robots_failed"]}
    assert failed == set(STOPPED)
    assert set(STOPPED) | set(DENIED) | GOES_ON == set(range(1, CULPRITS + 1))


def test_the_records_of_others_are_those_of_a_run_without_the_culprits(swarm: Swarm) -> None:
    with_them, without, _, _ = swarm
    mine = rows_of_innocents(with_them, CULPRITS)
    assert len(mine) > 50
    assert mine == rows_of_innocents(without, CULPRITS)
    for robot in range(CULPRITS, CULPRITS + 4):
        assert prints(with_them, robot) == prints(without, robot)


def test_time_and_memory_are_bounded(swarm: Swarm) -> None:
    assert swarm[2] < 180
    assert swarm[3]["peak_bytes"] < 1 << 30


def test_the_manifest_says_that_the_run_was_confined(swarm: Swarm) -> None:
    manifest = json.loads((swarm[0] / "run/manifest.json").read_text())
    assert (manifest["confined"], manifest["not_confined"]) == (True, [])


LAST = "last to run was ends_run robot 2"
DAMAGED = "is damaged; one of the programs wrote into the run folder"
# Ways of ends_run.c of which more is said than that the process ended: a part of it.
SAID = {
    **dict.fromkeys((1, 2, 3, 4, 10, 14, 15), LAST),
    13: "last to run was ends_run robot",  # the one that finds the damage
    11: f"manifest.json: {DAMAGED}",
    12: "cannot write (is a directory)",
    16: f"robots.arrows: {DAMAGED}",
    17: "cannot write (too many open files)",
    **dict.fromkeys((18, 19), "programs made files in its folder: there are more than 1,007"),
}


@pytest.fixture
def shallow(tmp_path: Path) -> Iterator[Path]:
    """A folder that rm removes: programs nest folders deeper than pytest, which removes those of
    earlier sessions at its end, can go."""
    yield tmp_path / "run"
    subprocess.run(["rm", "-rf", tmp_path / "run"], check=True)


@pytest.mark.parametrize("way", range(1, 20))
def test_a_program_that_ends_its_worker_costs_that_run_alone(way: int, shallow: Path) -> None:
    done = run(shallow, HERE / "ends_run.c", 3, 3, way)
    manifest = json.loads((shallow / "run/manifest.json").read_text())
    if way == 6 and done.returncode == 0:  # what it took was not the run's
        return
    assert done.returncode == 1, (done.stdout, done.stderr)
    assert manifest["status"] == "failed"
    assert done.stderr.count("\nkilotwin: ") + done.stderr.startswith("kilotwin: ") == 1
    assert SAID.get(way, "") in manifest["reason"]
    assert "innocent" not in manifest["reason"]
    assert "\x1b" not in done.stderr
    if way == 9:
        assert "  | \\x1b]0;owned\\x07\n  | kilotwin: all is well\n" in done.stderr
