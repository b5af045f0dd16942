"""Parts of a robot's runtime that are translated with its program (programs/translate/seam.py)."""

from pathlib import Path

import pytest

from kilotwin import _emulator
from kilotwin.errors import InputError
from kilotwin.experiment.programs import find_program
from kilotwin.programs.image.image import build_image
from kilotwin.programs.translate.seam import RARE, Seam, seam_of
from kilotwin.programs.translate.translator import Block, blocks_of

# Each of these functions has a name of the runtime's own, which no header makes known.
PROGRAM = """\
#include "kilolib.h"
static uint16_t sum;
static __attribute__((noinline)) uint16_t crc_of(uint8_t byte) { return sum += byte; }
__attribute__((noinline)) void finish(void) { set_color(RGB(1, 0, 0)); }
static void loop(void) { if (crc_of(rand_soft()) > 1000) finish(); }
static void setup(void) { sum = 1; }
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Seam, list[Block]]:
    program = tmp_path_factory.mktemp("program") / "same_names.c"
    program.write_text(PROGRAM)
    image = build_image(find_program(str(program), Path.cwd()))
    seam = seam_of(image.elf, image.objects("program"))
    flash, _ = _emulator.flash_image(str(image.elf))
    return seam, blocks_of(flash, seam)


def test_each_function_that_hardly_ever_runs_is_in_a_robots_image(
    built: tuple[Seam, list[Block]],
) -> None:
    seam, _ = built
    assert len(seam.rare) == len(RARE)


def test_functions_that_hardly_ever_run_are_not_translated(
    built: tuple[Seam, list[Block]],
) -> None:
    seam, blocks = built
    begun = {block.begin for block in blocks}
    assert not any(begin <= at < end for begin, end in seam.rare for at in begun)
    assert {seam.main_loop[0], *seam.calls[:4]} <= begun


def test_a_programs_function_of_the_same_name_is_translated(
    built: tuple[Seam, list[Block]],
) -> None:
    seam, blocks = built
    assert len(seam.functions) == 5  # crc_of, finish, loop, setup, main
    assert set(seam.functions) <= {block.begin for block in blocks}


def test_a_program_that_does_without_kilo_start_is_refused(tmp_path: Path) -> None:
    program = tmp_path / "alone.c"
    program.write_text("#include <kilolib.h>\nint main(void) { for (;;) set_color(1); }\n")
    image = build_image(find_program(str(program), Path.cwd()))
    with pytest.raises(InputError, match='write cpu = "avr", or "native"'):
        seam_of(image.elf, image.objects("program"))
