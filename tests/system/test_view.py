"""A run is seen in a real browser: at any time of it, robot by robot, and while it goes on."""

import io
import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

from kilotwin.runs.reader import Run

from .browser import chromium, comes, go_to, new_page, open_viewer, shown, viewer
from .conftest import KILOTWIN, SIMPLIFIED, WALKER, Kilotwin

LIVE = """\
name = "live"
duration_s = 100000
[arena]
shape = "rectangle"
width_m = 1.0
height_m = 0.8
[swarm]
profile = "kilobot"
program = "walker.c"
size = 30
[record]
sample_s = 1
"""


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory, kilotwin: Kilotwin) -> Path:
    """The paper's run, to 15,000 s."""
    folder = tmp_path_factory.mktemp("view") / "paper"
    settings = ("--set", "duration_s=15000", "--set", 'record.also=["motors","messages"]')
    kilotwin("run", SIMPLIFIED, *settings, "--out", folder, "--no-twin")
    return folder


@pytest.fixture(scope="module")
def problems() -> list[str]:
    """What the page warned of, in any test."""
    return []


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def page(
    paper: Path, environment: dict[str, str], browser: Browser, problems: list[str]
) -> Iterator[Page]:
    """The page with the paper's run."""
    with viewer(environment, paper) as address, new_page(browser, problems) as page:
        open_viewer(page, address)
        page.keyboard.press("m")  # rings of messages hide what tests look at
        yield page


@pytest.fixture(autouse=True)
def no_problems(problems: list[str]) -> Iterator[None]:
    """No test may make the page warn."""
    yield
    assert problems == []


def counts(page: Page, run: int = 0) -> dict[str, int]:
    """The numbers beside states and colours, as the page shows them."""
    rows = page.locator("#legend ul").nth(run).locator("li").all()
    return {
        row.locator(".name").inner_text(): int(row.locator("output").inner_text()) for row in rows
    }


def picture(page: Page) -> np.ndarray:
    """The table as it is seen, [rows, columns, 3]."""
    data = page.locator(".pane").first.screenshot()
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def test_scrubbed_to_12000_s_it_shows_the_counts_of_the_table(page: Page, paper: Path) -> None:
    go_to(page, 12_000)
    sites = Run.open(paper).sites()
    row = sites.slice(len(sites.filter(pc.less_equal(sites["time_s"], 12_000))) - 1, 1)
    wanted = {name: row[f"state_{name}"][0].as_py() for name in counts(page)}
    assert counts(page) == wanted
    assert sum(wanted.values()) == 100


def test_the_arena_its_sites_and_robots_are_drawn_where_they_are(page: Page, paper: Path) -> None:
    page.keyboard.press("f")
    go_to(page, 12_000)
    seen = picture(page)
    height, width = seen.shape[:2]
    pixel_m = 1.06 * 2 * 9.6 / min(height, width)

    def colour(x: float, y: float) -> list[int]:
        column, row = round(width / 2 + x / pixel_m), round(height / 2 - y / pixel_m)
        return [int(value) for value in seen[row, column]]

    assert colour(0, 0) == [0xB9] * 3
    assert colour(-4.8, 0) == [0, 0, 0]  # the middle of the black site
    assert colour(4.8, 0) == [255, 255, 255]
    robots = Run.open(paper).robots()
    before = robots.filter(pc.less_equal(robots["time_s"], 12_000))
    last = before.filter(pc.equal(before["tick"], before["tick"][-1])).to_pylist()
    resting = [robot for robot in last if robot["state"] == "resting" and robot["site"] == "black"]
    white = [sum(colour(robot["x_m"], robot["y_m"])) > 600 for robot in resting]
    assert len(white) > 20
    assert np.mean(white) > 0.9  # their LED; some stand below the ring of a neighbour


def test_it_plays_and_pauses_and_keys_step_by_samples_and_ticks(page: Page, paper: Path) -> None:
    go_to(page, 1000)
    page.keyboard.press(" ")
    comes(page, lambda: float(page.input_value("#time")) > 1000)
    page.keyboard.press(" ")
    times = np.unique(np.asarray(Run.open(paper).robots()["time_s"]))
    page.keyboard.press("Home")
    shown(page, 0)
    page.keyboard.press("ArrowRight")
    shown(page, times[1])
    page.keyboard.press("ArrowRight")
    shown(page, times[2])
    page.keyboard.press("ArrowLeft")
    shown(page, times[1])
    page.keyboard.press(".")
    shown(page, times[1] + 0.032768)
    page.keyboard.press("End")
    shown(page, times[-1])


