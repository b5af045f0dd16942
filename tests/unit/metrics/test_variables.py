"""Metrics that are variables of a program: where they lie, and what is refused."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.programs.guest_symbols import GuestSymbols
from kilotwin.session.world import World

PROGRAM = """\
#include <kilolib.h>
static volatile uint8_t hops;
static volatile int16_t below = -7;
static volatile struct { uint16_t heard; int8_t table[2][3]; struct { uint32_t deep; } in; } me;
static volatile float share = 0.25f;
static volatile struct { uint8_t few : 3; } bits;
static void setup(void) { hops = kilo_uid; me.table[1][2] = -3; me.in.deep = 70000; bits.few = 5; }
static void loop(void) { me.heard++, (void)below, (void)share; }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


@pytest.fixture(scope="module", params=["native", "translated"])
def world(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> World:
    folder = tmp_path_factory.mktemp("variables")
    (folder / "mine.c").write_text(PROGRAM)
    metric = {
        "hops": {"variable": "hops", "of": "sum"},
        "most": {"variable": "mine.c:hops", "of": "most"},
        "least": {"variable": "hops", "of": "least"},
        "mean": {"variable": "hops"},
        "below": {"variable": "below"},
        "nested": {"variable": "me.table[1][2]"},
        "deep": {"variable": "me.in.deep"},
        "share": {"variable": "share"},
    }
    world = World(program=str(folder / "mine.c"), count=4, metric=metric, cpu=request.param)
    world.run(1)
    return world


def test_numbers_are_read_wherever_they_lie(world: World) -> None:
    found = world.metrics
    assert found["hops"] == 1 + 2 + 3 + 4
    assert (found["least"], found["mean"], found["most"]) == (1, 2.5, 4)
    assert found["below"] == -7
    assert found["nested"] == -3
    assert found["deep"] == 70000
    assert found["share"] == 0.25


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("hop", "has no variable 'hop'; it has: below, bits, hops, me, share"),
        ("me", "'me' is no number; it has heard, table, in"),
        ("me.table", "'me.table' is no number; the array has 2 x 3 items"),
        ("me.table[1]", "'me.table[1]' is no number"),
        ("me.table[1][3]", "there is no '3'"),
        ("me.fast", "there is no 'fast'; it has heard, table, in"),
        ("hops.x", "there is no 'x'"),
        ("bits.few", "a bit field"),
        ("a b", "'a b' names no variable; write a name, as"),
    ],
)
def test_what_is_no_number_is_refused_and_says_what_there_is(
    world: World, name: str, complaint: str
) -> None:
    file = world._debug_files[0]
    assert file is not None
    with pytest.raises(InputError) as refused:
        GuestSymbols(file).number(name)
    assert complaint in str(refused.value)


def test_a_metric_of_a_variable_that_no_program_has_names_its_line(tmp_path: Path) -> None:
    (tmp_path / "mine.c").write_text(PROGRAM)
    with pytest.raises(InputError, match="World: mine has no variable 'gone'; it has: below"):
        World(program=str(tmp_path / "mine.c"), metric={"m": {"variable": "gone"}})
