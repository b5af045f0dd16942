"""Properties of our images that a lab trusts, by the call graph of each as it is linked."""

import re
from pathlib import Path

import pytest

from kilotwin.experiment.programs import Api, find_program
from kilotwin.programs.image.image import build_image
from kilotwin.programs.image.image_size import RAM_BYTES
from kilotwin.programs.native.guest import build as build_guest
from kilotwin.programs.port import trial
from kilotwin.programs.port.disassembly import Disassembly
from kilotwin.programs.port.roles import Roles, find_roles, own_lines
from kilotwin.programs.port.stack import bound

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "firmware/examples").glob("*.c"))
ROBOTS = [ROOT / "firmware/aggregation", ROOT / "firmware/blank.c", *EXAMPLES]
MODULES = [ROOT / "kilogrid_modules/sites"]
OURS = [*ROBOTS, *MODULES]

HEAP = {"malloc", "calloc", "realloc", "free", "__brkval", "__flp"}
# libgcc's and avr-libc's arithmetic of floats; all that they need begins so too.
FLOAT = re.compile(
    r"__(add|sub|mul|div|neg|cmp|eq|ne|ge|gt|le|lt|unord)sf[23]x?$|__fp_|"
    r"__(float|fix)(uns)?[sd]i?s?f?[sd]?i?$|"
    r"(sin|cos|tan|atan2?|exp|log(10)?|pow|sqrt|floor|ceil|round|fmod)f?$"
)
# Bytes that must be left above variables and the deepest stack.
RESERVE = 64
# The deepest stack, in bytes: raise it here when more is meant.
STACK_MOST = {"robot": 190, "module": 330}

Built = tuple[Disassembly, Roles, str]


def build(path: Path) -> Built:
    api: Api | None = "module" if path in MODULES else None
    program = find_program([str(path)], Path.cwd(), [], [], api)
    image = build_image(program, lambda _: None)
    return Disassembly.of(image), find_roles(own_lines(program)), program.target


@pytest.fixture(scope="module", params=OURS, ids=lambda path: path.stem)
def built(request: pytest.FixtureRequest) -> Built:
    return build(request.param)


def in_interrupts(built: Built) -> set[str]:
    code, roles, _ = built
    vectors = {name for name in code.functions if re.fullmatch(r"__vector_\d+", name)}
    return code.reached_from(vectors | roles.in_interrupts | code.runtime_callbacks)


def test_nothing_is_allocated(built: Built) -> None:
    assert HEAP.isdisjoint(built[0].functions)
    assert HEAP.isdisjoint(variable.name for variable in built[0].variables.values())


def test_interrupts_compute_without_floats(built: Built) -> None:
    reached = in_interrupts(built)
    assert any(name.startswith("__vector_") for name in reached)
    assert sorted(filter(FLOAT.match, reached)) == []


def test_nothing_calls_itself_and_the_deepest_stack_fits(built: Built) -> None:
    code, roles, target = built
    stack = bound(code, roles)
    assert stack.bytes is not None, stack.why
    assert stack.bytes <= STACK_MOST[target], stack.why
    assert code.ram_bytes + stack.bytes + RESERVE <= RAM_BYTES


# Cycles of the longest call seen, interrupts in between included: a tick has 262,144. The leave
# test in pfsm_step(), once in two seconds, is what takes long; it is a part of loop() there.
CYCLES_MOST = {
    "loop": 150_000,
    "on_message": 1_600,
    "on_sent": 100,
    "report_signal_or_silence": 100,
}


def test_the_controllers_functions_take_no_longer_than_they_may() -> None:
    path = ROOT / "firmware/aggregation"
    program = find_program([str(path)], Path.cwd(), [], [], None)
    image = build_image(program, lambda _: None)
    code, roles = Disassembly.of(image), find_roles(own_lines(program))
    guest = build_guest(program, lambda _: None)
    outcome = trial.run(trial.Trial(120, 1), guest, image, code, roles)
    assert outcome.ticks_lost == 0
    taken = {call.function: call.cycles for call in (*outcome.loops, *outcome.callbacks)}
    assert {name for name, cycles in taken.items() if cycles > 0} == set(CYCLES_MOST)
    over = {name: cycles for name, cycles in taken.items() if cycles > CYCLES_MOST[name]}
    assert over == {}, taken


FLOATS_IN_INTERRUPT = """\
#include <kilolib.h>
#include <stdlib.h>
static volatile float sum;
static volatile char *volatile kept;
static void heard(message_t *m, distance_measurement_t *d) { sum = sum * 0.5f + m->data[0]; }
static void setup(void) { kept = malloc(kilo_uid); }
static void loop(void) {}
int main(void) {
    kilo_init();
    kilo_message_rx = heard;
    kilo_start(setup, loop);
    return 0;
}
"""


def test_the_call_graph_shows_floats_and_the_heap_where_they_are(tmp_path: Path) -> None:
    file = tmp_path / "floats.c"
    file.write_text(FLOATS_IN_INTERRUPT)
    built = build(file)
    assert list(filter(FLOAT.match, in_interrupts(built))) != []
    assert not HEAP.isdisjoint(built[0].functions)