def test_a_robot_that_is_chosen_shows_its_history(page: Page, paper: Path) -> None:
    go_to(page, 5000)
    page.keyboard.press("]")
    page.wait_for_selector("#changes li")
    robots = Run.open(paper).robots()
    its = robots.filter(pc.equal(robots["robot"], 0))
    led = np.asarray(its["led"])
    changes = 1 + np.count_nonzero(np.diff(led.astype(int)))
    assert f"states ({changes} changes)" in page.inner_text("#inspector")
    assert page.inner_text("#inspector h2") == "robot 1"
    now = its.filter(pc.less_equal(its["time_s"], 5000)).to_pylist()[-1]
    assert f"left {now['left_duty']}, right {now['right_duty']}" in page.inner_text("#now")
    assert f"sent {now['sent']} (" in page.inner_text("#now")
    assert re.search(r"^kilotwin debug \S+ --robot 1 --at \d+\.\d\d$", page.inner_text("#hold"))
    page.click("#changes li:last-child button")
    last = float(np.asarray(its["time_s"])[np.flatnonzero(np.diff(led.astype(int)))[-1] + 1])
    shown(page, round(last, 3))
    page.keyboard.press("Escape")
    assert page.is_hidden("#inspector")


def test_every_key_is_told_and_works(page: Page) -> None:
    page.keyboard.press("?")
    told = page.inner_text("#help")
    assert all(word in told for word in ("play, pause", "trails", "uids", "dark, light"))
    page.keyboard.press("Escape")
    go_to(page, 3000)
    plain = picture(page)

    def others() -> float:
        """The share of pixels that are others than before."""
        return float(np.mean(np.any(picture(page) != plain, axis=2)))

    for key in ("s", "t", "l", "m", "u", "b"):
        page.keyboard.press(key)
        comes(page, lambda: others() > 0)
        page.keyboard.press(key)
        comes(page, lambda: others() < 0.001)
    page.keyboard.press("+")
    comes(page, lambda: others() > 0.001)
    page.keyboard.press("f")


def test_an_exported_page_shows_the_run_from_a_file(
    paper: Path, kilotwin: Kilotwin, browser: Browser, problems: list[str]
) -> None:
    file = paper.parent / "page.html"
    said = kilotwin("view", paper, "--export", file, "--size", 2).stdout
    assert "all 1,502 samples" in said
    asked: list[str] = []
    with new_page(browser, problems) as page:
        page.on("request", lambda request: asked.append(request.url))
        open_viewer(page, file.as_uri())
        go_to(page, 12_000)
        sites = Run.open(paper).sites()
        row = sites.slice(len(sites.filter(pc.less_equal(sites["time_s"], 12_000))) - 1, 1)
        assert counts(page) == {name: row[f"state_{name}"][0].as_py() for name in counts(page)}
        page.keyboard.press("]")
        page.wait_for_selector("#changes li")
        led = np.asarray(Run.open(paper).robots().filter(pc.field("robot") == 0)["led"])
        changes = 1 + np.count_nonzero(np.diff(led.astype(int)))
        assert f"states ({changes} changes)" in page.inner_text("#inspector")
        assert "received" in page.inner_text("#now")
        page.keyboard.press(" ")
        comes(page, lambda: float(page.input_value("#time")) > 12_000)
    assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [file.as_uri()]


def test_two_runs_have_one_clock(
    paper: Path,
    environment: dict[str, str],
    kilotwin: Kilotwin,
    browser: Browser,
    problems: list[str],
) -> None:
    other = paper.parent / "other"
    words = ("--set", "duration_s=3000", "--seed", "2", "--out", other, "--no-twin")
    kilotwin("run", SIMPLIFIED, *words)
    with viewer(environment, paper, other) as address, new_page(browser, problems) as page:
        open_viewer(page, address)
        go_to(page, 2000)
        for run, folder in enumerate((paper, other)):
            sites = Run.open(folder).sites()
            number = len(sites.filter(pc.less_equal(sites["time_s"], 2000)))
            row = sites.slice(number - 1, 1)
            shows = counts(page, run)
            assert shows == {name: row[f"state_{name}"][0].as_py() for name in shows}
        assert len(page.query_selector_all(".pane")) == 2


def test_a_run_that_goes_on_is_followed_and_not_changed(
    environment: dict[str, str],
    tmp_path: Path,
    kilotwin: Kilotwin,
    browser: Browser,
    problems: list[str],
) -> None:
    (tmp_path / "live.toml").write_text(LIVE)
    (tmp_path / "walker.c").write_text(WALKER)
    folder = tmp_path / "run"
    command = [str(KILOTWIN), "run", "live.toml", "--out", "run", "--no-twin", "--json"]
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as run:
        while not (folder / "sites.arrows").exists():
            assert run.poll() is None
            time.sleep(0.05)
        with viewer(environment, folder) as address, new_page(browser, problems) as page:
            open_viewer(page, address)
            page.wait_for_selector("#live")
            first = float(page.input_value("#time"))
            comes(page, lambda: float(page.input_value("#time")) > first)
            run.terminate()
            page.wait_for_selector("#title:has-text('interrupted')")
        run.wait()
    watched = Run.open(folder).robots()
    kilotwin("run", tmp_path / "live.toml", "--set", "duration_s=200", "--out", tmp_path / "alone")
    alone = Run.open(tmp_path / "alone").robots()
    number = min(len(watched), len(alone) - 30)
    assert number > 30
    assert watched.slice(0, number).equals(alone.slice(0, number))
