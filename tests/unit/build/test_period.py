"""Which programs cannot change kilo_tx_period after their set-up: told from their objects."""

import shutil
import subprocess
from pathlib import Path

import pytest

from kilotwin.programs.native import period

HEAD = """
#include <stdint.h>
extern volatile uint16_t kilo_tx_period;
extern uint16_t kilo_uid;
void kilo_start(void (*setup)(void), void (*loop)(void));
void delay(uint16_t ms);
static uint32_t count;
"""
MAIN = "int kt_guest_main(void) { kilo_start(setup, loop); return 0; }\n"
LOOP = "static void loop(void) { count++; }\n"
SETUP = "static void setup(void) { kilo_tx_period = 900; }\n"

SETTLED = {
    "in setup()": SETUP + LOOP + MAIN,
    "in setup(), as the uid says": "static void setup(void) { if (kilo_uid == 1) "
    "kilo_tx_period = kilo_uid * 8; delay(5); }\n" + LOOP + MAIN,
    "in a function that setup() calls": "static void slow(void) { kilo_tx_period += 900; }\n"
    "static void setup(void) { slow(); }\n" + LOOP + MAIN,
    "in main()": "static void setup(void) {}\n"
    + LOOP
    + "int kt_guest_main(void) { kilo_tx_period = 5; kilo_start(setup, loop); return 0; }\n",
}
CHANGING = {
    "in loop()": "static void setup(void) {}\nstatic void loop(void) { kilo_tx_period++; }\n"
    + MAIN,
    "in a function that loop() calls too": "static void slow(void) { kilo_tx_period = 900; }\n"
    "static void setup(void) { slow(); }\nstatic void loop(void) { if (count++ > 9) slow(); }\n"
    + MAIN,
    "in setup(), which loop() calls": SETUP
    + "static void loop(void) { if (count++ > 9) setup(); }\n"
    + MAIN,
    "in setup(), which is loop() too": SETUP
    + "int kt_guest_main(void) { kilo_start(setup, setup); return 0; }\n",
    "in a callback": "void (*sent)(void);\nstatic void on_sent(void) { kilo_tx_period = 9; }\n"
    "static void setup(void) { sent = on_sent; }\n" + LOOP + MAIN,
    "in a table of functions": SETUP + "void (*const steps[])(void) = {setup};\n" + LOOP + MAIN,
    "by a pointer": "volatile uint16_t *own;\n"
    "static void setup(void) { own = &kilo_tx_period; }\n"
    "static void loop(void) { *own = 9; }\n" + MAIN,
    "by a pointer in the data": "volatile uint16_t *own = &kilo_tx_period;\n"
    "static void setup(void) { kilo_tx_period = 2; }\n" + LOOP + MAIN,
    "in setup(), which another function passes on": SETUP
    + LOOP
    + "static void start(void (*setup)(void)) { kilo_start(setup, loop); }\n"
    "int kt_guest_main(void) { start(setup); return 0; }\n",
    "in a function whose text is elsewhere": "void elsewhere(void);\n"
    + SETUP
    + "static void loop(void) { elsewhere(); }\n"
    + MAIN,
    "in main(), which loop() calls": "int kt_guest_main(void);\nstatic void setup(void) {}\n"
    "static void loop(void) { kt_guest_main(); }\n"
    "int kt_guest_main(void) { kilo_tx_period++; kilo_start(setup, loop); return 0; }\n",
}


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize(
    ("text", "settled"),
    [
        *(pytest.param(text, True, id=where) for where, text in SETTLED.items()),
        *(pytest.param(text, False, id=where) for where, text in CHANGING.items()),
    ],
)
def test_a_period_is_settled_if_only_set_up_can_change_it(
    tmp_path: Path, compiler: str, text: str, settled: bool
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not here")
    source, compiled = tmp_path / "program.c", tmp_path / "program.o"
    source.write_text(HEAD + text)
    subprocess.run([compiler, *period.FLAGS, "-c", source, "-o", compiled], check=True)

    def printed(*words: str) -> str:
        return subprocess.run([*words, compiled], check=True, capture_output=True, text=True).stdout

    missing = {line.split()[0] for line in printed("nm", "-u", "-P").splitlines()}
    known = {"kilo_start", "delay", "kilo_uid", period.PERIOD}
    found = period.is_settled(
        printed("objdump", "-drw", "--no-show-raw-insn"),
        printed("objdump", "-rw"),
        period.functions_of(printed("nm", "-P")),
        missing - known,
    )
    assert found is settled
