"""The command's face: help, version, environment, exit codes."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from kilotwin.commands import bench_workloads, cli, plot
from kilotwin.commands.doctor import Finding, examine, report_text
from kilotwin.errors import EXIT_INTERRUPTED
from kilotwin.files import resources
from kilotwin.plot.figures import (
    METRIC_FIGURES,
    RUN_FIGURES,
    SERIES_FIGURE,
    SWEEP_FIGURES,
    VIDEO,
)
from kilotwin.runs import run

from ..conftest import Kilotwin

COMMANDS = [
    "doctor",
    "run",
    "sweep",
    "check-run",
    "export",
    "optimise",
    "plot",
    "view",
    "sensitivity",
    "build",
    "port",
    "compare",
]
COMMANDS += ["bench", "record", "test", "check", "new"]
GROUPS = {
    "grid": ["ls", "health", "check", "kconf", "setup", "run", "pause", "idle", "send"],
    "flash": ["robot", "robots", "modules"],
    "robots": [
        *("run", "pause", "reset", "sleep", "wakeup", "charge", "voltage", "uid", "send", "watch")
    ],
    "calibrate": ["motors", "ranging", "uid"],
    "serve": ["programmer"],
}


def test_the_version_is_that_of_the_engine(kilotwin: Kilotwin) -> None:
    assert kilotwin("--version").stdout == "kilotwin fake\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_helps_with_an_example(command: str, kilotwin: Kilotwin) -> None:
    shown = kilotwin(command, "--help").stdout
    assert f"kilotwin {command}" in shown.split("Example")[1]


@pytest.mark.parametrize(
    ("group", "command"), [(group, command) for group in GROUPS for command in GROUPS[group]]
)
def test_every_command_of_a_group_helps_with_an_example(
    group: str, command: str, kilotwin: Kilotwin
) -> None:
    shown = kilotwin(group, command, "--help").stdout
    assert f"kilotwin {group} {command}" in shown.split("Example")[1]


def test_every_option_has_an_environment_variable() -> None:
    commands: dict[str, Any] = {name: cli.load(name) for name in cli.COMMANDS}
    groups = {name: commands.pop(name).commands for name in GROUPS}
    assert set(commands) == set(COMMANDS)
    assert {name: list(group) for name, group in groups.items()} == GROUPS
    verbs = [command for group in groups.values() for command in group.values()]
    for command in (*commands.values(), *verbs):
        for option in command.params:
            if option.param_type_name == "option" and option.name != "help":
                assert str(option.envvar).startswith("KILOTWIN_"), (command.name, option.name)


def test_help_keeps_the_names_of_tables() -> None:
    """Unescaped, "[grid]" is a style that does not exist, and is not shown."""
    lost = re.compile(r"(?<!\\)\[[a-z_]+\]")
    commands: dict[str, Any] = {name: cli.load(name) for name in cli.COMMANDS}
    verbs = {
        f"{group} {name}": commands[group].commands[name]
        for group in GROUPS
        for name in GROUPS[group]
    }
    texts = {
        f"{name}: {parameter.name}": parameter.help
        for name, command in (*commands.items(), *verbs.items())
        for parameter in command.params
        if getattr(parameter, "help", None)
    }
    assert len(texts) > 100
    assert {where: text for where, text in texts.items() if lost.search(text)} == {}


def test_help_of_run_names_the_grid(kilotwin: Kilotwin) -> None:
    assert "with a [grid], on CAN buses" in " ".join(kilotwin("run", "--help").stdout.split())


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_the_list_of_commands_has_the_first_line_of_their_help(command: str) -> None:
    assert cli.load(command).help.splitlines()[0] == cli.COMMANDS[command]


def test_plot_has_every_figure() -> None:
    assert {figure.value for figure in plot.Figure} == {
        *RUN_FIGURES,
        *SWEEP_FIGURES,
        *METRIC_FIGURES,
        SERIES_FIGURE,
        VIDEO,
    }


def test_help_does_not_wait_for_the_heavy_libraries() -> None:
    code = (
        "import sys, kilotwin.commands.cli; "
        "print([m for m in ('pyarrow', 'matplotlib', 'numpy', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


_SCRIPT = """
import atexit, sys, threading, time
from kilotwin.commands import cli

def main():
    atexit.register(print, "at the end")
    print("said before")
    if "thread" in sys.argv:
        threading.Thread(target=lambda: (time.sleep(0.1), print("thread over"))).start()
    raise SystemExit(eval(sys.argv[1]))

