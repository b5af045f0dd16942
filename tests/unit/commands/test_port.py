"""The command `kilotwin port` without a trial: text, JSON, exit codes."""

import json
from pathlib import Path

from ..conftest import Kilotwin

NOT_KICKED = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) {
    set_motors(kilo_straight_left, kilo_straight_right);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


def test_a_good_program_ends_with_0_and_its_sizes(kilotwin: Kilotwin) -> None:
    report = json.loads(kilotwin("port", "blink.c", "--no-run", "--json").stdout)
    assert not report["fails"]
    assert 3000 < report["flash_bytes"] < report["flash_budget_bytes"] == 28160
    assert 0 < report["stack_bound_bytes"] < 200
    assert report["trial"] is None


def test_what_would_fail_on_the_robot_ends_with_1_and_its_line(
    kilotwin: Kilotwin, folder: Path
) -> None:
    (folder / "walk.c").write_text(NOT_KICKED)
    done = kilotwin("port", "walk.c", "--no-run", expect=1)
    assert "walk.c:4: fails: motors that stand do not start" in done.stdout
    (finding,) = json.loads(kilotwin("port", "walk.c", "--no-run", "--json", expect=1).stdout)[
        "findings"
    ]
    assert (finding["check"], finding["line"]) == ("no-kick", 4)


ARGOS = """\
#include <kilolib.h>
#include <debug.h>
static void setup(void) {}
static void loop(void) {
    debug_info_set(commitment, kilo_ticks);
    set_color(SHADE(1, 2));
}
int main(void) { kilo_init(); debug_info_create(); kilo_start(setup, loop); return 0; }
"""


def test_macros_of_argos_and_macros_with_parameters_build(kilotwin: Kilotwin, folder: Path) -> None:
    (folder / "argos.c").write_text(ARGOS)
    done = kilotwin("port", "argos.c", "-D", "SHADE(a,b)=RGB(a, b, 0)", "--no-run", "--json")
    assert json.loads(done.stdout)["findings"] == []


def test_a_program_that_is_not_there_is_bad_input(kilotwin: Kilotwin) -> None:
    assert "nothing.c" in kilotwin("port", "nothing.c", expect=2).stderr


def test_a_program_that_does_not_fit_at_all_ends_with_1(kilotwin: Kilotwin, folder: Path) -> None:
    (folder / "huge.c").write_text(
        "#include <kilolib.h>\nuint8_t all[30000] = {1};\n"
        "int main(void) { kilo_init(); all[kilo_uid]++; return all[kilo_uid + 1]; }\n"
    )
    done = kilotwin("port", "huge.c", expect=1)
    assert "huge.c: does not fit into the robot: it" in done.stderr
