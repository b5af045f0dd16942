"""`kilotwin port` on what makes a result an artefact of the code: coarse draws, unguarded ticks,
halves for a simulator, arrays that leave no room for a stack."""

import re
from pathlib import Path

import pytest

from kilotwin.programs.port.check import Report, check
from kilotwin.programs.port.trial import Trial

ROOT = Path(__file__).resolve().parents[2]
UPDATE_TIME = ROOT / "experiments/kilogrid/update-time/robot.c"


def checked(program: Path, *define: str, trial: Trial | None = None) -> Report:
    return check([str(program)], [], define, trial, lambda _: None)


@pytest.mark.parametrize(
    ("draw", "most", "chance"),
    [
        ("((uint16_t)rand_soft() << 8 | rand_soft())", "65535.0f", "0.5 * exp(-2.0 * heard)"),
        ("((uint32_t)rand_soft() << 8 | rand_soft())", "65536.0f", "0.001"),
        ("rand()", "(float)RAND_MAX", "exp(-1.0 * heard)"),
        ("rand_hard()", "255.0f", "0.02"),
        ("rand_hard()", "255.0f", "(float)heard / (heard + 1)"),
        ("rand_soft()", "255.0f", "(heard ? 0.25 : 0)"),
    ],
)
def test_a_draw_that_is_fine_enough_is_passed(
    draw: str, most: str, chance: str, tmp_path: Path
) -> None:
    program = tmp_path / "draws.c"
    program.write_text(f"""\
#include <kilolib.h>
#include <math.h>
#include <stdlib.h>
static volatile uint8_t heard;
static float uniform(void) {{ return (float){draw} / {most}; }}
static void setup(void) {{}}
static void loop(void) {{
    if (uniform() < {chance}) set_color(RGB(0, 1, 0));
    delay(100);
}}
int main(void) {{ kilo_init(); kilo_start(setup, loop); return 0; }}
""")
    assert "few-bits" not in {finding.check for finding in checked(program).findings}


def test_bytes_that_a_loop_draws_are_counted(tmp_path: Path) -> None:
    """As the update-time experiment draws, whose macro says how many."""
    for bits, named in ((8, True), (16, False), (32, False)):
        report = checked(UPDATE_TIME, f"DRAW_BITS={bits}")
        findings = [one for one in report.findings if one.check == "few-bits"]
        assert bool(findings) == named, bits
        assert all("has 256 values: the probability" in one.what for one in findings)


def test_a_minute_without_a_guard_is_named_with_the_passes_of_a_tick() -> None:
    report = checked(UPDATE_TIME, "UPDATE_S=0", trial=Trial(2))
    (finding,) = [one for one in report.findings if one.check == "tick-modulo"]
    (times,) = re.findall(r"loop\(\) runs ([\d,]+) times \(in this trial\)", finding.what)
    assert int(times.replace(",", "")) > 100
    guarded = checked(UPDATE_TIME, "UPDATE_S=0", "GUARDED=1")
    assert "tick-modulo" not in {one.check for one in guarded.findings}


@pytest.mark.parametrize(
    ("lines", "simulated", "robots"),
    [
        ("#ifdef SIMULATION\nset_color(1);\n#endif", 1, 0),
        ("#ifndef SIMULATOR\nset_color(1);\n#else\nset_color(2);\ndelay(1);\n#endif", 2, 1),
        ("#if !defined(ARGOS_BUILD)\nset_color(1);\n#endif", 0, 1),
        ("#ifdef SIMULATION\n#define TRIES 1\n#else\n#define TRIES 10\n#endif", 1, 1),
    ],
)
def test_lines_of_a_simulator_and_of_the_robot_are_counted(
    lines: str, simulated: int, robots: int, tmp_path: Path
) -> None:
    program = tmp_path / "halves.c"
    program.write_text(f"""\
#include <kilolib.h>
static void setup(void) {{}}
static void loop(void) {{
{lines}
}}
int main(void) {{ kilo_init(); kilo_start(setup, loop); return 0; }}
""")
    (finding,) = checked(program).findings
    assert f"other lines ({simulated}) than are built here and for the robot ({robots})" in (
        finding.what
    )


def test_halves_that_differ_by_headers_alone_are_passed(tmp_path: Path) -> None:
    program = tmp_path / "headers.c"
    program.write_text("""\
#include <kilolib.h>
#ifdef SIMULATION
#include "agent.h"
#else
#include <stdlib.h>
#endif
// #ifdef SIMULATION
static void setup(void) {}
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
""")
    assert checked(program).findings == ()


def test_an_array_is_named_that_leaves_little_room_for_the_stack() -> None:
    program = Path(__file__).parent / "programs/array_leaves_little_stack.c"
    (finding,) = checked(program).findings
    assert re.match(r"seen takes 1,728 of 2,048 bytes of RAM, which leaves 2\d\d for", finding.what)
