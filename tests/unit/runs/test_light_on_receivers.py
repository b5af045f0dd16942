"""Light of a frame on a robot's receiver: kilolib's sensors return -1 meanwhile, and the engine
keeps it only for programs that may read a sensor."""

from pathlib import Path

import pytest

from kilotwin import RGB, World

PROGRAM = """\
#include <kilolib.h>
{includes}
static message_t message;
static message_t *tx(void) {{ return &message; }}
static void setup(void) {{
    message.type = NORMAL;
    message.crc = message_crc(&message);
    kilo_message_tx = tx;
    kilo_tx_period = kilo_uid == 1 ? 50 : 65000;
}}
{code}
static void loop(void) {{ if ({reading} {failed}) set_color(RGB(1, 0, 0)); delay(5); }}
int main(void) {{ kilo_init(); kilo_start(setup, loop); return 0; }}
"""
# The converter has a result all the same: the engine gives 0 in place of the unknown one.
BY_REGISTER = """\
static int16_t reading(void) {
    ADMUX = 0x47;
    ADCSRA |= 1 << ADSC;
    while (ADCSRA & 1 << ADSC) continue;
    return ADC;
}
"""


@pytest.mark.parametrize(
    ("reading", "failed", "code", "includes"),
    [
        ("get_ambientlight()", "< 0", "", ""),
        ("get_voltage()", "< 0", "", ""),
        ("get_temperature()", "< 0", "", ""),
        ("read()", "< 0", "static int16_t (*read)(void) = get_voltage;", ""),
        ("reading()", "== 0", BY_REGISTER, "#include <avr/io.h>"),
    ],
)
def test_a_program_sees_frames_whichever_way_it_reads_a_sensor(
    reading: str, failed: str, code: str, includes: str, tmp_path: Path
) -> None:
    program = tmp_path / "reads.c"
    program.write_text(PROGRAM.format(reading=reading, failed=failed, code=code, includes=includes))
    with World(
        program=program,
        count=2,
        arena=0.3,
        profile="kilobot",
        cpu="native",
        medium={"kind": "kilobot"},
        light={"ambient": 300},
        poses=[[-0.03, 0, 0], [0.03, 0, 0]],
        seed=1,
    ) as world:
        world.run(30)
        assert world.leds[1] == RGB(1, 0, 0)


def test_a_program_may_bring_a_function_of_its_own_in_place_of_a_sensors(tmp_path: Path) -> None:
    program = tmp_path / "own.c"
    own = "int16_t get_voltage(void) { return 5; }"
    program.write_text(
        PROGRAM.format(reading="get_voltage()", failed="== 5", code=own, includes="")
    )
    with World(program=program) as world:
        world.run(1)
        assert world.leds[0] == RGB(1, 0, 0)
