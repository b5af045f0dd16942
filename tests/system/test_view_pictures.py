"""The viewer's pictures of runs that never change are as they were when they were looked at.

They are kept at two fifths of their size in tests/system/pictures, and compared with a tolerance
for fonts and edges. To make them anew after a change that is wanted, and then look at them:

    KILOTWIN_NEW_PICTURES=1 .venv/bin/python -m pytest tests/system/test_view_pictures.py
"""

import contextlib
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

from kilotwin.experiment.colours import led_byte
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import ExperimentText
from kilotwin.runs.folder import close_manifest
from kilotwin.runs.writer import RunWriter

from .browser import chromium, comes, go_to, new_page, open_viewer, viewer

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

PICTURES = Path(__file__).parent / "pictures"
FAILED = Path(__file__).parents[2] / "build"
NEW = bool(os.environ.get("KILOTWIN_NEW_PICTURES"))
SHARE = 0.4
# Differences of 255: on average; of a pixel that counts as another, and the share that may be so.
MEAN = 2.0
OTHER, MOST_OTHERS = 40, 0.01

TABLE = """\
name = "pictures"
duration_s = 200
[arena]
diameter_m = 2.0
[[site]]
name = "black"
centre_m = [-0.5, 0.0]
diameter_m = 0.5
[[site]]
name = "white"
centre_m = [0.5, 0.0]
diameter_m = 0.5
[[obstacle]]
shape = "rectangle"
centre_m = [0.0, 0.6]
width_m = 0.4
height_m = 0.1
[[light.source]]
at_m = [0.0, -0.6]
peak = 900
half_m = 0.3
[swarm]
profile = "kilobot"
program = "none.c"
size = 40
informed = 0.2
[swarm.informed_for]
black = 0.5
white = 0.5
[controller]
[states]
walking = [0, 0, 0]
waiting = [3, 3, 3]
talking = [0, 3, 0]
lost = [3, 0, 0]
"""
GRID = """\
name = "cells"
duration_s = 200
[grid]
columns = 6
rows = 4
buses = 1
program = "none.c"
[[site]]
name = "blue"
shape = "rectangle"
centre_m = [-0.1, 0.0]
width_m = 0.2
height_m = 0.2
[swarm]
profile = "kilobot"
program = "none.c"
size = 40
[controller]
"""


def walk(*, cells: bool) -> "Samples":
    """Forty robots on circles of their own for 20 samples; in cells of a grid, if said so."""
    tick = np.arange(20) * 305
    robot = np.arange(40)
    phase = tick[:, None] / 2000 + robot * 2.4
    away = 0.08 + 0.021 * robot
    x, y = away * np.cos(phase), away * np.sin(phase)
    if cells:
        x, y = (0.05 * (np.floor(np.clip(0.3 * axis, -0.14, 0.14) / 0.05) + 0.5) for axis in (x, y))
    shows = [led_byte(*colour) for colour in ((0, 0, 0), (3, 3, 3), (0, 3, 0), (3, 0, 0))]
    return {
        "tick": tick,
        "x_m": x.astype(np.float32),
        "y_m": y.astype(np.float32),
        "heading_rad": (phase + np.pi / 2).astype(np.float32),
        "led": np.array(shows, dtype=np.uint8)[(robot + tick[:, None] // 1500) % 4],
        "site": np.zeros(x.shape, dtype=np.uint8),
    }


def written(folder: Path, text: str, *, emulated: bool) -> Path:
    """A run folder with that walk."""
    (folder.parent / "none.c").write_text("")
    file = folder.with_suffix(".toml")
    file.write_text(text)
    manifest = {"status": "running", **({"engine": "none"} if emulated else {})}
    writer = RunWriter(folder, Experiment.of(ExperimentText.read(file, [])), manifest)
    writer.add(walk(cells=not emulated))
    writer.add_event({"kind": "crash", "robot": 2, "tick": 2000, "text": "a planted one"})
    writer.close(clean=False)
    close_manifest(folder, "finished", 0)
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def open_run(
    tmp_path_factory: pytest.TempPathFactory, environment: dict[str, str], browser: Browser
) -> Iterator[Callable[[str], Page]]:
    """`open_run("table")`: the page with that run, opened once."""
    folder = tmp_path_factory.mktemp("pictures")
    table = written(folder / "table", TABLE, emulated=True)
    cells = written(folder / "cells", GRID, emulated=False)
    problems: list[str] = []
    with (
        viewer(environment, table) as first,
        viewer(environment, cells) as second,
        new_page(browser, problems) as one,
        new_page(browser, problems) as other,
    ):
        open_viewer(one, first)
        open_viewer(other, second)
        yield lambda name: {"table": one, "cells": other}[name]
    assert problems == []


def seen(page: Page, selector: str) -> np.ndarray:
    """That part of the page, smaller: [rows, columns, 3]."""
    picture = Image.open(io.BytesIO(page.locator(selector).first.screenshot())).convert("RGB")
    size = (round(SHARE * picture.width), round(SHARE * picture.height))
    return np.asarray(picture.resize(size, Image.Resampling.BOX))


def alike(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether they show the same."""
    if one.shape != other.shape:
        return False
    apart = np.abs(one.astype(int) - other.astype(int)).max(axis=2)
    return bool(apart.mean() <= MEAN and np.mean(apart > OTHER) <= MOST_OTHERS)


def kept(name: str) -> np.ndarray:
    return np.asarray(Image.open(PICTURES / f"{name}.png").convert("RGB"))


@pytest.mark.parametrize(
    ("name", "run", "keys", "selector"),
    [
        ("table", "table", "", ".pane"),
        ("layers", "table", "stlui]", ".pane"),
        ("cells", "cells", "", ".pane"),
        ("dark", "table", "d]", "body"),
    ],
)
def test_a_picture_is_as_it_was(
    name: str, run: str, keys: str, selector: str, open_run: Callable[[str], Page]
) -> None:
    page = open_run(run)
    page.keyboard.press("f")
    go_to(page, 100)
    for key in keys:
        page.keyboard.press(key)
    if NEW:
        page.wait_for_timeout(700)
    else:
        with contextlib.suppress(AssertionError):
            comes(page, lambda: alike(seen(page, selector), kept(name)))
    now = seen(page, selector)
    for key in [*keys.replace("]", ""), "Escape"]:
        page.keyboard.press(key)
    if NEW:
        PICTURES.mkdir(exist_ok=True)
        Image.fromarray(now).quantize(128).save(PICTURES / f"{name}.png", optimize=True)
    if not alike(now, kept(name)):
        Image.fromarray(now).save(FAILED / f"view-{name}.png")
        pytest.fail(f"{name}: another picture; see build/view-{name}.png")


def test_pictures_of_other_views_are_told_apart() -> None:
    views = {name: kept(name) for name in ("table", "layers", "cells")}
    for name, view in views.items():
        assert [other for other in views if alike(view, views[other])] == [name]
