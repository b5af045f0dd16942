"""`kilotwin bench`: what it says of runs, that it runs them, and that two engines take turns."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from kilotwin import _emulator
from kilotwin.commands import cli
from kilotwin.errors import EXIT_INTERRUPTED
from kilotwin.session import run
from kilotwin.studies.bench import two_engines, workloads

from ..conftest import Kilotwin

# What each run says of itself where none is made, and how long the reference loop took.
SUMMARY = {
    "robot_s_per_cpu_s": 17_000.0,
    "cpu_s": 0.5,
    "wall_s": 0.75,
    "startup_s": 0.02,
    "simulated_s": 100.0,
    "peak_bytes": 1 << 20,
    "stats": {"worst_overlap_fraction": 0.01, "steps": 100, "island_steps": 2500},
}
LOOP_S = 0.5

Bench = Callable[..., Result]


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """`bench(words...)`: what it says of runs that are not made: each ends at once, well."""
    outcome = run.Outcome(SUMMARY, 0)
    monkeypatch.setattr(run, "run", lambda *_: outcome)
    monkeypatch.setattr(_emulator, "reference_loop_s", lambda: LOOP_S)

    def bench(*words: str, expect: int = 0) -> Result:
        done = CliRunner().invoke(cli.app, ["bench", *words])
        assert done.exit_code == expect, done.output
        return done

    return bench


def measured(bench: Bench, *words: str) -> Any:
    return json.loads(bench(*words, "--json", "--repeats", "1", "--quiet").stdout)


def test_each_run_is_made_and_measured(kilotwin: Kilotwin) -> None:
    words = ["bench", "squeeze", "--json", "--repeats", "1", "--duration-s", "1", "--quiet"]
    (result,) = json.loads(kilotwin(*words).stdout)
    assert (result["workload"], result["robots"], result["medium"]) == ("squeeze", 1000, "kilobot")
    assert result["robot_s_per_cpu_s"] > 0
    assert result["worst_overlap_fraction"] == 0.01
    assert result["island_share"] == 0.25
    assert result["startup_s"] > 0
    assert result["bytes_per_robot"] is None
    # Speeds are told as ratios to a loop that never changes.
    assert result["loop_s"] == 0.5  # the fake engine's
    assert result["robot_s_per_loop"] == pytest.approx(result["robot_s_per_cpu_s"] / 2, abs=1)


def test_a_list_of_measurements_is_printed(bench: Bench) -> None:
    results = measured(bench, "paper", "--duration-s", "100")
    assert [(result["workload"], result["robots"]) for result in results] == [
        ("paper/simplified-n100", 100),
        ("paper/firat-n100", 100),
        ("paper/simplified-n50", 50),
        ("paper/firat-n50", 50),
    ]
    assert {result["medium"] for result in results} == {"ideal"}
    assert {result["startup_s"] for result in results} == {0.02}
    # The same number of island steps, in 100 steps of so many robots.
    assert [result["island_share"] for result in results] == [0.25, 0.25, 0.5, 0.5]


def test_a_speed_is_compared_with_the_peer_of_the_same_size(bench: Bench) -> None:
    for result in measured(bench, "paper", "--duration-s", "100"):
        peer = 1_700 if result["robots"] == 100 else 4_600
        assert result["robot_s_per_cpu_s"] == 17_000
        assert result["peer_robot_s_per_cpu_s"] == peer
        assert result["times_the_peer"] == round(17_000 / peer, 2)


def test_speeds_are_ratios_to_a_loop_that_never_changes(bench: Bench) -> None:
    for result in measured(bench, "dense"):
        assert result["loop_s"] == LOOP_S
        assert result["robot_s_per_loop"] == 17_000 * LOOP_S


def test_of_memory_the_bytes_of_one_robot_more_are_told(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A million robots, and one of the same."""
    peaks = iter([1_000_000_000, 1_000_600])
    monkeypatch.setattr(
        run, "run", lambda *_: run.Outcome({**SUMMARY, "peak_bytes": next(peaks)}, 0)
    )
    (result,) = measured(bench, "memory")
    assert (result["robots"], result["bytes_per_robot"]) == (1_000_000, 999)
    assert result["robot_s_per_cpu_s"] is None


def test_a_million_robots_are_stepped_by_as_many_threads_as_a_run_takes(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1, 2})
    results = measured(bench, "million", "--duration-s", "2")
    assert [result["medium"] for result in results] == ["kilobot", "ideal"]
    assert {(one["robots"], one["threads"], one["wall_s"]) for one in results} == {
        (1_000_000, 3, 0.75)
    }
    assert {result["threads"] for result in measured(bench, "walk")} == {1}
    table = bench("million", "--repeats", "1", "--quiet").stdout.splitlines()
    assert table[1].endswith("20 ms     3        100 s      0.8 s")


def test_there_is_a_program_for_each_thing_that_labs_programs_do() -> None:
    words = ["silent", "seldom", "period", "waits", "delays", "computes", "state-1500"]
    experiments = [case.experiment for case in workloads.cases(words, 1)]
    assert {(e.size, e.keys.medium.kind, e.keys.duration_s) for e in experiments} == {
        (1000, "kilobot", 1.0)
    }
    programs = {group.program.path for e in experiments for group in e.groups}
    assert len(programs) == len(words)
    (ten,) = workloads.cases(["programs-10"], 1)
    assert len({group.program.defines for group in ten.experiment.groups}) == 10


