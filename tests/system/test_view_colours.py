"""The page of a program whose colours have no names: counts, curves, legend, robots that failed."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from kilotwin.runs.reader import Run

from .browser import chromium, comes, go_to, new_page, open_viewer, shown, viewer
from .conftest import Kilotwin
from .test_view import counts, picture

# Green, from 5 s on red, and one of them gives up at 10 s. Each prints once.
PROGRAM = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stdlib.h>
volatile uint8_t third;
static void setup(void) {
    set_color(RGB(0, 3, 0));
    third = kilo_uid > 7 ? 90 : 30;
    printf("here I am\\n");
}
static void loop(void) {
    if (kilo_ticks > 150 && kilo_uid > 4) set_color(RGB(3, 0, 0));
    if (kilo_ticks > 300 && kilo_uid == 3) abort();
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
WORLD = """\
duration_s = 20
[arena]
diameter_m = 0.6
[swarm]
profile = "kilobot"
cpu = "native"
program = "colours.c"
size = 10
"""
METRIC = """\
[metric.third]
variable = "third"
per_robot = true
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, kilotwin: Kilotwin) -> Path:
    folder = tmp_path_factory.mktemp("colours")
    (folder / "colours.c").write_text(PROGRAM)
    (folder / "colours.toml").write_text(WORLD)
    kilotwin("run", "colours.toml", "--no-twin", "--out", "run", folder=folder, expect=4)
    return folder / "run"


@pytest.fixture(scope="module")
def page(environment: dict[str, str], run: Path) -> Iterator[Page]:
    problems: list[str] = []
    with (
        chromium() as browser,
        viewer(environment, run) as address,
        new_page(browser, problems) as page,
    ):
        open_viewer(page, address)
        yield page
        page.goto("about:blank")
    assert problems == []


def test_robots_are_counted_by_the_colours_of_their_leds(page: Page) -> None:
    go_to(page, 3)
    assert counts(page) == {"RGB(0,0,0)": 0, "RGB(0,3,0)": 10, "RGB(3,0,0)": 0}
    go_to(page, 19)
    assert counts(page) == {"RGB(0,0,0)": 0, "RGB(0,3,0)": 4, "RGB(3,0,0)": 6, "failed": 1}


def test_curves_are_of_colours_and_the_legend_has_the_curves_colours(page: Page) -> None:
    labels = [text.rstrip(":") for text in page.locator("#curves .u-series th").all_inner_texts()]
    assert {label.strip() for label in labels} >= {"RGB(0,3,0)", "RGB(3,0,0)"}
    assert not any("not_resting" in label for label in labels)  # there are no sites
    row = page.locator("#legend li", has_text="RGB(3,0,0)")
    line = row.locator(".line").evaluate("line => getComputedStyle(line).backgroundColor")
    assert line == "rgb(255, 0, 0)"
    canvas = page.locator("#curves canvas")
    pixels = canvas.evaluate(
        "one => [...one.getContext('2d').getImageData(0, 0, one.width, one.height).data]"
    )
    drawn = np.array(pixels).reshape(-1, 4)[:, :3]
    assert np.all(drawn == (255, 0, 0), axis=1).sum() > 50


@pytest.fixture
def linked(page: Page) -> Iterator[Page]:
    """The page, with nothing chosen afterwards."""
    yield page
    page.keyboard.press("Escape")


def chosen(page: Page) -> str:
    return page.inner_text("#inspector h2")


def test_an_address_names_a_moment_and_a_robot(linked: Page) -> None:
    page = linked
    page.evaluate("location.hash = '#t=12.5&robot=5'")
    shown(page, 12.5)
    comes(page, lambda: chosen(page) == "robot 5")
    page.keyboard.press("k")
    assert page.evaluate("location.hash") == "#t=12.5&robot=6"
    go_to(page, 3)
    assert page.evaluate("location.hash") == "#t=3&robot=6"
    page.keyboard.press("Escape")
    assert page.evaluate("location.hash") == "#t=3"
    page.evaluate("location.hash = '#t=4&robot=99'")  # there is no such robot
    shown(page, 4)
    assert not page.is_visible("#inspector")


def test_a_robot_that_is_followed_stays_in_the_middle(linked: Page) -> None:
    page = linked
    go_to(page, 1)
    page.keyboard.press("k")
    page.keyboard.press("o")

    def is_in_the_middle() -> bool:
        seen = picture(page).astype(int)
        ring = np.argwhere(np.abs(seen - (0xFF, 0x40, 0x00)).max(axis=2) < 30)
        middle = np.array(seen.shape[:2]) / 2
        return len(ring) > 20 and bool(np.abs(ring.mean(axis=0) - middle).max() < 3)

    comes(page, is_in_the_middle)
    page.keyboard.press("k")
    comes(page, is_in_the_middle)
    page.keyboard.press("o")
    page.keyboard.press("f")
    comes(page, lambda: not is_in_the_middle())


def test_all_events_and_prints_are_one_list_with_a_filter_that_leads_there(
    linked: Page, run: Path
) -> None:
    page = linked
    page.keyboard.press("e")
    comes(page, lambda: page.inner_text("#lines") == "11 lines")  # of ten robots, and of one crash
    page.fill("#filter", "robot 3")
    comes(page, lambda: page.inner_text("#lines") == "2 lines")
    page.fill("#filter", "crash")
    comes(page, lambda: page.inner_text("#lines") == "1 line")
    assert "robot 3: crash: " in page.inner_text("#log")
    page.click("#log button")
    comes(page, lambda: chosen(page) == "robot 3")
    [failure] = [event for event in Run.open(run).events() if event["kind"] == "crash"]
    assert float(page.input_value("#time")) == pytest.approx(failure["time_s"], abs=0.001)
    page.keyboard.press("e")
    assert not page.is_visible("#events")


