"""`python -m tests.bench.view`: how fast runs are drawn and opened, and what a viewer costs a run.

In a headless Chromium with software graphics, as on a computer without a graphics card.
"""

import argparse
import contextlib
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import tomli_w
from playwright.sync_api import Error, sync_playwright

from kilotwin.errors import RunError
from kilotwin.studies.bench.measure import Columns, Note, machine, table_lines
from kilotwin.studies.bench.workloads import cases

from ..processes import serving
from .view_runs import write_run

_PLAYED_S = 5.0
_MANY_ROWS = 100_000_000
_ROBOTS_OF_MANY_ROWS = 1_000
_COST_ROBOTS = 1_000
_COST_S = 2_000
_ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
_KILOTWIN = [sys.executable, "-P", "-m", "kilotwin"]
_READY = "body[data-ready=yes]"


def measure(repeats: int, note: Note) -> Iterator[dict[str, Any]]:
    """One record per figure: its median over `repeats`, and the bound that it should keep.

    RunError without Chromium; AssertionError if a viewer ends before it has an address.
    """
    with (
        _chromium() as browser,
        tempfile.TemporaryDirectory(prefix="kilotwin-bench-") as scratch,
    ):
        for robots, samples, least in (
            (1_000_000, 12, 15.0),
            (100_000, 60, 20.0),
            (1_000, 60, 60.0),
        ):
            folder = Path(scratch) / f"{robots}"
            note(f"a run of {robots:,} robots")
            write_run(folder, robots, samples)
            rates = [_frames_s(browser, folder) for _ in range(repeats)]
            what = f"{robots:,} robots play, frames/s"
            # A page is drawn 60 times a second at most.
            yield _record(what, rates, f"at least {least:g}", _median(rates) >= 0.98 * least)
            shutil.rmtree(folder)
        folder = Path(scratch) / "rows"
        note(f"a run of {_MANY_ROWS:,} rows")
        write_run(folder, _ROBOTS_OF_MANY_ROWS, _MANY_ROWS // _ROBOTS_OF_MANY_ROWS)
        opened = [_open_s(browser, folder) for _ in range(repeats)]
        yield _record(
            f"a run of {_MANY_ROWS:,} rows opens, s", opened, "at most 2", _median(opened) <= 2
        )
        shutil.rmtree(folder)
        costs = list(_costs(browser, Path(scratch), repeats, note))
        yield _record(
            f"CPU time that a viewer adds to a run of {_COST_ROBOTS:,} robots, %",
            [100 * cost for cost in costs],
            "at most 5",
            _median(costs) <= 0.05,
        )


def _median(values: list[float]) -> float:
    return float(statistics.median(values))


def _record(what: str, values: list[float], bound: str, kept: bool) -> dict[str, Any]:
    return {
        "what": what,
        "median": round(_median(values), 2),
        "lowest": round(min(values), 2),
        "highest": round(max(values), 2),
        "bound": bound,
        "kept": kept,
        "machine": machine(),
    }


@contextlib.contextmanager
def _chromium() -> Iterator[Any]:
    """A browser, driven by Playwright; RunError without one."""
    with sync_playwright() as playwright:
        found = shutil.which("chromium")
        try:
            browser = playwright.chromium.launch(executable_path=found, args=_ARGUMENTS)
        except Error as error:
            raise RunError(
                "no Chromium that starts; type: apt-get install chromium", detail=str(error)
            ) from None
        yield browser
        browser.close()


def _viewer(folder: Path) -> AbstractContextManager[tuple["subprocess.Popen[str]", str]]:
    """A viewer of that run, and its address."""
    return serving([*_KILOTWIN, "view", folder, "--no-browser"])


@contextlib.contextmanager
def _page(browser: Any, address: str) -> Iterator[Any]:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(120_000)
    try:
        page.goto(address)
        page.wait_for_selector(_READY, state="attached")
        yield page
    finally:
        page.close()


def _frames_s(browser: Any, folder: Path) -> float:
    """Frames in a second of play, after one second of it."""
    with _viewer(folder) as (_, address), _page(browser, address) as page:
        page.keyboard.press(" ")
        page.wait_for_timeout(1000)
        began, first = time.perf_counter(), int(page.get_attribute("body", "data-frames"))
        page.wait_for_timeout(1000 * _PLAYED_S)
        frames = int(page.get_attribute("body", "data-frames")) - first
        return frames / (time.perf_counter() - began)


def _open_s(browser: Any, folder: Path) -> float:
    """From the command until the first robots are drawn."""
    began = time.perf_counter()
    with _viewer(folder) as (_, address), _page(browser, address) as page:
        page.wait_for_selector('body[data-shown="0.000"]', state="attached")
        return time.perf_counter() - began


def _costs(browser: Any, scratch: Path, repeats: int, note: Note) -> Iterator[float]:
    """The run's CPU time with a viewer open, over that without, less 1; in turns."""
    walk = next(
        case.experiment for case in cases(["walk"], _COST_S) if case.experiment.size == _COST_ROBOTS
    )
    tables = {**walk.origin.raw, "record": {"sample_s": 1.0}}
    (scratch / "cost.toml").write_text(tomli_w.dumps(tables))
    for number in range(repeats):
        note(f"a run without and with a viewer, {number + 1} of {repeats}")
        alone = _run_s(scratch, scratch / f"alone-{number}", None)
        watched = _run_s(scratch, scratch / f"watched-{number}", browser)
        yield watched / alone - 1


def _run_s(scratch: Path, folder: Path, browser: Any | None) -> float:
    """CPU time of a run."""
    words = ["run", "cost.toml", "--out", str(folder), "--json", "--quiet", "--no-twin"]
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith("KILOTWIN_") or name == "KILOTWIN_CACHE"
    }
    with subprocess.Popen(
        [*_KILOTWIN, *words],
        cwd=scratch,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as run:
        with contextlib.ExitStack() as watching:
            if browser is not None:
                while not (folder / "sites.arrows").exists() and run.poll() is None:
                    time.sleep(0.02)
                _, address = watching.enter_context(_viewer(folder))
                watching.enter_context(_page(browser, address))
            said, complaint = run.communicate()
        if run.returncode:
            raise RunError(f"`kilotwin run` ended with code {run.returncode}", detail=complaint)
    return float(json.loads(said)["cpu_s"])


def table_text(results: list[dict[str, Any]]) -> str:
    """The results as a table, with the machine below."""
    return "\n".join([*table_lines(_COLUMNS, results), "", results[0]["machine"]])


_COLUMNS: Columns = {
    "what": lambda record: str(record["what"]),
    "median": lambda record: f"{record['median']:.1f}",
    "lowest to highest": lambda record: f"{record['lowest']:.1f} to {record['highest']:.1f}",
    "bound": lambda record: str(record["bound"]),
    "kept": lambda record: "yes" if record["kept"] else "NO",
}


def main() -> None:
    """Prints the table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    results = list(measure(given.repeats, lambda text: print(text, file=sys.stderr)))
    print(json.dumps(results, indent=2) if given.json else table_text(results))


if __name__ == "__main__":
    main()
