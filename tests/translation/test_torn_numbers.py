"""An interrupt may tear a number of several bytes that a callback shares with loop(), as on the
chip (programs/translate/shared.py)."""

from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.programs.translate.instructions import Instruction
from kilotwin.programs.translate.shared import tearing

# Each message sets both bytes of `heard` to one number, which loop() sees half.
PROGRAM = """\
#include <kilolib.h>

static volatile uint16_t heard, own;
static uint16_t torn, messages;
static uint8_t number;

static void rx(message_t *message, distance_measurement_t *distance) {
    messages++;
    number++;
    heard = (uint16_t)(number << 8 | number);
}
static void setup(void) { own = 3; }
static void loop(void) {
    const uint16_t now = heard;
    if ((uint8_t)(now >> 8) != (uint8_t)now) torn++;
    own = own + 1;
}
int main(void) {
    kilo_init();
    kilo_message_rx = rx;
    kilo_start(setup, loop);
    return 0;
}
"""
MESSAGES = 150


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("torn") / "torn.c"
    file.write_text(PROGRAM)
    return file


def test_a_number_that_a_callback_writes_is_torn_now_and_then(program: Path) -> None:
    with World(program=str(program), count=1, cpu="translated") as world:
        for number in range(MESSAGES):
            world.send([number], robot=0)
            world.run(0.14)
        heard, torn = world.variable(0, "messages"), world.variable(0, "torn")
    assert heard > MESSAGES // 2
    assert 0 < torn < heard // 3


def test_code_is_cut_between_bytes_that_both_access_and_one_writes() -> None:
    loop, callback, kilo_start = 0x100, 0x140, 0x200
    shared, own = 0x110, 0x120
    named = [("ldi", 22, loop // 2 & 0xFF), ("ldi", 23, loop // 2 >> 8)]
    named += [("ldi", 24, 0x80), ("ldi", 25, 0)]
    code = [Instruction(2 * at, name, d, k=k) for at, (name, d, k) in enumerate(named)]
    code.append(Instruction(8, "call", target=kilo_start, words=2))
    for begin, name, bytes_ in (
        (loop, "lds", [shared, shared + 1, own, own + 1]),
        (callback, "sts", [shared + 1, shared]),
    ):
        accesses = [
            Instruction(begin + 4 * i, name, 24, k=k, words=2) for i, k in enumerate(bytes_)
        ]
        code += [*accesses, Instruction(accesses[-1].end, "ret")]
    instructions = {one.address: one for one in code}
    places = tearing(instructions, lambda _: 0, kilo_start, {loop, callback}, [])
    assert places == {loop + 4}
    assert not tearing(instructions, lambda _: 0, kilo_start, {loop}, [])


def test_code_is_cut_between_neighbours_by_a_pointer_and_in_what_a_callback_names() -> None:
    loop, callback, kilo_start = 0x100, 0x140, 0x200
    message, own, z, y = 0x110, 0x120, 30, 28
    named = [("ldi", 22, loop // 2 & 0xFF), ("ldi", 23, loop // 2 >> 8)]
    named += [("ldi", 24, 0x80), ("ldi", 25, 0)]
    code = [Instruction(2 * at, name, d, k=k) for at, (name, d, k) in enumerate(named)]
    code.append(Instruction(8, "call", target=kilo_start, words=2))
    inside = [("sts", 0, message), ("sts", 0, message + 1), ("sts", 0, own), ("sts", 0, own + 1)]
    inside += [("ldd", z, 4), ("ldd", z, 5), ("ldd", z, 8), ("ldd", y, 1), ("ldd", y, 2)]
    inside += [("st+", z, 0), ("st", z, 0)]
    inside += [("in", 0, 0x5D), ("ldd", y, 1), ("ldd", y, 2), ("ret", 0, 0)]
    at = loop
    for name, r, k in inside:
        d = y if name == "in" else 24
        code.append(Instruction(at, name, d, r, k, words=2 if name == "sts" else 1))
        at = code[-1].end
    code += [
        Instruction(callback, "ldi", 24, k=message & 0xFF),
        Instruction(callback + 2, "ldi", 25, k=message >> 8),
        Instruction(callback + 4, "ret"),
    ]
    instructions = {one.address: one for one in code}
    objects = [(message, 12), (own, 2)]
    places = tearing(instructions, lambda _: 0, kilo_start, {loop, callback}, objects)
    assert places == {loop + 4, loop + 18, loop + 24, loop + 28}
