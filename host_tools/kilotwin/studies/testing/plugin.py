"""The pytest plugin: fixtures for worlds, tests over seeds, scenarios, and what failed is kept.

pytest loads this file in every project of an environment: what it needs beside pytest is loaded
when a test asks for it.
"""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

KEPT = pytest.StashKey[list[str]]()
"""On an item: lines about what was kept of its failure."""

_SEEDS = (
    "seeds(number, first=1, at_least=1.0, timeout_s=600): run the test with so many seeds, in "
    "processes; it passes unless the share that passed contradicts at_least"
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options, all of which begin with --kilotwin."""
    group = parser.getgroup("kilotwin", "robots' programs in the emulator")
    group.addoption(
        "--kilotwin-cpu",
        choices=("auto", "native", "translated", "avr"),
        help="Processor of robots' programs that name none; avr runs them from the .hex.",
    )
    group.addoption(
        "--kilotwin-artifacts",
        default="runs/failed",
        metavar="DIR",
        help="Where runs of tests that failed are kept, each with a map; runs/failed.",
    )
    group.addoption("--kilotwin-video", action="store_true", help="Keep a video of them too.")
    parser.addini(
        "kilotwin_scenarios", "Collect TOML files with [[expect]].", type="bool", default=True
    )


def pytest_configure(config: pytest.Config) -> None:
    """Makes the marker known."""
    config.addinivalue_line("markers", _SEEDS)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A TOML file with [[expect]] is a test."""
    if file_path.suffix != ".toml" or not parent.config.getini("kilotwin_scenarios"):
        return None
    try:
        if b"expect" not in file_path.read_bytes():
            return None
    except OSError:
        return None
    from kilotwin.studies.testing.scenarios import collected

    return collected(file_path, parent)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> object | None:
    """A test with the marker runs over its seeds."""
    marker = pyfuncitem.get_closest_marker("seeds")
    if marker is None:
        return None
    from kilotwin.studies.testing import seeds

    seeds.run(pyfuncitem, *marker.args, **marker.kwargs)
    return True


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: "pytest.CallInfo[None]") -> Iterator[None]:
    """Keeps what a test that failed has made, and says how to look at it."""
    outcome: Any = yield
    report: pytest.TestReport = outcome.get_result()
    if call.when != "call" or not report.failed:
        return
    lines: list[str] | None = item.stash.get(KEPT, None)
    used: Any = getattr(item, "funcargs", {}).get("kilotwin")
    # A fixture of that name may be another one.
    if lines is None and hasattr(used, "lines_on"):
        lines = used.lines_on(used.keep(item.name))
    if lines:
        report.sections.append(("kilotwin", "\n".join(lines)))


def pytest_assertrepr_compare(op: str, left: object, right: object) -> list[str] | None:
    """LEDs by their colours, and which robots of a list differ."""
    if op != "==" or not (_has_leds(left) or _has_leds(right)):
        return None
    from kilotwin.studies.testing.explain import leds

    return leds(left, right)


def _has_leds(value: object) -> bool:
    """Whether it is one that RGB() made, or a list of them."""
    first = value[0] if isinstance(value, list | tuple) and value else value
    return type(first).__name__ == "Led"


def draw(folder: Path, *, video: bool) -> None:
    """Draws a map into a run folder, where matplotlib is installed."""
    with contextlib.suppress(ModuleNotFoundError):
        from kilotwin.studies.scenario import pictures

        pictures.draw(folder, video=video)


@pytest.fixture
def kilotwin(request: pytest.FixtureRequest) -> Iterator[Any]:
    """Worlds and runs, with programs and experiments relative to the test's file."""
    from kilotwin.studies.testing.fixture import Kilotwin

    made = Kilotwin(
        request.path.parent,
        cpu=request.config.getoption("--kilotwin-cpu"),
        artifacts=request.config.rootpath / request.config.getoption("--kilotwin-artifacts"),
        video=request.config.getoption("--kilotwin-video"),
    )
    yield made
    made.close()


@pytest.fixture
def world(kilotwin: Any) -> Callable[..., Any]:
    """`world("my.toml")` or `world(program="my.c", count=10)`: a World, closed after the test."""
    make: Callable[..., Any] = kilotwin.world
    return make
