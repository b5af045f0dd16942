"""Programs of Kilogrid labs: which flavour they are, and which helpers they get."""

import shutil
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program, find_program
from kilotwin.experiment.text import ExperimentText
from kilotwin.programs.native import guest as guest_build

HERE = Path("/nowhere")

ROBOT = """
#include <kilolib.h>
#include <utils.h>
#include <kilob_tracking.h>

static tracking_user_data_t data;
static void rx(IR_message_t *m, distance_measurement_t *d) { data.byte[1] = m->type; }
static void setup(void) { kilob_tracking_init(); }
static void loop(void) { move_straight(); kilob_tracking(&data); }

int main(void) {
    kilo_init();
    utils_init();
    utils_message_rx = rx;
    kilo_start(setup, loop);
}
"""

# As labs write them: registers, `inline` without a word more, and another idea of a report.
OWN_UTILS = """
#include <avr/io.h>
#include <util/delay.h>
#include "kilolib.h"
#include "utils.h"

message_rx_t utils_message_rx;
inline void utils_init() { kilo_message_rx = utils_message_rx; }
inline void move_straight() { OCR2A = 77; OCR2B = OWN_DUTY; _delay_ms(20); }
"""
OWN_UTILS_H = """
#include <kilolib.h>
#define OWN_DUTY 66
#define MS_TO_TICKS(a) ((a) / 32)
extern message_rx_t utils_message_rx;
void utils_init();
void move_straight();
"""

MODULE = """
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"
#include "CAN.h"

static void rx(IR_message_t *m, cell_num_t c, distance_measurement_t *d, uint8_t crc_error) {
    CAN_message_t *record = next_CAN_message();
    if (record != NULL) serialize_tracking_message(record, c, m->data);
}
void setup(void) { set_all_LEDs(configuration[0] ? RED : BLUE); }
void loop(void) {}
int main(void) {
    module_init();
    module_IR_message_rx = rx;
    module_start(setup, loop);
}
"""


def written(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name[:-2]}.{name[-1]}").write_text(text)
    return folder


def symbols(program: Program) -> str:
    guest = guest_build.build(program)
    nm = shutil.which("nm")
    assert nm is not None
    return guest_build.run_tool([nm, str(guest.file)], "nm")


@pytest.mark.parametrize(
    ("line", "api"),
    [
        ("#include <kilolib.h>", "kilobot"),
        ('#include "utils.h"', "kilobot"),
        ("IR_message_t message;", "kilogrid"),
        ("#include <kilogrid.h>", "kilogrid"),
        ('  #  include "kilob_random_walk.h"', "kilogrid"),
    ],
)
def test_a_program_is_of_the_flavour_that_its_sources_look_like(
    tmp_path: Path, line: str, api: str
) -> None:
    (tmp_path / "main.c").write_text(f"int x;\n{line}\n")
    assert find_program("main.c", tmp_path).api == api


def test_the_key_flavour_decides(tmp_path: Path) -> None:
    (tmp_path / "main.c").write_text("IR_message_t message;\n")
    assert find_program("main.c", tmp_path, api="kilobot").api == "kilobot"
    tables = {
        "name": "x",
        "duration_s": 1.0,
        "arena": {"diameter_m": 1.0},
        "swarm": {"profile": "kilobot"},
        "robots": [{"program": str(tmp_path / "main.c"), "count": 1, "flavour": "kilobot"}],
    }
    experiment = Experiment.of(ExperimentText("test", tmp_path, tables, "", []))
    assert experiment.groups[0].program.api == "kilobot"


def test_a_lab_program_without_helpers_gets_ours(tmp_path: Path) -> None:
    program = find_program(str(written(tmp_path, main_c=ROBOT)), HERE)
    names = symbols(program)
    assert " kilob_message_send" in names
    assert " safe_set_motors" in names
    assert "g_ran_uniform" not in names  # nothing calls it


def test_a_lab_program_keeps_its_own_helpers(tmp_path: Path) -> None:
    files = {"main_c": ROBOT, "utils_c": OWN_UTILS, "utils_h": OWN_UTILS_H}
    names = symbols(find_program(str(written(tmp_path, **files)), HERE))
    assert " safe_set_motors" not in names  # of ours
    assert " kilob_message_send" in names  # it lacks that one


def test_a_lab_program_may_bring_the_checksum(tmp_path: Path) -> None:
    own = "#include <kilolib.h>\nuint16_t message_crc(const IR_message_t *m) { return 1; }\n"
    guest_build.build(find_program(str(written(tmp_path, main_c=ROBOT, crc_c=own)), HERE))


def test_a_lab_program_may_name_its_own_times_as_the_random_walk_might(tmp_path: Path) -> None:
    names = ("FORWARD_MU", "FORWARD_SIGMA", "ROTATION_CONST", "ROTATION_SPAN")
    own = "".join(f"static const float RW_{name} = 2;\n" for name in names)
    source = f"#include <kilob_random_walk.h>\n{own}{ROBOT}"
    guest_build.build(find_program(str(written(tmp_path, main_c=source)), HERE))


def test_a_module_program_becomes_a_guest(tmp_path: Path) -> None:
    program = find_program(str(written(tmp_path, main_c=MODULE)), HERE, api="module")
    names = symbols(program)
    assert " module_ticks" in names
    assert " kilo_ticks" not in names
    assert " CAN_message_tx\n" not in names  # so that the engine knows it never sends by itself


def test_a_module_program_that_does_not_compile_is_an_input_error(tmp_path: Path) -> None:
    written(tmp_path, main_c=MODULE.replace("RED", "PURPLE"))
    with pytest.raises(InputError) as error:
        guest_build.build(find_program(str(tmp_path), HERE, api="module"))
    assert "PURPLE" in error.value.detail
