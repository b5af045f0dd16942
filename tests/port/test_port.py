"""`kilotwin port` finds what was planted in bad programs, and is silent on good ones."""

import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.programs.port import bounds
from kilotwin.programs.port.check import Report, check
from kilotwin.programs.port.disassembly import Function, Instruction, Place, parse
from kilotwin.programs.port.findings import Finding, Weight, in_order
from kilotwin.programs.port.roles import Line, find_roles
from kilotwin.programs.port.trial import Trial

ROOT = Path(__file__).resolve().parents[2]
BAD = sorted((Path(__file__).parent / "programs").glob("*.c"))
GOOD = [
    "firmware/aggregation",
    *(f"firmware/examples/{p.name}" for p in sorted((ROOT / "firmware/examples").glob("*.c"))),
]
# Findings that show only when programs run.
BAD_RUN = sorted((Path(__file__).parent / "programs_run").glob("*.c"))
# Programs with a stack that is hard to bound from the machine code.
DEEP = sorted((Path(__file__).parent / "programs_stack").glob("*.c"))
TRIAL_S = 8
# An interrupt may come where the stack is deep, and need less than the deepest one, the answer to a
# question of the host: no trial sends that.
LOOSE_BYTES = 52
FAILING = {"flash", "stack", "no-kick", "no-crc"}
# May do, for all that the code says.
MAY_DO = {"recursion_has_no_end", "array_has_no_fixed_length", "array_leaves_little_stack"}


@cache
def checked(program: str, trial: Trial | None = None) -> Report:
    return check([program], [], [], trial, lambda _: None)


def found(program: str, trial: Trial | None = None) -> list[tuple[str, int | None, Weight]]:
    report = checked(program, trial)
    return [(f.check, f.place.line if f.place else None, f.weight) for f in report.findings]


@pytest.mark.parametrize("program", BAD, ids=lambda path: path.stem)
def test_a_planted_trap_is_found_at_its_line(program: Path) -> None:
    name, line = re.match(r"// expect: (\S+) ?(\d*)", program.read_text()).groups()  # type: ignore[union-attr]
    findings = found(str(program))
    weights = {
        weight for check, at, weight in findings if (check, at) == (name, int(line or 0) or None)
    }
    assert weights, findings
    if name in FAILING and program.stem not in MAY_DO:
        assert weights == {Weight.FAILS}


@pytest.mark.parametrize(
    "kick", ["set_motors(255, 0xff);", "uint8_t l = 0, r = 0; l = r = 0xff; set_motors(l, r);"]
)
def test_motors_that_are_kicked_at_full_duty_are_passed(kick: str, tmp_path: Path) -> None:
    program = tmp_path / "kicks.c"
    program.write_text(f"""\
#include <kilolib.h>
static void setup(void) {{}}
static void loop(void) {{ {kick} delay(15); set_motors(70, 70); delay(500); }}
int main(void) {{ kilo_init(); kilo_start(setup, loop); return 0; }}
""")
    assert found(str(program)) == []


@pytest.mark.parametrize("program", BAD_RUN, ids=lambda path: path.stem)
def test_a_trap_that_shows_at_run_time_is_found(program: Path) -> None:
    name, weight, line = re.match(  # type: ignore[union-attr]
        r"// expect: (\S+) (\S+) ?(\d*)", program.read_text()
    ).groups()
    findings = found(str(program), Trial(TRIAL_S))
    assert (name, int(line or 0) or None, Weight(weight)) in findings
    assert name not in {check for check, _, _ in found(str(program))}


@pytest.mark.parametrize("program", GOOD)
def test_good_programs_are_passed_in_silence(program: str) -> None:
    report = checked(program, Trial(TRIAL_S))
    assert report.findings == ()
    assert report.trial is not None
    assert report.trial.compared > 3
    assert report.stack.bytes is not None
    assert 20 < report.trial.stack_bytes <= report.stack.bytes


def test_a_program_without_kilo_start_and_variables_is_looked_through_without_a_trial(
    tmp_path: Path,
) -> None:
    program = tmp_path / "alone.c"
    program.write_text("#include <kilolib.h>\nint main(void) { for (;;) set_color(1); }\n")
    said: list[str] = []
    report = check([str(program)], [], [], Trial(TRIAL_S), said.append)
    assert (report.findings, report.trial) == ((), None)
    assert said[-1] == "no trial: the program never calls kilo_start()"


@pytest.mark.parametrize("program", DEEP, ids=lambda path: path.stem)
def test_the_stack_is_never_deeper_than_its_bound_and_not_much_less(program: Path) -> None:
    report = checked(str(program), Trial(TRIAL_S))
    assert report.trial is not None
    assert report.stack.bytes is not None
    assert report.trial.stack_bytes <= report.stack.bytes
    assert report.stack.bytes <= report.trial.stack_bytes + LOOSE_BYTES


