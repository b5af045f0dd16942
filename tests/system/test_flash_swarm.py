"""Robots on simulated chips on a grid are flashed over the air, verified, and run."""

from pathlib import Path

import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.files.flash_image import FlashImage
from kilotwin.programs.image.image import build_image
from kilotwin.table.flash import over_the_air
from kilotwin.table.flash.image import swarm_image

from .emulated_swarm import EmulatedSwarm

# Robots show it when the new program runs, and not before.
PROGRAM = """
#include <kilolib.h>
static void setup(void) { set_color(RGB(3, 0, 3)); }
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
PURPLE = 0b110011


@pytest.fixture
def image(tmp_path: Path) -> FlashImage:
    (tmp_path / "show.c").write_text(PROGRAM)
    return swarm_image(build_image(find_program("show.c", tmp_path)).hex)


def test_robots_are_flashed_verified_and_run_the_new_program(
    image: FlashImage, tmp_path: Path
) -> None:
    """With a fifth of the frames lost, in both ways."""
    table = EmulatedSwarm(tmp_path, 4, loss=0.2, side=2, settings=("grid.cells.weak_share=0",))
    expected = frozenset(range(1, 5))
    upload = table.flash(image, uids=expected, run=True)
    assert upload.done, over_the_air.text(upload)
    assert upload.well
    assert upload.running == [1, 2, 3, 4]
    assert upload.laps <= 5
    assert table.colors() == [PURPLE] * 4
    # The same again finds that all is there, and sends no page.
    again = table.flash(image, uids=expected)
    assert again.done
    assert again.laps == 0


def test_a_dispatcher_flashes_robots_that_one_cell_reaches_in_one_lap(
    image: FlashImage, tmp_path: Path
) -> None:
    """It cannot verify them: their lights say that they run it."""
    table = EmulatedSwarm(tmp_path, 8, loss=0.0, side=2)
    upload = table.flash_by_dispatcher(image, laps=1, run=True)
    assert not upload.verifiable
    assert upload.laps == 1
    assert table.colors() == [PURPLE] * 8


@pytest.mark.long
def test_fifty_robots_need_three_laps_more_when_a_fifth_of_the_frames_is_lost(
    image: FlashImage, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Prints what the book says: run it by `pytest -m long -k fifty_robots -s`."""
    laps = {}
    for loss in (0.0, 0.2):
        folder = tmp_path / str(loss)
        folder.mkdir()
        table = EmulatedSwarm(folder, 50, loss=loss, side=4)
        began_s = table.clock.now_s()
        upload = table.flash(image, count=50, run=True)
        took_s = table.clock.now_s() - began_s
        with capsys.disabled():
            print(f"\n{loss:.0%} of the frames lost: {over_the_air.text(upload).splitlines()[-2:]}")
            print(f"{took_s:.0f} s, {upload.laps} laps of {len(image.pages)} pages")
        assert upload.well
        laps[loss] = upload.laps
    assert laps[0.2] <= laps[0.0] + 3
