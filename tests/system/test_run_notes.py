"""Notes at the end of a run: what hardly anybody means."""

import json
from pathlib import Path

import pytest

from .conftest import Kilotwin

EXPERIMENT = """\
duration_s = 8
[arena]
diameter_m = {diameter_m}
[swarm]
profile = "kilobot"
cpu = "{cpu}"
[[robots]]
program = "program.c"
count = 3
poses = [[0, 0, 0], [0.06, 0, 0], [{far_m}, 0, 0]]
"""
PROGRAM = """\
#include "kilombo.h"
static message_t message;
static volatile uint8_t heard;
static uint16_t me;
static message_t *on_transmit(void) { return &message; }
static void on_message(message_t *m, distance_measurement_t *d) { (void)m; (void)d; heard = 1; }
static void setup(void) { me = kilo_uid; SETUP }
static void loop(void) { LOOP }
int main(void) { kilo_init(); MAIN kilo_start(setup, loop); return 0; }
"""
SENDS = "kilo_message_tx = on_transmit;"
HEARS = "kilo_message_rx = on_message;"
WITH_CRC = "message.crc = message_crc(&message);"


def notes(
    kilotwin: Kilotwin,
    folder: Path,
    *,
    setup: str = "",
    loop: str = "",
    main: str = "",
    cpu: str = "auto",
    far_m: float = 0.12,
) -> str:
    folder.mkdir(exist_ok=True)
    parts = {"SETUP": setup, "LOOP": loop, "MAIN": main}
    program = PROGRAM
    for name, code in parts.items():
        program = program.replace(name, code)
    (folder / "program.c").write_text(program)
    file = folder / "experiment.toml"
    file.write_text(EXPERIMENT.format(cpu=cpu, diameter_m=4 * far_m + 0.5, far_m=far_m))
    done = kilotwin("run", file, "--out", folder / "run", "--json", "--no-twin")
    return "\n".join(json.loads(done.stdout)["notes"]).replace(f"{folder}/", "")


@pytest.mark.parametrize("cpu", ["translated", "native", "avr"])
def test_motors_that_are_on_and_do_not_turn_are_told(
    kilotwin: Kilotwin, tmp_path: Path, cpu: str
) -> None:
    said = notes(kilotwin, tmp_path, cpu=cpu, loop="set_motors(70, 0); delay(500);")
    assert said.startswith("program: motors of 3 robots were on for up to ")
    assert "spinup_motors()" in said


@pytest.mark.parametrize(
    "loop",
    [
        "spinup_motors(); set_motors(70, 70); delay(3000); set_motors(0, 0); delay(500);",
        "set_motors(70, 0); delay(400); set_motors(0, 0); delay(60000);",
    ],
)
def test_motors_that_turn_or_are_on_for_a_moment_are_not(
    kilotwin: Kilotwin, tmp_path: Path, loop: str
) -> None:
    assert notes(kilotwin, tmp_path, loop=loop) == ""


def test_a_kick_that_kilombo_has_for_the_robot_only_moves_it(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    kick = "\n#ifdef KILOBOT\nspinup_motors();\n#endif\n"
    assert notes(kilotwin, tmp_path, setup=f"{kick} set_motors(70, 70);") == ""


def test_frames_that_no_program_listens_for_are_told(kilotwin: Kilotwin, tmp_path: Path) -> None:
    said = notes(kilotwin, tmp_path / "deaf", setup=WITH_CRC, main=SENDS)
    assert "frames reached robots, and no program sets kilo_message_rx" in said
    assert notes(kilotwin, tmp_path / "hears", setup=WITH_CRC, main=SENDS + HEARS) == ""


def test_frames_that_nobody_receives_are_told_with_why(kilotwin: Kilotwin, tmp_path: Path) -> None:
    said = notes(kilotwin, tmp_path / "spoilt", main=SENDS + HEARS)
    assert "none with the right checksum" in said
    far_one = f"if (kilo_uid == 3) {SENDS}"
    far = {"setup": WITH_CRC + far_one, "main": HEARS}
    said = notes(kilotwin, tmp_path / "far", far_m=1.5, **far)
    assert "no robot received one: none was within medium.range_m = 0.1 of a sender" in said


@pytest.mark.parametrize(
    "test",
    [
        "if (kilo_uid == 0) set_color(1);",
        "set_color(kilo_uid > 0 ? 1 : 2);",
        "if (!me) set_color(1);",
        "enum { SEED }; switch (kilo_uid) { case SEED: set_color(1); break; default: delay(5); }",
        "uint8_t id = kilo_uid; if (id == 0) set_color(1);",
    ],
)
def test_a_uid_of_0_that_no_robot_has_is_told_with_its_line(
    kilotwin: Kilotwin, tmp_path: Path, test: str
) -> None:
    said = notes(kilotwin, tmp_path, loop=test)
    assert said == (
        "program.c:8: kilo_uid is compared with 0, which no robot has: they have 1 to 3; "
        "swarm.first_uid = 0 counts from 0"
    )


@pytest.mark.parametrize(
    "test",
    [
        "if (kilo_uid == 1) set_color(1);",
        "if (kilo_uid % 2 == 0) set_color(1);",
        "if (me & 1) set_color(1);",
        "if (kilo_uid < 3) set_color(1);",
    ],
)
def test_other_questions_about_the_uid_are_not(
    kilotwin: Kilotwin, tmp_path: Path, test: str
) -> None:
    assert notes(kilotwin, tmp_path, loop=test) == ""


@pytest.mark.parametrize("cpu", ["translated", "native", "avr"])
def test_setup_or_loop_that_never_returns_is_told(
    kilotwin: Kilotwin, tmp_path: Path, cpu: str
) -> None:
    said = notes(kilotwin, tmp_path, loop="while (1) set_color(2);", cpu=cpu)
    assert said == "program.c:8: loop() never returns: its robots stay there"
    (tmp_path / "setup").mkdir()
    said = notes(kilotwin, tmp_path / "setup", setup="for (;;) { delay(100); }", cpu=cpu)
    assert said == "program.c:7: setup() never returns: its robots stay there"


@pytest.mark.parametrize(
    "loop",
    [
        "while (1) { if (kilo_ticks > 100) break; delay(10); }",
        # libgcc makes a float of a number without a sign in the midst of the one with.
        "static volatile float s; s = (float)kilo_ticks / 32;",
    ],
)
def test_a_loop_with_a_way_out_is_not(kilotwin: Kilotwin, tmp_path: Path, loop: str) -> None:
    assert notes(kilotwin, tmp_path, loop=loop) == ""
