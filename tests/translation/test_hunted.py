"""Programs that are hunted: they do what plain ones do, and leave marks to go by."""

from pathlib import Path

import pytest

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.coverage.marks import NOT_TAKEN, RAN, TAKEN, clear, marks_of
from kilotwin.programs.group import build_group
from kilotwin.programs.image.image import build_image
from kilotwin.programs.translate.constants import constants_in
from kilotwin.programs.translate.seam import own_extents
from kilotwin.programs.variant import Variant

from .outcomes import outcome

MESSAGE, TICK, DEPTHS, DEPTH = 8, 16, 0x8000, 16
PROGRAM = """\
#include <kilolib.h>
static message_t out;
static volatile uint16_t heard;
static uint16_t fall(uint8_t depth) {
    volatile uint8_t bytes[32];
    bytes[depth & 31] = depth;
    return depth == 0 ? bytes[0] : fall(depth - 1) + bytes[depth & 31];
}
static message_t *tx(void) { return &out; }
static void rx(message_t *in, distance_measurement_t *d) { (void)in; (void)d; heard++; }
static void setup(void) { out.crc = message_crc(&out); }
static void loop(void) {
    if (heard > 777) set_color(RGB(1, 0, 0));
    if (kilo_ticks > 123456) set_color(RGB(0, fall(20) & 1, 1));
    if (kilo_uid == 4711) set_color(RGB(1, 1, 1));
    if (kilo_ticks % 64 == 0) fall(heard & 15);
    delay(20);
}
int main(void) {
    kilo_init();
    kilo_message_tx = tx;
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
"""
WORLD = """\
duration_s = 60
[arena]
diameter_m = 0.4
[swarm]
profile = "kilobot"
cpu = "translated"
program = "program.c"
size = 5
"""


@pytest.fixture
def world(tmp_path: Path) -> Path:
    (tmp_path / "program.c").write_text(PROGRAM)
    file = tmp_path / "world.toml"
    file.write_text(WORLD)
    return file


def test_marks_change_nothing_and_are_those_of_coverage_but_for_turns_of_loops(
    world: Path,
) -> None:
    (group,) = Experiment.load(world).groups
    variants: tuple[Variant, ...] = ("covered", "hunted")
    guests = {one: str(build_group(group, variant=one).file) for one in variants}
    outcomes, marks = [], []
    for variant, guest in guests.items():
        outcomes.append(outcome(world, ticks=1200, chunk=57, sample_ticks=7, variant=variant))
        marks.append(marks_of(guest))
        clear([guest])
        assert marks_of(guest) == {}
    assert outcomes[0] == outcomes[1] == outcome(world, ticks=1200, chunk=57, sample_ticks=7)
    covered, hunted = marks
    assert hunted.items() <= {at: hunted.get(at, 0) for at in covered}.items()
    for at, mark in hunted.items():
        assert mark & ~covered[at] == 0
    branches = RAN | TAKEN | NOT_TAKEN
    same = [at for at in hunted if hunted[at] & branches == covered[at] & branches]
    assert len(same) > 0.9 * len(covered)


def test_places_where_messages_and_ticks_interrupt_are_marked_and_depths_of_the_stack(
    world: Path,
) -> None:
    (group,) = Experiment.load(world).groups
    guest = str(build_group(group, variant="hunted").file)
    outcome(world, ticks=1200, chunk=57, sample_ticks=7, variant="hunted")
    marks = marks_of(guest)
    clear([guest])
    code = {at: mark for at, mark in marks.items() if at < DEPTHS}
    depths = [(at - DEPTHS) // 2 * DEPTH for at in marks if at >= DEPTHS]
    assert any(mark & MESSAGE for mark in code.values())
    assert any(mark & TICK for mark in code.values())
    assert min(depths) < 0x900 - 15 * 32
    assert max(depths) <= 0x900


def test_numbers_that_a_program_compares_with_are_found_in_its_code(world: Path) -> None:
    (group,) = Experiment.load(world).groups
    image = build_image(group.program)
    flash, _ = _emulator.flash_image(str(image.elf))
    found = constants_in(flash, own_extents(image.elf, image.objects("program")))
    for wanted in (777, 123456, 4711):
        assert found & {wanted, wanted + 1}
