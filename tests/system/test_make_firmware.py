"""`make firmware`: .hex files, sizes, budgets, another kilolib, a user's program."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"

USER_PROGRAM = """
#include <kilolib.h>
#include "speed.h"
static void setup(void) { set_motors(SPEED, SPEED); }
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""

# Code that the linker keeps.
PADDING = """
__attribute__((section(".init3"), naked, used)) void padding(void) { __asm__(".space 1000"); }
"""


def make(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["make", "-s", "-C", str(FIRMWARE), *arguments],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


def size_of(report: str, program: str) -> tuple[int, int]:
    for line in report.splitlines():
        fields = line.split()
        if fields and fields[0] == program:
            return int(fields[1]), int(fields[2])
    raise AssertionError(f"{program} is not in the report:\n{report}")


@pytest.fixture
def walker(tmp_path: Path) -> Path:
    folder = tmp_path / "walker"
    folder.mkdir()
    (folder / "walker.c").write_text(USER_PROGRAM)
    (folder / "speed.h").write_text("#define SPEED 70\n")
    return folder


def test_a_users_program_becomes_a_hex_file_with_a_size(tmp_path: Path, walker: Path) -> None:
    for program in (walker, walker / "walker.c"):
        made = make(f"BUILD={tmp_path}/out", f"PROGRAM={program}")
        assert made.returncode == 0, made.stderr
        flash, ram = size_of(made.stdout, "walker")
        assert 2000 < flash < 4500
        assert ram < 100
        hexfile = (tmp_path / "out" / "walker.hex").read_text()
        assert hexfile.startswith(":10")
        assert hexfile.rstrip().endswith(":00000001FF")


def test_the_flagship_fits_in_20_kb_of_flash_and_1200_bytes_of_ram(tmp_path: Path) -> None:
    made = make(f"BUILD={tmp_path}", "firmware")
    assert made.returncode == 0, made.stderr
    flash, ram = size_of(made.stdout, "aggregation")
    assert flash < 20 * 1024
    assert ram < 1200
    assert (tmp_path / "aggregation.elf").exists()


def test_a_program_beyond_its_budget_fails_the_check(tmp_path: Path) -> None:
    budget = tmp_path / "budget.txt"
    budget.write_text((FIRMWARE / "size_budget.txt").read_text())
    assert make(f"BUILD={tmp_path}", f"BUDGET={budget}", "check-size").returncode == 0
    budget.write_text(re.sub(r"(?m)^blank +\d+", "blank 1000", budget.read_text()))
    made = make(f"BUILD={tmp_path}", f"BUDGET={budget}", "check-size")
    assert made.returncode != 0
    assert [line.split()[0] for line in made.stdout.splitlines() if "TOO LARGE" in line] == [
        "blank"
    ]


def test_another_kilolib_is_built_from_its_sources_but_not_their_programs(
    tmp_path: Path, walker: Path
) -> None:
    other = tmp_path / "kilolib"
    shutil.copytree(FIRMWARE / "kilolib" / "avr", other)
    core = shutil.copytree(FIRMWARE / "kilolib" / "core", tmp_path / "core")
    for source in core.glob("*.c"):
        (other / f"core_{source.name}").write_text(f'#include "../core/{source.name}"\n')
    for header in (FIRMWARE / "kilolib" / "include").glob("*.h"):
        shutil.copy(header, other)
    shutil.copytree(FIRMWARE / "kilolib" / "include", tmp_path / "include")
    (other / "loader.c").write_text("int main(void) { for (;;) {} }\n")
    with (other / "led.c").open("a") as led:
        led.write(PADDING)
    ours = make(f"BUILD={tmp_path}/out", f"PROGRAM={walker}")
    theirs = make(f"BUILD={tmp_path}/out", f"PROGRAM={walker}", f"KILOLIB={other}")
    assert theirs.returncode == 0, theirs.stderr
    assert (tmp_path / "out" / "upstream" / "walker.hex").exists()
    assert size_of(theirs.stdout, "walker")[0] == size_of(ours.stdout, "walker")[0] + 1000


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["PROGRAM=nobody.c"], "there is no such file or folder"),
        (["PROGRAM=.."], "there is no .c file in it"),
        (["KILOLIB=examples"], "there is no kilolib.h in it"),
    ],
)
def test_what_is_not_there_is_named(tmp_path: Path, arguments: list[str], said: str) -> None:
    made = make(f"BUILD={tmp_path}", *arguments)
    assert made.returncode == 2
    assert said in made.stderr


def test_modules_say_what_to_type_where_no_python_makes_the_c_of_their_frames(
    tmp_path: Path,
) -> None:
    words = ["make", "-s", "-C", str(ROOT / "kilogrid_modules"), f"BUILD={tmp_path}"]
    refused = subprocess.run(
        [*words, "DBC_PYTHON=no-python"], capture_output=True, text=True, check=False
    )
    assert refused.returncode != 0
    assert "no-python is not there" in refused.stderr
    assert "type: make setup. Or name a Python with cantools: DBC_PYTHON=" in refused.stderr
