"""`kilotwin flash modules` on an emulated table: chips that are really rewritten over CAN."""

import json
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from .conftest import KILOTWIN, ROOT, Kilotwin
from .served_table import Table

pytestmark = pytest.mark.waits

GRID = """
name = "two modules"
duration_s = 600

[grid]
columns = 2
rows = 1
buses = 1
{modules}

[swarm]
profile = "kilobot"

[[robots]]
program = "firmware/blank.c"
count = 1
"""
ON_CHIPS = 'cpu = "avr"\nboot_loader = true'
CELL, SITES = "tests/system/programs/cell_module.c", "kilogrid_modules/sites"
PLACES = [[0, 0], [1, 0]]
INTERRUPTED = 130

Flash = Callable[..., dict[str, Any]]
Serve = Callable[[str], list[str]]


@pytest.fixture
def serve(environment: dict[str, str], tmp_path: Path) -> Iterator[Serve]:
    """`serve(MODULES)`: a table of such modules; gives the words that name its bus and size."""
    tables: list[Table] = []

    def serve(modules: str) -> list[str]:
        (tmp_path / "grid.toml").write_text(GRID.format(modules=modules))
        tables.append(Table(tmp_path / "grid.toml", tmp_path, environment))
        return ["--can", tables[0].bus, "--size", "2x1"]

    yield serve
    for table in tables:
        table.close()


@pytest.fixture
def flash(kilotwin: Kilotwin) -> Flash:
    """`kilotwin flash modules WORDS --json`: what it says."""

    def flash(*words: str | Path, expect: int = 0) -> dict[str, Any]:
        done = kilotwin("flash", "modules", *words, "--json", "--quiet", expect=expect)
        told = json.loads(done.stdout)
        assert isinstance(told, dict)
        return told

    return flash


def fates(outcome: dict[str, Any]) -> list[tuple[list[int], str, bool]]:
    return [(told["module"], told["result"], told["answers"]) for told in outcome["modules"]]


@pytest.mark.long
def test_modules_on_chips_are_rewritten_verified_and_answer_again(
    serve: Serve, flash: Flash, kilotwin: Kilotwin, environment: dict[str, str]
) -> None:
    table = serve(ON_CHIPS)
    first = flash(CELL, *table)
    assert fates(first) == [(place, "verified", True) for place in PLACES]
    assert first["laps"] == 1
    assert not any(told["had_it"] for told in first["modules"])
    assert first["build"].startswith("module cell_module avr-gcc-")

    again = flash(CELL, *table, "--module", "1-0")
    assert (again["laps"], again["image"]) == (0, first["image"])
    assert [told["had_it"] for told in again["modules"]] == [True]
    health = json.loads(kilotwin("grid", "health", *table, "--json").stdout)
    assert [module["state"] for module in health] == ["IDLE", "IDLE"]

    # Another program is broken off in the middle of its lap, and goes on where it was.
    words = [str(KILOTWIN), "flash", "modules", SITES, *table]
    with subprocess.Popen(
        words, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("lap 1: "):
                time.sleep(1.0)
                process.send_signal(signal.SIGINT)
                break
        last = process.stderr.read().splitlines()[-1]
    assert process.returncode == INTERRUPTED
    assert last.startswith("kilotwin: broken off; 2 modules have a part of it or what they had")
    rest = flash(SITES, *table)
    assert fates(rest) == [(place, "verified", True) for place in PLACES]
    assert 0 < rest["pages_sent"] < rest["pages"]


def test_two_hosts_at_once_do_not_spoil_a_program(
    serve: Serve, kilotwin: Kilotwin, environment: dict[str, str]
) -> None:
    """The one that sees the other's pages gives up with a line; in the end all is verified."""
    table = serve(ON_CHIPS)
    words = [str(KILOTWIN), "flash", "modules", SITES, *table]
    hosts = [
        subprocess.Popen(words, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    said = [host.communicate(timeout=600)[1] for host in hosts]
    codes = [host.returncode for host in hosts]
    for code, text in zip(codes, said, strict=True):
        assert code in (0, 1), text
        assert code == 0 or "another host sends programs to these modules; " in text
    assert 1 in codes
    kilotwin("flash", "modules", SITES, *table)


def test_modules_that_cannot_answer_are_told_as_sent(serve: Serve, flash: Flash) -> None:
    """Modules that run here take pages as the original does, and go on with what they were."""
    outcome = flash(SITES, *serve(""))
    assert fates(outcome) == [(place, "sent", True) for place in PLACES]
    assert outcome["failed"] == []


def test_without_a_table_there_is_one_line(kilotwin: Kilotwin) -> None:
    words = ["flash", "modules", CELL, "--can", "socketcand:127.0.0.1:1", "--size", "2x1"]
    line = kilotwin(*words, "--quiet", expect=3).stderr
    assert line.startswith("kilotwin: --can socketcand:127.0.0.1:1/can0: ")
    assert len(line.splitlines()) == 1
