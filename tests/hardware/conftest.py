"""Tests with real robots and modules: they type the commands of docs/lab.md and a person looks.

    pytest tests/hardware --hardware -P usb --can socketcan:can0 --size 5x4

Without --hardware they are deselected. A test that needs a device that was not named is skipped,
and so is one that needs a person if there is no terminal.
"""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
KILOTWIN = Path(sys.executable).with_name("kilotwin")
HERE = Path(__file__).parent

Typed = Callable[..., "subprocess.CompletedProcess[str]"]
Words = list[str]
Person = Callable[[str], None]


def pytest_addoption(parser: pytest.Parser) -> None:
    def add(name: str, variable: str, **more: Any) -> None:
        group.addoption(name, default=os.environ.get(variable), **more)

    group = parser.getgroup("hardware")
    group.addoption("--hardware", action="store_true", help="run the tests with real robots")
    add("--isp-kind", "KILOTWIN_PROGRAMMER", help="the programmer's kind, as avrdude names it")
    add("--isp-port", "KILOTWIN_PROGRAMMER_PORT", help="where a programmer with a robot is")
    add("--ohc", "KILOTWIN_OHC", help="the serial port of an overhead controller")
    add("--robots", "KILOTWIN_ROBOTS", type=int, help="how many robots lie there")
    add("--size", "KILOTWIN_SIZE", help="columns x rows of the grid")
    buses = os.environ.get("KILOTWIN_CAN", "").split()
    group.addoption("--can", action="append", default=buses, help="a bus of the grid; repeatable")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("hardware", False):
        items.sort(key=lambda item: item.name if HERE in item.path.parents else "")
        return
    mine = [item for item in items if HERE in item.path.parents]
    if mine:
        items[:] = [item for item in items if item not in mine]
        config.hook.pytest_deselected(items=mine)


def wanted(request: pytest.FixtureRequest, name: str) -> Any:
    """The option's value; skips the test if it was not given."""
    value = request.config.getoption(name)
    if not value:
        pytest.skip(f"needs {name}")
    return value


@pytest.fixture
def kilotwin(request: pytest.FixtureRequest) -> Typed:
    """`kilotwin ARGUMENTS` from the project's root, shown as it is typed."""
    capture = request.config.pluginmanager.getplugin("capturemanager")

    def typed(*words: str, expect: int = 0) -> "subprocess.CompletedProcess[str]":
        with capture.global_and_fixture_disabled():
            print(f"\n$ kilotwin {' '.join(words)}", flush=True)
            done = subprocess.run(
                [KILOTWIN, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False
            )
        assert done.returncode == expect, done.stdout
        return done

    return typed


@pytest.fixture
def told(kilotwin: Typed) -> Callable[..., Any]:
    """`kilotwin ARGUMENTS --json`: what it says, as an object."""

    def told(*words: str, expect: int = 0) -> Any:
        return json.loads(kilotwin(*words, "--json", expect=expect).stdout)

    return told


@pytest.fixture
def person(request: pytest.FixtureRequest) -> Person:
    """`person("do this; is that so?")`: waits for Enter; an n fails the test."""
    if not sys.__stdin__ or not sys.__stdin__.isatty():
        pytest.skip("needs a person at a terminal")
    capture = request.config.pluginmanager.getplugin("capturemanager")

    def person(what: str) -> None:
        with capture.global_and_fixture_disabled():
            print(f"\n>> {what} [Enter: yes, n: no] ", end="", flush=True)
            answer = sys.__stdin__.readline() if sys.__stdin__ else ""
        assert not answer.strip().lower().startswith("n"), f"a person said no: {what}"

    return person


@pytest.fixture
def isp(request: pytest.FixtureRequest) -> Words:
    """The words of a programmer with a robot on it."""
    kind = request.config.getoption("--isp-kind") or "avrispmkII"
    return ["--via", "isp", "-c", kind, "-P", wanted(request, "--isp-port")]


@pytest.fixture
def can(request: pytest.FixtureRequest) -> Words:
    """The words of a Kilogrid's buses."""
    size = ["--size", wanted(request, "--size")]
    return [word for bus in wanted(request, "--can") for word in ("--can", bus)] + size


@pytest.fixture
def modules(request: pytest.FixtureRequest, can: Words) -> int:
    """How many modules the grid has."""
    columns, rows = map(int, re.findall(r"\d+", request.config.getoption("--size")))
    return columns * rows


@pytest.fixture
def robots(request: pytest.FixtureRequest) -> int:
    """How many robots lie there."""
    return int(wanted(request, "--robots"))


@pytest.fixture
def ohc(request: pytest.FixtureRequest) -> Words:
    """The words of an overhead controller."""
    return ["--via", f"ohc:{wanted(request, '--ohc')}"]