def test_what_is_the_same_at_several_places_is_one_finding() -> None:
    (path,) = [path for path in BAD if path.stem == "ticks_are_read_in_many_places"]
    (finding,) = checked(str(path)).findings
    assert [place.line for place in finding.more] == [10, 11]
    assert "; so also at line 10, line 11 [torn-access]" in finding.text()
    assert finding.as_dict()["more"][1]["line"] == 11


def test_the_worst_comes_first() -> None:
    def found(check: str, weight: Weight, line: int) -> Finding:
        return Finding(check, weight, check, "", Place("a.c", line))

    several = [
        found("torn-access", Weight.WARNS, 1),
        found("differs-in-time", Weight.WARNS, 2),
        found("array-bounds", Weight.WARNS, 9),
        found("no-crc", Weight.FAILS, 8),
        found("stack", Weight.FAILS, 9),
        found("stack", Weight.WARNS, 3),
    ]
    assert [finding.place.line for finding in in_order(several) if finding.place] == [
        *(9, 8),
        *(3, 9, 1, 2),
    ]


def test_a_difference_by_passes_of_loop_is_told_as_that() -> None:
    said = advice("passes_are_counted", "differs-in-passes")
    assert "it counts passes of loop()" in said
    assert "where loop() runs once a tick on both, it decides the same" in said
    assert "count kilo_ticks" in said


def test_an_act_in_each_pass_of_a_tick_is_told_with_the_passes_of_a_trial() -> None:
    (path,) = [path for path in BAD if path.stem == "clock_is_masked"]
    (finding,) = [f for f in checked(str(path), Trial(2)).findings if f.check == "tick-modulo"]
    (times,) = re.findall(r"loop\(\) runs ([\d,]+) times \(in this trial\)", finding.what)
    # A tick has 262,144 cycles, and a pass that does next to nothing some 40 to 80 of them.
    assert 262_144 / 80 < int(times.replace(",", "")) < 262_144 / 40


def test_a_copy_of_the_clock_that_is_compared_with_the_last_one_acts_once_a_tick(
    tmp_path: Path,
) -> None:
    program = tmp_path / "once.c"
    program.write_text("""\
#include <kilolib.h>
static uint16_t last, steps;
static void setup(void) {}
static void loop(void) {
    const uint16_t now = kilo_ticks;
    if (now == last) return;
    last = now;
    if (now % 64 == 0) set_color(++steps & 3);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
""")
    assert "tick-modulo" not in {check for check, _, _ in found(str(program))}


def test_an_index_beyond_its_array_is_told_with_its_value() -> None:
    said = advice("index_is_beyond_its_array", "array-bounds")
    assert "an index of 7 into 'uint8_t [4]'" in said


def test_a_trial_measures_calls_and_ticks() -> None:
    program = Path(__file__).parent / "programs_run/callback_computes_long.c"
    report = checked(str(program), Trial(TRIAL_S))
    trial = report.trial
    assert trial is not None
    (on_message,) = trial.callbacks
    assert on_message.function == "on_message"
    assert on_message.ms == pytest.approx(100, rel=0.05)
    # Three ticks come due in 100 ms, of which one waits.
    assert 0.9 * 2 * on_message.calls <= trial.ticks_lost <= 3 * on_message.calls
    assert trial.room_bytes == 2048 - report.ram_bytes - trial.stack_bytes


def advice(program: str, name: str) -> str:
    (path,) = [path for path in BAD_RUN if path.stem == program]
    (finding,) = [f for f in checked(str(path), Trial(TRIAL_S)).findings if f.check == name]
    return f"{finding.what}; {finding.do}"


def test_a_difference_in_time_is_told_by_its_cause() -> None:
    said = advice("light_is_read_after_a_delay", "differs-in-time")
    assert "reads the light some ms later" in said
    assert "both get the same readings of the light" in said


def test_a_program_that_prints_decides_the_same() -> None:
    program = Path(__file__).with_name("printing_takes_its_time.c")
    report = checked(str(program), Trial(TRIAL_S))
    assert report.findings == ()
    assert report.trial is not None
    assert report.trial.compared > 3


def test_a_difference_that_stays_names_what_it_may_be_in_this_program() -> None:
    said = advice("flash_has_no_sign", "differs")
    assert "a double that needs more than 32" in said
    assert "It may also be" not in said
    for program, line in (
        ("int_is_too_narrow_for_light", 13),
        ("int_is_too_narrow_at_run_time", 12),
    ):
        said = advice(program, "differs")
        assert f"mend first what does not fit its type: line {line} [int-overflow]" in said


def test_where_the_heap_meets_the_stack_malloc_is_named() -> None:
    assert "free()" in advice("heap_meets_stack", "stack-meets-data")
    assert "malloc" not in advice("recursion_meets_data", "stack-meets-data")


