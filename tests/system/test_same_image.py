"""`make firmware`, `make modules` and `kilotwin build` give the same bytes, and the same sizes."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from kilotwin.programs.image.boot_loader import build_boot_loader

from .conftest import ROOT, Kilotwin

WALKER = """
#include <kilolib.h>
#include "speed.h"
static uint8_t duty = SPEED;
static void setup(void) { set_motors(duty, duty); }
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
# Brings one helper of its own, and its header, and takes others from us.
LAB = """
#include <kilolib.h>
#include <utils.h>
#include <kilob_random_walk.h>
#include <kilob_tracking.h>
message_rx_t utils_message_rx;
static volatile uint8_t duty = OWN_DUTY;
void move_straight(void) { set_motors(duty, duty); }
void turn_left(void) { set_motors(kilo_turn_left, 0); }
void turn_right(void) { set_motors(0, kilo_turn_right); }
void stop(void) { set_motors(0, 0); }
static void setup(void) { kilob_tracking_init(); kilob_random_walk_init(3, 1.5, 1.5, 3); }
static void loop(void) { kilob_random_walk(); kilob_message_send(); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
CELL = """
#include <module.h>
#include <moduleLED.h>
#include <kilo_rand_lib.h>
static void setup(void) { set_all_LEDs(g_ran_uniform() < 0.5 ? RED : BLUE); }
static void loop(void) {}
int main(void) { module_init(); module_start(setup, loop); }
"""

FLASH, RAM = 1, 2


def made(folder: str, out: Path, *words: str) -> tuple[Path, list[str]]:
    """The .hex of the one program, and its line of the report."""
    command = ["make", "-s", "-C", str(ROOT / folder), f"BUILD={out}", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    (image,) = (file for file in out.rglob("*.hex") if file.stem != "bootloader")
    (line,) = [line for line in done.stdout.splitlines() if line.split()[0] == image.stem]
    return image, line.split()


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    folder = tmp_path / "walk.v2"
    folder.mkdir()
    (folder / "main.c").write_text(WALKER)
    (folder / "speed.h").write_text("#define SPEED 70\n")
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "lab.c").write_text(LAB)
    (tmp_path / "lab" / "utils.h").write_text("#define OWN_DUTY 66\n")
    (tmp_path / "cell.c").write_text(CELL)
    return tmp_path


@pytest.mark.parametrize(
    ("folder", "program", "words"),
    [
        ("firmware", "walk.v2", []),
        ("firmware", "lab", ["FLAVOUR=kilogrid"]),
        ("firmware", str(ROOT / "firmware/aggregation"), []),
        ("kilogrid_modules", "cell.c", []),
        ("kilogrid_modules", str(ROOT / "kilogrid_modules/sites"), []),
    ],
)
def test_make_and_kilotwin_build_give_the_same_bytes(
    folder: str, program: str, words: list[str], programs: Path, kilotwin: Kilotwin
) -> None:
    source = programs / program
    target = "module" if folder == "kilogrid_modules" else "robot"
    output = programs / "out.hex"
    words = [f"PROGRAM={source}", *words]
    image, line = made(folder, programs / "made", *words)
    done = kilotwin("build", source, "--for", target, "--hex", output, "--json")
    report: dict[str, Any] = json.loads(done.stdout)
    assert output.read_bytes() == image.read_bytes()
    assert (int(line[FLASH]), int(line[RAM])) == (report["flash_bytes"], report["ram_bytes"])
    assert report["build_id"].startswith(f"{target} {report['program']} avr-gcc-")


def test_our_own_programs_are_made_with_the_same_bytes(tmp_path: Path, kilotwin: Kilotwin) -> None:
    """Without PROGRAM their objects come by other rules of the Makefiles."""
    image, line = made("kilogrid_modules", tmp_path / "made")
    output = tmp_path / "out.hex"
    words = ["build", "kilogrid_modules/sites", "--for", "module", "--hex", output, "--json"]
    report = json.loads(kilotwin(*words).stdout)
    assert output.read_bytes() == image.read_bytes()
    assert int(line[FLASH]) == report["flash_bytes"]
    loader = (image.parent / "bootloader.hex").read_bytes()
    assert build_boot_loader("module").read_bytes() == loader

    command = ["make", "-s", "-C", str(ROOT / "firmware"), f"BUILD={tmp_path}/robots"]
    subprocess.run(command, capture_output=True, timeout=600, check=True)
    # And the boot loader, which has flags and vectors of its own.
    loader = (tmp_path / "robots" / "bootloader.hex").read_bytes()
    assert build_boot_loader().read_bytes() == loader
    for name, source in (("aggregation", "firmware/aggregation"), ("blank", "firmware/blank.c")):
        kilotwin("build", source, "--hex", output, "--quiet")
        assert output.read_bytes() == (tmp_path / "robots" / f"{name}.hex").read_bytes()


def test_port_and_build_give_one_number_for_flash(kilotwin: Kilotwin, tmp_path: Path) -> None:
    program = "firmware/examples/orbit.c"
    built = json.loads(kilotwin("build", program, "--hex", tmp_path / "o.hex", "--json").stdout)
    ported = json.loads(kilotwin("port", program, "--no-run", "--json").stdout)
    assert built["flash_bytes"] == ported["flash_bytes"]
    assert built["ram_bytes"] == ported["ram_bytes"]


def test_eeprom_that_make_leaves_out_is_said(tmp_path: Path) -> None:
    (tmp_path / "kept.c").write_text("#include <avr/eeprom.h>\nuint8_t EEMEM a[3] = {1};\n" + CELL)
    image, line = made("kilogrid_modules", tmp_path / "made", f"PROGRAM={tmp_path}/kept.c")
    assert " ".join(line[3:]) == "3 bytes of .eeprom are left out"
    assert ":02000004008179" not in image.read_text()