def test_the_picture_is_saved_as_it_is_seen(page: Page, tmp_path: Path) -> None:
    go_to(page, 19)
    with page.expect_download() as download:
        page.click('[data-action="picture"]')
    file = tmp_path / "picture.png"
    download.value.save_as(file)
    assert download.value.suggested_filename == "run-19.0s.png"
    with Image.open(file) as saved:
        pixels = np.asarray(saved.convert("RGB")).astype(int)
    seen = picture(page).astype(int)
    assert pixels.shape == seen.shape
    for colour in ((0, 255, 0), (255, 0, 0)):
        number = (np.abs(pixels - colour).max(axis=2) < 8).sum()
        assert number == pytest.approx((np.abs(seen - colour).max(axis=2) < 8).sum(), rel=0.05)


def crosses(page: Page) -> int:
    """Pixels of crosses."""
    return int(np.all(np.abs(picture(page).astype(int) - (0xD5, 0, 0)) < 8, axis=2).sum())


def test_a_robot_whose_program_failed_is_crossed_out_from_then_on(page: Page, run: Path) -> None:
    [failure] = [event for event in Run.open(run).events() if event["kind"] == "crash"]
    go_to(page, failure["time_s"] - 1)
    assert crosses(page) == 0
    go_to(page, failure["time_s"] + 1)
    assert crosses(page) > 20


def saved(page: Page, key: str, file: Path) -> str:
    """The name that the browser gets for what a key saves."""
    with page.expect_download() as download:
        page.keyboard.press(key)
    download.value.save_as(file)
    return download.value.suggested_filename


def test_poses_that_the_page_saves_are_those_of_the_run_and_an_experiment_takes_them(
    page: Page, run: Path, kilotwin: Kilotwin
) -> None:
    go_to(page, 19)
    name = saved(page, "x", run.parent / "here.csv")
    assert name == "run-19.0s.csv"
    assert f'poses = "{name}"' in page.inner_text("#saved")
    robots = "[[robots]]\nprogram = 'colours.c'\ncount = 10\nposes = 'here.csv'\n"
    world = WORLD.replace('program = "colours.c"\nsize = 10\n', "") + robots
    (run.parent / "again.toml").write_text(world)
    kilotwin("run", "again.toml", "--no-twin", "--out", "again", folder=run.parent, expect=4)
    [then, first] = [
        Run.open(folder).robots().to_pydict() for folder in (run, run.parent / "again")
    ]
    at = then["time_s"].index(min(then["time_s"], key=lambda time: abs(time - 19)))
    for column, close in (("x_m", 1e-5), ("y_m", 1e-5), ("heading_rad", 1e-3)):
        assert first[column][:10] == pytest.approx(then[column][at : at + 10], abs=close)
    page.keyboard.press("Escape")
    assert not page.is_visible("#saved")


def test_the_tape_says_how_far_two_places_are_from_one_another(page: Page) -> None:
    page.keyboard.press("f")
    page.keyboard.press("w")
    box = page.locator(".pane").first.bounding_box()
    assert box is not None
    middle, low = box["x"] + box["width"] / 2, box["y"] + 4
    page.mouse.click(middle - 300, low)
    page.mouse.click(middle + 100, low)
    page.wait_for_selector("body[data-measured]", state="attached")
    measured = page.get_attribute("body", "data-measured")
    pixel_m = 1.06 * 0.6 / min(box["width"], box["height"])
    assert measured is not None
    assert float(measured.removesuffix(" mm")) == pytest.approx(400 * pixel_m * 1000, rel=0.01)
    page.keyboard.press("w")


def test_a_clip_is_the_part_that_was_played_as_a_video(page: Page, tmp_path: Path) -> None:
    go_to(page, 2)
    page.keyboard.press("v")
    for time_s in (3, 4, 5, 6):
        go_to(page, time_s)
        page.wait_for_timeout(100)
    name = saved(page, "v", tmp_path / "clip.webm")
    assert name == "run-6.0s.webm"
    data = (tmp_path / "clip.webm").read_bytes()
    assert data[:4] == b"\x1a\x45\xdf\xa3"
    assert len(data) > 5_000


def test_robots_have_the_colours_and_labels_of_a_metric(
    page: Page, run: Path, kilotwin: Kilotwin, environment: dict[str, str]
) -> None:
    assert not page.is_visible('[data-action="values"]')  # nothing was recorded
    folder = run.parent
    (folder / "metric.toml").write_text(WORLD + METRIC)
    kilotwin("run", "metric.toml", "--no-twin", "--out", "metric", folder=folder, expect=4)
    browser = page.context.browser
    assert browser is not None
    problems: list[str] = []
    with (
        viewer(environment, folder / "metric") as address,
        new_page(browser, problems) as other,
    ):
        open_viewer(other, address)
        go_to(other, 19)
        other.keyboard.press("a")
        comes(other, lambda: other.is_visible("#values"))
        assert other.inner_text("#values") == "third: 30 (dark) to 90 (bright)"
        seen = picture(other).astype(int)
        dark, bright = (
            int((np.abs(seen - colour).max(axis=2) < 8).sum())
            for colour in ((0x44, 0x01, 0x54), (0xFD, 0xE7, 0x25))
        )
        assert dark / bright == pytest.approx(7 / 3, rel=0.25)
        other.keyboard.press("a")
        comes(other, lambda: not other.is_visible("#values"))
    assert problems == []