def test_callbacks_are_seen_through_casts_addresses_and_lines() -> None:
    place = Place("a.c", 1)
    text = [
        "kilo_message_rx = (message_rx_t)on_rx;",
        "kilo_message_tx = &on_tx;",
        "kilo_message_tx_success=sent;",
        "kilo_start(",
        "  setup, &loop);",
    ]
    roles = find_roles([Line(place, line) for line in text])
    assert roles.in_interrupts == {"on_rx", "on_tx", "sent"}
    assert roles.setup == {"setup"}
    assert roles.loop == {"loop"}


@pytest.mark.parametrize(
    ("program", "check", "other"),
    [
        ("shared_count_is_read_in_pieces", "torn-access", "on_message() in line 9 writes it"),
        ("message_is_filled_in_on_air", "message-race", "may take it in line "),
    ],
)
def test_a_race_is_told_with_both_its_lines(program: str, check: str, other: str) -> None:
    (path,) = [path for path in BAD if path.stem == program]
    (finding,) = [found for found in checked(str(path)).findings if found.check == check]
    assert finding.place is not None
    assert other in finding.what


def test_a_disassembly_is_read_with_calls_places_and_variables() -> None:
    text = (
        "000000e6 <loop>:\n"
        "loop():\n"
        "/a/b.c:42\n"
        "  e6:\t0f 93       \tpush\tr16\n"
        "  ea:\t40 91 47 01 \tlds\tr20, 0x0147\t; 0x800147 <kilo_ticks>\n"
        "/a/b.c:43 (discriminator 2)\n"
        "  f0:\t0e 94 7a 00 \tcall\t0xf4\t; 0xf4 <other>\n"
        "  f4:\t01 c0       \trjmp\t.+2      \t; 0xf8 <loop+0x12>\n"
        "  f6:\t09 95       \ticall\n"
        "  f8:\t00 c0       \trjmp\t.+0      \t; 0x0 <__vectors>\n"
    )
    loop = parse(text)["loop"]
    assert isinstance(loop, Function)
    assert [callee for _, callee in loop.calls] == ["other"]
    assert loop.instructions[1].data_address == 0x147
    assert loop.instructions[2].place == Place("/a/b.c", 43)
    assert isinstance(loop.instructions[0], Instruction)


def test_interrupts_are_off_where_every_way_goes_through_a_cli() -> None:
    text = (
        "00000100 <loop>:\n"
        " 100:\t11 23       \tand\tr17, r17\n"
        " 102:\t09 f0       \tbreq\t.+6      \t; 0x10a <loop+0xa>\n"
        " 104:\tf8 94       \tcli\n"
        " 106:\t80 91 00 01 \tlds\tr24, 0x0100\t; 0x800100 <heard>\n"
        " 10a:\t90 91 01 01 \tlds\tr25, 0x0101\t; 0x800101 <heard+0x1>\n"
        " 10e:\tf8 94       \tcli\n"
        " 110:\t10 fd       \tsbrc\tr17, 0\n"
        " 112:\t0f be       \tout\t0x3f, r0\t; 63\n"
        " 114:\t08 95       \tret\n"
        " 116:\t80 91 00 01 \tlds\tr24, 0x0100\t; 0x800100 <heard>\n"
    )
    # At 0x10a interrupts may be on, at 0x114 too, since the write to SREG may be skipped or not;
    # to 0x116 no way is known.
    assert parse(text)["loop"].uninterrupted == {0x106, 0x110, 0x112}


