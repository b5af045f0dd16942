"""The host's laps and the code of the modules' own boot loader, on a whole table with losses."""

import ctypes
import random

import pytest

from kilotwin.experiment.spec.grid_layout import Layout
from kilotwin.files import image_record
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.can.protocol import BootReport, read_to_host
from kilotwin.table.flash.module_laps import Fate, ModuleLaps

from .c_loaders import Loaders, compiled

TABLE = Layout(10, 20, 4)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled(tmp_path_factory.mktemp("loaders"))


def image(pages: int) -> FlashImage:
    """A program that begins with a jump, as loaders want it."""
    return FlashImage(b"\x0c\x94\x34\x00" + random.Random(pages).randbytes(pages * 128 - 20))


def flashed(loaders: Loaders, program: FlashImage) -> tuple[ModuleLaps, float]:
    """Laps until there is no more to do, and how long they take."""
    laps, seconds = ModuleLaps(program, TABLE, TABLE.modules()), 0.0
    while (round_ := laps.next_round()) is not None:
        seconds += round_.duration_s
        for bus, sendings in round_.frames.items():
            for group, frame in sendings:
                for place, data in loaders.receive(bus, group, frame.data):
                    report = read_to_host(data)
                    assert isinstance(report, BootReport)
                    laps.take(place, report)
    return laps, seconds


@pytest.mark.parametrize(
    ("loss", "laps_more", "programs_more"), [(0.0, 0, 0.0), (0.01, 3, 1.6), (0.1, 10, 5.0)]
)
def test_200_modules_are_verified(
    library: ctypes.CDLL, loss: float, laps_more: int, programs_more: float
) -> None:
    """At 1 % of frames lost to each module in at most 3 laps more than without losses."""
    program = image(220)
    loaders = Loaders(library, TABLE, loss)
    laps, seconds = flashed(loaders, program)
    share = laps.pages_sent / 220
    print(f"{loss:.0%} lost: {laps.laps} laps, {share:.2f} programs, {seconds:.0f} s")
    assert {laps.fate(place) for place in TABLE.modules()} == {Fate.VERIFIED}
    assert laps.laps <= 1 + laps_more
    assert share <= 1 + programs_more
    recorded = image_record.recorded({0: program.content})
    for place in TABLE.modules():
        held = loaders.flash(place)
        for begin, content in recorded.items():
            assert held[begin : begin + len(content)] == content


def test_what_they_have_they_know_by_its_record(library: ctypes.CDLL) -> None:
    program = image(30)
    loaders = Loaders(library, TABLE, 0.0)
    flashed(loaders, program)
    laps, _ = flashed(loaders, program)
    assert laps.laps == 0
    assert len(laps.verified) == len(list(TABLE.modules()))
    other, _ = flashed(loaders, image(31))
    assert other.laps == 1
    assert len(other.verified) == len(list(TABLE.modules()))
