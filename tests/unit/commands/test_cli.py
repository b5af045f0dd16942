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

from kilotwin.commands import cli, plot
from kilotwin.commands.doctor import Finding, examine, report_text
from kilotwin.studies.plot.figures import (
    METRIC_FIGURES,
    RUN_FIGURES,
    SERIES_FIGURE,
    SWEEP_FIGURES,
    VIDEO,
)

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
    "why",
    "sensitivity",
    "build",
    "port",
    "compare",
]
COMMANDS += ["bench", "record", "test", "check", "new", "hunt", "debug"]
GROUPS = {
    "grid": ["ls", "health", "check", "kconf", "setup", "run", "pause", "idle", "send"],
    "flash": ["robot", "robots", "modules"],
    "robots": [
        *("run", "pause", "reset", "sleep", "wakeup", "charge", "voltage", "uid", "send", "watch")
    ],
    "calibrate": ["motors", "ranging", "uid"],
    "serve": ["world", "programmer"],
}


def test_the_version_is_that_of_the_engine(kilotwin: Kilotwin) -> None:
    assert kilotwin("--version").stdout == "kilotwin fake\n"


def help_of(*words: str) -> str:
    done = CliRunner().invoke(cli.app, [*words, "--help"], prog_name="kilotwin")
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_helps_with_an_example(command: str) -> None:
    assert f"kilotwin {command}" in help_of(command).split("Example")[1]


@pytest.mark.parametrize(
    ("group", "command"), [(group, command) for group in GROUPS for command in GROUPS[group]]
)
def test_every_command_of_a_group_helps_with_an_example(group: str, command: str) -> None:
    assert f"kilotwin {group} {command}" in help_of(group, command).split("Example")[1]


def test_the_list_of_commands_is_grouped_and_begins_with_an_example() -> None:
    said = help_of()
    places = [said.index(f" {panel} ") for panel in cli.PANELS]
    assert places == sorted(places)
    assert said.index("kilotwin run my.toml --view") < places[0]
    assert sorted(cli.COMMANDS) == sorted({*COMMANDS, *GROUPS})


def test_help_of_run_has_examples_above_its_options_and_these_in_groups() -> None:
    said = help_of("run")
    order = ["kilotwin run my.toml --view", "--seed", "See it", "Look inside", "Trust", "Print"]
    places = [said.index(text) for text in order]
    assert places == sorted(places)
    assert "KILOTWIN_" not in said  # how names are made is said once, by `kilotwin --help`
    assert "KILOTWIN_OUT" in help_of()
    assert said.count("<bool>") <= 1  # of --help, which is click's own


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


def test_help_of_a_served_world_names_the_grid(kilotwin: Kilotwin) -> None:
    said = " ".join(kilotwin("serve", "world", "--help").stdout.split())
    assert "with a [grid], CAN buses" in said


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
cli.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", command], check=False, capture_output=True, timeout=600
    )
    assert (done.returncode, done.stderr) == (128 + number, b"")
    assert list(tmp_path.iterdir()) == []