def test_the_command_says_what_the_trial_showed() -> None:
    program = "tests/port/programs_run/int_is_too_narrow_at_run_time.c"
    command = [sys.executable, "-m", "kilotwin", "port", program, "--time", "8", "--seed", "3"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert "  ran    8.0 s on the robot and here" in done.stdout
    assert "fails: it decides otherwise on the robot than here, first at tick 15" in done.stdout
    done = subprocess.run(
        [*command, "--json"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    report = json.loads(done.stdout)
    assert report["fails"]
    assert report["trial"]["seed"] == 3
    assert report["trial"]["first_difference"]["what"].startswith("here LED RGB(")
    assert report["trial"]["ticks_lost"] == 0
    assert [call["function"] for call in report["trial"]["loop"]] == ["loop"]


def test_indices_beyond_an_array_are_one_finding_for_a_line_and_the_first_are_named() -> None:
    prints = [(tick, f"\1a.c\t7\t{4 + tick}\tint[4]\n") for tick in range(12)]
    prints += [(12, "text\n"), (13, "\1a.c\t8\t9\tint[4]\n"), (14, "\1a.c\t8\t9\tint[4]\n")]
    many, one = bounds.findings(prints)
    assert many.what.startswith(
        "an index of 4 into int[4], at tick 0, then of 5, 6, 7, 8, 9, 10, 11, 12, 3 more: on"
    )
    assert one.what.startswith("an index of 9 into int[4], at tick 13: on")


def test_a_number_that_does_not_fit_is_told_with_variable_line_and_tick() -> None:
    said = advice("int_overflows", "int-overflow")
    assert "energy does not fit into 16 bits (`energy += 5000;`), first at tick " in said
    assert "from -32,768 to 32,767" in said
    assert "me->way does not fit" in advice("member_overflows", "int-overflow")
    said = advice("sum_without_a_sign_begins_anew", "int-overflow")
    assert "fuel does not fit" in said
    assert "from 0 to 65,535" in said
    # 9,000 a quarter of a second: the eighth sum is the first beyond 65,535.
    tick = int(re.search(r"tick (\d+)", said)[1])  # type: ignore[index]
    assert 7 * 0.25 / 0.032768 <= tick <= 7 * 0.25 / 0.032768 + 10


def test_sums_of_32_bits_and_such_as_fit_are_passed(tmp_path: Path) -> None:
    program = tmp_path / "wide.c"
    program.write_text("""\
#include <kilolib.h>
static uint32_t way;
static int32_t energy;
static uint16_t steps;
static int8_t side = 1;
static void setup(void) {}
static void loop(void) {
    way += 40000;
    energy -= 30000;
    steps++;
    side = -side;
    set_color(way > 1000000 && energy < 0 && side > 0 && steps ? RGB(1, 0, 0) : RGB(0, 1, 0));
    delay(100);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
""")
    assert found(str(program), Trial(TRIAL_S)) == []


@pytest.mark.parametrize(
    "callback",
    [
        "return 0;",
        "heard++; return NULL;",
        "if (heard > 3) { heard = 0; return (message_t *)0; } return 0;",
        "return out;",
    ],
)
def test_a_transmit_callback_that_never_has_a_message_needs_no_checksum(
    callback: str, tmp_path: Path
) -> None:
    program = tmp_path / "quiet.c"
    program.write_text(f"""\
#include <kilolib.h>
#include <stddef.h>
static volatile uint8_t heard;
static message_t *out;
static message_t *on_transmit(void) {{ {callback} }}
static void setup(void) {{}}
static void loop(void) {{}}
int main(void) {{
    kilo_init();
    kilo_message_tx = on_transmit;
    kilo_start(setup, loop);
    return 0;
}}
""")
    assert found(str(program)) == []


def test_a_message_with_a_checksum_of_its_own_making_is_passed(tmp_path: Path) -> None:
    program = tmp_path / "own.c"
    program.write_text("""\
#include <kilolib.h>
#include <util/crc16.h>
static message_t message;
static message_t *on_transmit(void) { return &message; }
static void setup(void) {
    uint16_t crc = 0xFFFF;
    message.type = NORMAL;
    for (uint8_t i = 0; i < 9; i++) crc = _crc_ccitt_update(crc, message.data[i]);
    message.crc = _crc_ccitt_update(crc, message.type);
}
static void loop(void) {}
int main(void) {
    kilo_init();
    kilo_message_tx = on_transmit;
    kilo_start(setup, loop);
    return 0;
}
""")
    assert "no-crc" in {check for check, _, _ in found(str(program))}
    assert found(str(program), Trial(TRIAL_S)) == []


def test_a_message_that_is_met_at_the_end_of_a_delay_is_a_difference_in_time(
    tmp_path: Path,
) -> None:
    program = tmp_path / "listens.c"
    program.write_text("""\
#include <kilolib.h>
static volatile uint8_t heard;
static void on_message(message_t *m, distance_measurement_t *d) { (void)m; (void)d; heard = 1; }
static void setup(void) {}
static void loop(void) {
    set_color(heard ? RGB(0, 1, 0) : RGB(1, 0, 0));
    heard = 0;
    delay(170);
}
int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
""")
    report = checked(str(program), Trial(30))
    assert [f.check for f in report.findings] == ["differs-in-time"]
    assert "interrupts prolong delay()" in report.findings[0].what
    assert not report.fails


def test_what_kilombo_programs_have_for_the_robot_is_meant(tmp_path: Path) -> None:
    """Kilombo's Makefile defines KILOBOT for the robot."""
    program = tmp_path / "drive.c"
    program.write_text("""\
#include "kilombo.h"
#ifdef KILOBOT
static void start(void) { spinup_motors(); }
#else
static void start(void) {}
#endif
static void setup(void) { start(); set_motors(70, 70); }
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
""")
    assert found(str(program), Trial(TRIAL_S)) == []
    assert find_program(str(program), tmp_path).defines == ("KILOBOT",)
    assert find_program(str(program), tmp_path, defines=["KILOBOT=2"]).defines == ("KILOBOT=2",)
