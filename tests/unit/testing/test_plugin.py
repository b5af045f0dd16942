"""The pytest plugin, by runs of pytest in a project of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

TESTING = (Path(__file__).parents[3] / "docs" / "testing.md").read_text()

PROGRAM = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) { set_color(kilo_uid == 2 ? RGB(0, 3, 0) : RGB(1, 0, 0)); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """\
duration_s = 5
arena.diameter_m = 0.3
swarm.profile = "kilobot"
swarm.program = "led.c"
swarm.size = 2
record.sample_s = 1
"""
TESTS = """\
import pytest
from kilotwin import RGB

def test_a_world_is_made_beside_the_test(world):
    made = world(program="led.c", count=2)
    made.run(3)
    assert made.leds.tolist() == [RGB(1, 0, 0), RGB(0, 3, 0)]

def test_another_colour(world):
    made = world("plain.toml")
    made.run(3)
    assert made.leds[0] == RGB(0, 3, 0)

@pytest.mark.seeds(6)
def test_each_seed_is_another_world(world, kilotwin):
    made = world(program="led.c", count=2)
    assert made.seed == kilotwin.seed <= 6

@pytest.mark.seeds(12, first=3, at_least=0.9)
def test_too_few_seeds(world, kilotwin):
    world(program="led.c", count=1).run(1)
    assert kilotwin.seed < 5, "too large"

@pytest.mark.seeds(12, at_least=0.8)
def test_few_enough_seeds(kilotwin):
    assert kilotwin.seed < 12

@pytest.mark.seeds(2)
def test_a_seed_that_dies(kilotwin):
    import os, signal
    if kilotwin.seed == 2:
        os.kill(os.getpid(), signal.SIGSEGV)

@pytest.mark.seeds(1, timeout_s=0.2)
def test_a_seed_that_hangs(kilotwin):
    while True:
        pass

def test_a_run(kilotwin):
    assert kilotwin.run("plain.toml", "swarm.size=1")["robots"] == 2
"""


@pytest.fixture
def project(pytester: pytest.Pytester) -> pytest.Pytester:
    """A project whose tests lie in a folder of their own, as its program does."""
    pytester.makeini("[pytest]\nfilterwarnings = ignore::pytest.PytestAssertRewriteWarning\n")
    (pytester.path / "deep").mkdir()
    files = {
        "led.c": PROGRAM,
        "plain.toml": EXPERIMENT,
        "met.toml": 'expect = [{that = "led.red == 1"}]\n' + EXPERIMENT,
        "missed.toml": EXPERIMENT + '[[expect]]\nthat = "led.red == 2"\nruns = 2\n',
        "bad.toml": EXPERIMENT + '[[expect]]\nthat = "led.rde == 2"\n',
        "test_led.py": TESTS,
    }
    for name, text in files.items():
        (pytester.path / "deep" / name).write_text(text)
    return pytester


def run(project: pytest.Pytester, *words: str) -> str:
    """The output of pytest in the project."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *words],
        cwd=project.path,
        env={**os.environ, "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    return done.stdout + done.stderr


def test_worlds_seeds_runs_and_scenarios_pass_or_say_why_and_are_kept(
    project: pytest.Pytester,
) -> None:
    said = run(project, "-q")
    assert "7 failed, 4 passed" in said, said
    assert "RGB(1,0,0) == RGB(0,3,0)" in said
    assert "2 of 12 seeds passed, a share of 0.17 [0.02, 0.48], expected 0.9 at least" in said
    assert "failed: seeds 5, 6, 7, 8, 9, 10, 11, 12, 13, 14" in said
    assert "too large" in said
    assert "its process was ended by SIGSEGV" in said
    assert "it took too long" in said
    assert 'missed.toml:7: that = "led.red == 2", runs = 2: led.red = 1 at 5' in said
    assert "bad.toml:8: there is no 'led.rde'; did you mean 'led.red'" in said
    kept = {folder.name for folder in (project.path / "runs/failed").iterdir()}
    assert kept == {
        *("missed-seed1", "test-another-colour-seed1", "test-too-few-seeds-seed5"),
        "plain-seed1-run1",
    }
    for name in kept:
        assert f"look at it: kilotwin view runs/failed/{name}" in said
        assert (project.path / "runs/failed" / name / "map.png").stat().st_size > 0


@pytest.mark.long  # compiles the image, and its translation
def test_with_avr_the_same_tests_run_from_the_hex(project: pytest.Pytester) -> None:
    words = ("-q", "--kilotwin-cpu=avr", "-k", "beside or met", "--deselect", "deep/missed.toml")
    assert "2 passed" in run(project, *words)


def test_the_tests_of_the_page_on_testing_pass(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nfilterwarnings = ignore::pytest.PytestAssertRewriteWarning\n")
    blocks = re.findall(r"^```\w+\n(?:#|//) (\S+)\n(.*?)^```", TESTING, re.MULTILINE | re.DOTALL)
    assert {name for name, _ in blocks} == {"beacon.c", "beacon.toml", "test_beacon.py"}
    for name, text in blocks:
        (pytester.path / name).write_text(text)
    assert "4 passed" in run(pytester, "-q")


def test_a_project_without_worlds_loads_nothing_of_the_engine() -> None:
    code = (
        "import sys, kilotwin.studies.testing.plugin; "
        "print([m for m in ('numpy', 'pydantic', 'pyarrow', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