def test_dense_covers_47_percent_with_either_medium(bench: Bench) -> None:
    results = measured(bench, "dense")
    assert [(r["workload"], r["robots"], r["medium"]) for r in results] == [
        ("dense", 1000, "kilobot"),
        ("dense", 1000, "ideal"),
    ]


def test_a_million_walk_for_a_minute_with_either_medium(bench: Bench) -> None:
    results = measured(bench, "million")
    assert [(r["workload"], r["robots"], r["medium"]) for r in results] == [
        ("million", 1_000_000, "kilobot"),
        ("million", 1_000_000, "ideal"),
    ]
    durations = {case.experiment.keys.duration_s for case in workloads.cases(["million"], None)}
    assert durations == {60.0}


def test_a_table_for_people_is_printed(bench: Bench) -> None:
    done = bench("paper", "--repeats", "2", "--duration-s", "10")
    head, *rows, empty, machine = done.stdout.splitlines()
    assert "robot-s/CPU-s" in head
    assert [row.split()[0] for row in rows][-1] == "paper/firat-n50"
    assert {len(rows), empty} == {4, ""}
    assert "cores" in machine
    assert "paper/firat-n50, 50 robots, ideal: run 2 of 2" in done.stderr


OTHER_ENGINE = """\
#!{python}
import json, sys, tomllib
assert sys.argv[1:] == ["run", "bench.toml", "--out", "run", "--json", "--quiet"]
experiment = tomllib.load(open("bench.toml", "rb"))
with open({log!r}, "a") as log:
    print(experiment["name"], experiment["duration_s"], file=log)
print(json.dumps({{"robot_s_per_cpu_s": 1000, "peak_bytes": 1 << 20, "result_hash": "another"}}))
"""


def other_engine(folder: Path, script: str) -> None:
    command = folder / "before/.venv/bin/kilotwin"
    command.parent.mkdir(parents=True)
    command.write_text(script)
    command.chmod(0o755)


def test_another_checkout_and_this_one_run_in_turns(kilotwin: Kilotwin, tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    other_engine(tmp_path, OTHER_ENGINE.format(python=sys.executable, log=str(log)))
    words = ["--against", "before", "--repeats", "2", "--duration-s", "10", "--json", "--quiet"]
    (found,) = json.loads(kilotwin("bench", "squeeze", *words).stdout)
    assert (found["workload"], found["against"], found["rounds"]) == ("squeeze", "before", 2)
    assert found["against_robot_s_per_cpu_s"] == 1000
    assert found["ratio"] == pytest.approx(found["robot_s_per_cpu_s"] / 1000, abs=0.002)
    assert found["ratio_min"] <= found["ratio"] <= found["ratio_max"]
    assert not found["same_results"]
    assert log.read_text().splitlines() == ["bench squeeze 10.0"] * 2


@pytest.mark.parametrize(
    ("hashes", "same"),
    [
        ({"final_hash": "ab", "result_hash": "other files"}, True),
        ({"result_hash": "ab"}, True),  # as earlier engines call it
        ({"final_hash": "cd", "result_hash": "ab"}, False),
    ],
)
def test_two_engines_agree_if_their_robots_end_alike(
    bench: Bench,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    hashes: dict[str, str],
    same: bool,
) -> None:
    other_engine(tmp_path, "")
    this = {**SUMMARY, "final_hash": "ab", "result_hash": "files"}
    monkeypatch.setattr(
        two_engines,
        "_run",
        lambda engines, _: [
            this
            if engine.name == "this engine"
            else {**SUMMARY, "robot_s_per_cpu_s": 8_500, **hashes}
            for engine in engines
        ],
    )
    (found,) = measured(bench, "squeeze", "--against", str(tmp_path / "before"))
    assert found["same_results"] is same
    assert (found["ratio"], found["memory_ratio"]) == (2, 1)


def test_a_folder_that_is_no_checkout_is_refused(kilotwin: Kilotwin) -> None:
    done = kilotwin("bench", "walk", "--against", ".", expect=2)
    assert "has no .venv/bin/kilotwin" in done.stderr


def test_an_engine_that_fails_shows_why(kilotwin: Kilotwin, tmp_path: Path) -> None:
    other_engine(tmp_path, "#!/bin/sh\necho 'bench.toml:3: unknown key' >&2\nexit 2\n")
    done = kilotwin("bench", "dense", "--against", "before", expect=1)
    assert "before: `kilotwin run` ended with code 2" in done.stderr
    assert "unknown key" in done.stderr


CUT_SHORT, ASKED_TOO_LATE = (EXIT_INTERRUPTED, True), (0, True)


@pytest.mark.parametrize("end", [CUT_SHORT, ASKED_TOO_LATE])
def test_interrupted_it_keeps_what_is_measured_in_full_and_goes_no_further(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, end: tuple[int, bool]
) -> None:
    ends = [(0, False)] * 3 + [end] + [(0, False)] * 2
    outcomes = iter([run.Outcome(SUMMARY, code, asked) for code, asked in ends])
    monkeypatch.setattr(run, "run", lambda *_: next(outcomes))
    done = bench("paper", "--json", "--repeats", "2", "--duration-s", "10", "--quiet", expect=130)
    assert [result["workload"] for result in json.loads(done.stdout)] == ["paper/simplified-n100"]
    assert "interrupted" in done.stderr
    assert len(list(outcomes)) == 2