cli.main = main
cli.script()
"""


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["None"], 0, ""),
        (["4"], 4, ""),
        (["'all is lost'"], 1, ""),
        (["2", "thread"], 2, "thread over\n"),
    ],
)
def test_the_script_ends_with_all_said_and_done(words: list[str], code: int, said: str) -> None:
    command = [sys.executable, "-c", _SCRIPT, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert done.stdout == f"said before\n{said}at the end\n"
    assert done.stderr.strip() == ("all is lost" if code == 1 else "")


@pytest.mark.parametrize(
    "words", [["run"], ["fly"], ["run", "x.toml", "--seed", "one"], ["plot", "pie", "x", "-o", "y"]]
)
def test_bad_usage_ends_with_2(words: list[str], kilotwin: Kilotwin) -> None:
    assert "Traceback" not in kilotwin(*words, expect=2).stderr


def test_the_doctor_says_what_is_here(kilotwin: Kilotwin) -> None:
    found = {each["what"]: each for each in json.loads(kilotwin("doctor", "--json").stdout)}
    assert found["engine"]["ok"]
    assert "fake" in found["engine"]["found"]
    assert found["Python"]["found"].startswith("3.")
    assert "Ready to run experiments." in kilotwin("doctor").stdout


def test_the_doctor_looks_at_the_real_engine_too() -> None:
    assert {"engine", "compiler of robot programs", "processor cores"} <= {
        finding.what for finding in examine()
    }


def test_the_doctor_says_what_to_type() -> None:
    missing = Finding("engine", "not built", "make setup")
    optional = Finding("avr-gcc", "not here", "apt-get install gcc-avr", needed=False)
    text = report_text([missing, optional])
    assert "MISSING  engine   not built" in text
    assert "type: make setup" in text
    assert "type: apt-get install gcc-avr" in text
    assert text.endswith("Not ready: see MISSING above.")
    assert report_text([optional]).endswith("Ready to run experiments.")


def test_a_missing_engine_is_for_the_doctor(kilotwin: Kilotwin) -> None:
    done = kilotwin("doctor", expect=1, KILOTWIN_CC="no-such-compiler")
    assert "MISSING  compiler of robot programs" in done.stdout


def test_bench_prints_a_list_of_measurements(kilotwin: Kilotwin) -> None:
    words = ["bench", "paper", "--json", "--repeats", "1", "--duration-s", "100", "--quiet"]
    results = json.loads(kilotwin(*words).stdout)
    assert [result["workload"] for result in results] == [
        "paper/simplified-n100",
        "paper/firat-n100",
        "paper/simplified-n50",
        "paper/firat-n50",
    ]
    for result in results:
        assert result["medium"] == "ideal"
        assert result["robots"] in (50, 100)
        assert result["robot_s_per_cpu_s"] > 0
        assert result["worst_overlap_fraction"] == 0.01
        assert result["box2d_share"] == 0.25
        assert result["startup_s"] > 0
        assert result["bytes_per_robot"] is None


def test_bench_compares_with_the_peer_of_the_same_size(kilotwin: Kilotwin) -> None:
    words = ["bench", "paper", "--json", "--repeats", "1", "--duration-s", "100", "--quiet"]
    for result in json.loads(kilotwin(*words).stdout):
        figure = result["robot_s_per_cpu_s"]
        assert result["peer_robot_s_per_cpu_s"] == (1_700 if result["robots"] == 100 else 4_600)
        expected = figure / result["peer_robot_s_per_cpu_s"]
        assert result["times_the_peer"] == round(expected, 2)


def test_bench_tells_speeds_as_ratios_to_a_loop_that_never_changes(kilotwin: Kilotwin) -> None:
    words = ["bench", "dense", "--json", "--repeats", "1", "--duration-s", "1", "--quiet"]
    for result in json.loads(kilotwin(*words).stdout):
        assert result["loop_s"] == 0.5  # the fake engine's
        assert result["robot_s_per_loop"] == pytest.approx(result["robot_s_per_cpu_s"] / 2, abs=1)


def test_bench_has_a_program_for_each_thing_that_labs_programs_do() -> None:
    words = ["silent", "seldom", "period", "waits", "delays", "computes", "state-1500"]
    experiments = [case.experiment for case in bench_workloads.cases(words, 1)]
    assert {(e.size, e.keys.medium.kind, e.keys.duration_s) for e in experiments} == {
        (1000, "kilobot", 1.0)
    }
    programs = {group.program.path for e in experiments for group in e.groups}
    assert len(programs) == len(words)
    (ten,) = bench_workloads.cases(["programs-10"], 1)
    assert len({group.program.defines for group in ten.experiment.groups}) == 10


def test_bench_dense_covers_47_percent_with_either_medium(kilotwin: Kilotwin) -> None:
    words = ["bench", "dense", "--json", "--repeats", "1", "--duration-s", "1", "--quiet"]
    results = json.loads(kilotwin(*words).stdout)
    assert [(r["workload"], r["robots"], r["medium"]) for r in results] == [
        ("dense", 1000, "kilobot"),
        ("dense", 1000, "ideal"),
    ]


def test_bench_squeeze_drives_a_thousand_robots_to_one_spot(kilotwin: Kilotwin) -> None:
    words = ["bench", "squeeze", "--json", "--repeats", "1", "--duration-s", "1", "--quiet"]
    (result,) = json.loads(kilotwin(*words).stdout)
    assert (result["robots"], result["worst_overlap_fraction"]) == (1000, 0.01)


def test_bench_prints_a_table_for_people(kilotwin: Kilotwin) -> None:
    shown = kilotwin("bench", "paper", "--repeats", "1", "--duration-s", "10").stdout
    assert "robot-s/CPU-s" in shown.splitlines()[0]
    assert "paper/firat-n50" in shown
    assert "cores" in shown.splitlines()[-1]


OTHER_ENGINE = """\
#!{python}
import json, sys, tomllib
assert sys.argv[1:] == ["run", "bench.toml", "--out", "run", "--json", "--quiet"]
experiment = tomllib.load(open("bench.toml", "rb"))
with open({log!r}, "a") as log:
    print(experiment["name"], experiment["duration_s"], file=log)
