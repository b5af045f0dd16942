"""Shared by the unit tests: a small experiment, and the command with a fake engine."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.configuration import set_hypothesis_home_dir

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import parse_setting

from .known_run import Begin, beginning

# No examples kept from run to run, and no clock: the machine may be busy.
set_hypothesis_home_dir(Path(__file__).parents[2] / "build" / "hypothesis")
settings.register_profile("kilotwin", database=None, deadline=None)
settings.load_profile("kilotwin")

SMALL = """\
name = "small"
duration_s = 60

[arena]
diameter_m = 4.0

[[site]]
name = "black"
centre_m = [-1.0, 0.0]
diameter_m = 1.0

[[site]]
name = "white"
centre_m = [1.0, 0.0]
diameter_m = 1.0

[swarm]
profile = "foot-bot"
program = "blink.c"
size = 10
"""

INFORMED = """
[swarm.informed_for]
black = 0.7
white = 0.3

[controller]
"""

GRID = """\
duration_s = 100

[grid]
columns = 4
rows = 6
buses = 2
program = "blink.c"

[[site]]
name = "black"
shape = "rectangle"
centre_m = [-0.1, 0.0]
width_m = 0.1
height_m = 0.2

[[site]]
name = "white"
centre_m = [0.1, 0.0]
diameter_m = 0.12

[swarm]
profile = "kilobot"
program = "blink.c"
size = 5

[controller]
"""

# Parameters of small.toml's program, all with defaults but one; the experiment that names the file
# they are in, and the same with that one.
WIRE = """\
type = 5
[parameter.step_s]
kind = "seconds"
byte = 0
most = 60
default = 3.0
unit = "s"
meaning = "how long"
[parameter.offset]
kind = "whole"
byte = 2
least = -5
most = 5
[parameter.share]
kind = "real"
scale = 255
bytes = 1
byte = 4
most = 1
default = 0.5
[parameter.bold]
kind = "yes_no"
bytes = 1
byte = 5
default = true
[parameter.way]
kind = "choice"
choices = ["left", "right"]
bytes = 1
byte = 8
default = "left"
"""
DECLARED = SMALL.replace("size = 10", 'size = 10\nwire = "my.wire.toml"')
GIVEN = f"{DECLARED}\n[parameters]\noffset = -2\n"

BLINK = """\
#include <kilolib.h>

static int count;

static void setup(void) {}

static void loop(void) {
    set_color(count++ & 1 ? RGB(1, 1, 1) : RGB(0, 0, 0));
    delay(500);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""

FAKE_ENGINE = Path(__file__).parent / "fake_engine"

Load = Callable[..., Experiment]
Kilotwin = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with small.toml and its program."""
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "blink.c").write_text(BLINK)
    return tmp_path


@pytest.fixture
def load(folder: Path) -> Load:
    """`load(text, "key=value", ...)`: the experiment of that text, in `folder`."""

    def load(text: str = SMALL, *settings: str) -> Experiment:
        (folder / "small.toml").write_text(text)
        return Experiment.load(folder / "small.toml", map(parse_setting, settings))

    return load


@pytest.fixture
def begin(load: Load, tmp_path: Path) -> Iterator[Begin]:
    """`begin("run", "key=value", ..., text=...)`: the writer of a run that has begun."""
    with beginning(load, SMALL, tmp_path) as begin:
        yield begin


@pytest.fixture(scope="session")
def fake_environment(guest_cache: Path) -> dict[str, str]:
    """For commands that get the fake engine in place of the real one."""
    return {
        **{name: value for name, value in os.environ.items() if not name.startswith("KILOTWIN_")},
        "KILOTWIN_CACHE": str(guest_cache),
        "KILOTWIN_NO_TWIN": "1",
        "PYTHONPATH": str(FAKE_ENGINE),
        "COLUMNS": "120",
        "NO_COLOR": "1",
    }


def call_kilotwin(
    folder: Path, environment: dict[str, str], *arguments: str, expect: int = 0
) -> "subprocess.CompletedProcess[str]":
    """`kilotwin arguments...` in `folder`; it must end with the expected code."""
    done = subprocess.run(
        [sys.executable, "-m", "kilotwin", *arguments],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == expect, f"{arguments}\n{done.stdout}\n{done.stderr}"
    return done


@pytest.fixture
def kilotwin(folder: Path, fake_environment: dict[str, str]) -> Kilotwin:
    """`kilotwin(arguments..., expect=0, VARIABLE=...)` in `folder`, on the fake engine."""

    def call(
        *arguments: str, expect: int = 0, **environment: str
    ) -> "subprocess.CompletedProcess[str]":
        return call_kilotwin(folder, {**fake_environment, **environment}, *arguments, expect=expect)

    return call