speed = {{"robot_s_per_cpu_s": 1000, "peak_bytes": 1 << 20}}
print(json.dumps(speed | {{"result_hash": {result_hash!r}}}))
"""


@pytest.mark.parametrize("agrees", [pytest.param(True, marks=pytest.mark.long), False])
def test_bench_against_another_checkout_runs_both_engines_in_turns(
    kilotwin: Kilotwin, tmp_path: Path, agrees: bool
) -> None:
    experiment = resources.path("experiments/paper/firat-n50.toml")
    whole = kilotwin("run", str(experiment), "--json", "--quiet", "--set", "duration_s=10")
    result_hash = json.loads(whole.stdout)["result_hash"] if agrees else "another"
    log = tmp_path / "log.txt"
    other = tmp_path / "before" / ".venv" / "bin" / "kilotwin"
    other.parent.mkdir(parents=True)
    other.write_text(
        OTHER_ENGINE.format(python=sys.executable, log=str(log), result_hash=result_hash)
    )
    other.chmod(0o755)
    words = ["--against", "before", "--repeats", "3", "--duration-s", "10", "--json", "--quiet"]
    results = json.loads(kilotwin("bench", "paper", *words).stdout)
    assert len(results) == 4
    found = results[-1]
    assert (found["workload"], found["against"], found["rounds"]) == (
        "paper/firat-n50",
        "before",
        3,
    )
    assert found["against_robot_s_per_cpu_s"] == 1000
    assert found["ratio"] == pytest.approx(found["robot_s_per_cpu_s"] / 1000, abs=0.001)
    assert found["ratio_min"] <= found["ratio"] <= found["ratio_max"]
    assert found["same_results"] is agrees
    assert log.read_text().splitlines()[-3:] == ["firat, N = 50 10.0"] * 3


def test_bench_against_a_folder_that_is_no_checkout_says_so(kilotwin: Kilotwin) -> None:
    done = kilotwin("bench", "walk", "--against", ".", expect=2)
    assert "has no .venv/bin/kilotwin" in done.stderr


def test_bench_against_an_engine_that_fails_shows_why(kilotwin: Kilotwin, tmp_path: Path) -> None:
    other = tmp_path / "before" / ".venv" / "bin" / "kilotwin"
    other.parent.mkdir(parents=True)
    other.write_text("#!/bin/sh\necho 'bench.toml:3: unknown key' >&2\nexit 2\n")
    other.chmod(0o755)
    done = kilotwin("bench", "dense", "--against", "before", expect=1)
    assert "before: `kilotwin run` ended with code 2" in done.stderr
    assert "unknown key" in done.stderr


CUT_SHORT, ASKED_TOO_LATE = (EXIT_INTERRUPTED, True), (0, True)


@pytest.mark.parametrize("end", [CUT_SHORT, ASKED_TOO_LATE])
def test_bench_interrupted_keeps_what_is_measured_in_full_and_goes_no_further(
    kilotwin: Kilotwin, monkeypatch: pytest.MonkeyPatch, end: tuple[int, bool]
) -> None:
    words = ["bench", "paper", "--json", "--repeats", "2", "--duration-s", "10", "--quiet"]
    (whole, *_) = json.loads(kilotwin(*words).stdout)
    stats = {"worst_overlap_fraction": 0.0, "steps": 1, "island_steps": 0}
    summary = {**whole, "stats": stats}
    ends = [(0, False)] * 3 + [end] + [(0, False)] * 2
    outcomes = iter([run.Outcome(summary, code, asked) for code, asked in ends])
    monkeypatch.setattr(run, "run", lambda *_: next(outcomes))
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 130
    assert [result["workload"] for result in json.loads(done.stdout)] == ["paper/simplified-n100"]
    assert "interrupted" in done.stderr
    assert len(list(outcomes)) == 2


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_command_that_does_not_heed_a_signal_clears_up_before_it_ends(
    number: int, tmp_path: Path
) -> None:
    command = f"""
import os, tempfile, time
from kilotwin.commands import cli
def app(**_):
    with tempfile.TemporaryDirectory(dir={str(tmp_path)!r}):
        os.kill(os.getpid(), {number})
        time.sleep(60)
cli.app = app
cli.script()
"""
    done = subprocess.run(
        [sys.executable, "-c", command], check=False, capture_output=True, timeout=30
    )
    assert (done.returncode, done.stderr) == (128 + number, b"")
    assert list(tmp_path.iterdir()) == []
