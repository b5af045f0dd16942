"""`kilotwin flash robot`: the real avrdude writes a simulated chip, which then runs."""

import json
import os
import re
import signal
import subprocess
import time
import tty
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from intelhex import IntelHex

from kilotwin import _emulator
from kilotwin.experiment.programs import find_program
from kilotwin.files.message_crc import message_crc
from kilotwin.programs.image.boot_loader import build_boot_loader
from kilotwin.programs.image.image import build_image
from kilotwin.table.flash import chip_file

from .conftest import KILOTWIN, Kilotwin, kilotwin_in
from .programmers import (
    KEEPS_EEPROM,
    LOSES_EEPROM,
    SMALL_BOOT_SECTION,
    Unplugged,
    WornChip,
    eeprom_of_a_robot,
    make_chip,
    serving,
)

# Shows its uid in its colour, which the EEPROM must still have.
PROGRAM = """
#include <kilolib.h>
static void setup(void) {
    set_color(kilo_uid == 12 ? RGB(0, 3, 0) : RGB(3, 0, 0));
    spinup_motors();
    set_motors(kilo_turn_left, 0);
}
static void loop(void) {}
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""
GREEN = 0b001100

EXPERIMENT = """
name = "flashed"
duration_s = 3

[arena]
diameter_m = 1.0

[swarm]
profile = "kilobot"

[engine]
avr_core = "interpreted"

[medium]
kind = "kilobot"

[record]
sample_s = 1

[[robots]]
hex = "chip.hex"
count = 1
"""
LOADER = bytes(range(1, 129)) * 4
VIA = ("--via", "isp", "-c", "stk500v2")


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program's .hex."""
    folder = tmp_path_factory.mktemp("program")
    (folder / "show.c").write_text(PROGRAM)
    return build_image(find_program("show.c", folder)).hex


@pytest.fixture
def environment(environment: dict[str, str], tmp_path: Path) -> dict[str, str]:
    return {**environment, "KILOTWIN_KEEP": str(tmp_path / "kept")}


@pytest.fixture
def kilotwin(environment: dict[str, str]) -> Kilotwin:
    return kilotwin_in(environment)


def flash_of(chip: Path) -> bytes:
    return chip_file.plug_in(chip).flash


def check_recorded(flash: bytes, image: Path) -> None:
    """The program in a flash, with a loader's vector in front and its own in the record."""
    program = IntelHex(str(image)).tobinstr()
    assert flash[:4] == b"\x0c\x94\x02\x38"  # jmp 0x7004
    assert flash[4 : len(program)] == program[4:]
    record = flash[0x6F80:0x6F90]
    assert record[10:14] == program[:4]
    assert message_crc(record) == 0


def is_ours(flash: bytes) -> bool:
    """Whether the loader in it is Kilotwin's."""
    loader = IntelHex(str(build_boot_loader())).tobinstr(0x7000)
    return bool(flash[0x7000 : 0x7000 + len(loader)] == loader)


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "kept").glob("*"))


def refused(done: "subprocess.CompletedProcess[str]") -> str:
    """The line that says why; a program's mistake leaves no stack trace."""
    assert "Traceback" not in done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("kilotwin: ")]
    assert len(lines) == 1, done.stderr
    return lines[0]


def test_a_robot_is_flashed_verified_and_runs_from_that_memory(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex")
    with serving(chip, environment) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, "--json")
    report = json.loads(done.stdout)
    assert report["part"] == "ATmega328P"
    assert report["fuses"] == {"low": 0xE2, "high": KEEPS_EEPROM, "extended": 0xFD}
    assert (report["uid"], report["lock_bits"]) == (12, 0xFF)
    assert report["written"]
    assert report["verified"]
    assert not report["eeprom_written"]
    assert report["loader"] == "Kilotwin's"
    check_recorded(flash_of(chip), image)
    assert is_ours(flash_of(chip))
    assert chip_file.plug_in(chip).eeprom == eeprom_of_a_robot()

    (tmp_path / "run.toml").write_text(EXPERIMENT)
    kilotwin("run", tmp_path / "run.toml", "--out", tmp_path / "run", "--quiet")
    with pa.OSFile(str(tmp_path / "run/robots.arrows")) as file:
        last = pa.ipc.open_stream(file).read_all().to_pylist()[-1]
    assert last["led"] == GREEN, last


def test_a_program_that_would_fail_on_the_robot_is_flashed_by_force_only(
    kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    program = tmp_path / "stuck.c"
    program.write_text(PROGRAM.replace("spinup_motors();", ""))
    chip = make_chip(tmp_path / "chip.hex")
    with serving(chip, environment) as port:
        words = ("flash", "robot", program, *VIA, "-P", port)
        done = kilotwin(*words, expect=1)
        assert f"{program} would fail on the robot; mend it, or type --force" in refused(done)
        assert "[no-kick]" in done.stderr
        assert kept(tmp_path) == []
        done = kilotwin(*words, "--force")
    assert "flashed and verified" in done.stdout


def test_calibration_survives_an_erase_that_loses_it(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex", high_fuse=LOSES_EEPROM)
    with serving(chip, environment) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port)
    assert "erasing loses the EEPROM" in done.stdout
    assert "flashed and verified" in done.stdout
    assert chip_file.plug_in(chip).eeprom == eeprom_of_a_robot()
    (file,) = kept(tmp_path)
    assert file.name.startswith("uid-12-")
    assert IntelHex(str(file)).tobinstr() == eeprom_of_a_robot()


def test_the_loader_in_the_chip_stays_unless_another_one_is_given_or_none(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex", loader=LOADER)
    other = tmp_path / "loader.hex"
    other.write_text(":04700000AABBCCDD7E\n:00000001FF\n")
    with serving(chip, environment) as port:
        words = ("flash", "robot", image, *VIA, "-P", port, "--json")
        for options, boot in (
            (["--loader", "keep"], LOADER),
            (["--loader", other], b"\xaa\xbb\xcc\xdd"),
            (["--loader", "none"], b""),
        ):
            report = json.loads(kilotwin(*words, *options).stdout)
            assert report["verified"]
            memory = flash_of(chip)[0x7000:]
            assert memory.rstrip(b"\xff") == boot.rstrip(b"\xff"), report["loader"]


def test_a_loader_of_ours_in_the_chip_gets_its_image_record(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex", loader=LOADER, first=b"\x0c\x94\x02\x38")
    with serving(chip, environment) as port:
        kilotwin("flash", "robot", image, *VIA, "-P", port, "--loader", "keep")
    flash = flash_of(chip)
    check_recorded(flash, image)
    assert flash[0x7000 : 0x7000 + len(LOADER)] == LOADER


def test_a_dry_run_reads_and_writes_nothing(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex")
    before = chip.read_bytes()
    with serving(chip, environment) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, "--dry-run")
    assert "uid 12" in done.stdout
    assert "dry run" in done.stdout
    assert chip_file.contents(chip_file.plug_in(chip)) == _contents(before, tmp_path)
    assert kept(tmp_path) == []


def _contents(text: bytes, folder: Path) -> dict[int, bytes]:
    (folder / "before.hex").write_bytes(text)
    return chip_file.contents(chip_file.plug_in(folder / "before.hex"))


@pytest.mark.parametrize(
    ("chip", "said"),
    [
        ({"signature": "1e9406"}, r"signature is 1E 94 06, not 1E 95 0F"),
        (
            {"high_fuse": SMALL_BOOT_SECTION},
            r"high fuse 0xD7: the boot section has 512 bytes .* type: avrdude .*"
            r"-U hfuse:w:0xD1:m$",
        ),
        (
            {"lock_bits": 0xFE},
            r"lock bits 0xFE: the chip may not be written; .* type: avrdude .*-e$",
        ),
        ({"lock_bits": 0xFC}, r"lock bits 0xFC: the chip may not be written"),
        ({"lock_bits": 0xFB}, r"lock bits 0xFB: the boot loader may not read and write"),
    ],
)
def test_a_chip_that_must_not_be_written_is_shown_and_left_alone(
    chip: dict[str, Any], said: str, image: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    file = make_chip(tmp_path / "chip.hex", loader=LOADER, **chip)
    before = _contents(file.read_bytes(), tmp_path)
    with serving(file, os.environ) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, "--json", expect=1)
    line = refused(done)
    assert line.startswith("kilotwin: nothing was written: ")
    assert re.search(said, line), line
    report = json.loads(done.stdout)
    assert report["obstacle"]
    assert not report["written"]
    assert chip_file.contents(chip_file.plug_in(file)) == before


def test_a_chip_that_does_not_answer_is_told_apart_from_a_missing_programmer(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    deaf = make_chip(tmp_path / "chip.hex", high_fuse=KEEPS_EEPROM | 1 << 5)  # SPIEN off
    with serving(deaf, environment) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, expect=3)
        assert "the programmer answers, but no chip does" in refused(done)
    # Not the same port: another test's programmer may have taken its number.
    gone = tmp_path / "ttyUSB0"
    done = kilotwin("flash", "robot", image, *VIA, "-P", gone, expect=3)
    assert f"{gone} is not there; plug it in" in refused(done)
    file = kilotwin("flash", "robot", image, *VIA, "-P", image, expect=3)
    assert "is no serial port" in refused(file)
    usb = kilotwin("flash", "robot", image, "--via", "isp", expect=3)
    assert "no programmer avrispmkII at usb; plug it in" in refused(usb)
    odd = kilotwin("flash", "robot", image, "--via", "isp", "-c", "odd", expect=2)
    assert "-c odd: avrdude knows no such programmer" in refused(odd)


@pytest.mark.waits
def test_a_port_where_nothing_answers_is_given_up_soon(
    image: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    port = os.ttyname(theirs)
    os.close(theirs)
    try:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, expect=3, timeout_s=600)
    finally:
        os.close(ours)
    assert f"nothing at {port} answers as a stk500v2" in refused(done)
    assert "nothing was written" in refused(done)


def test_a_port_that_another_program_has_open_is_refused(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex")
    with serving(chip, environment) as port:
        other = os.open(port, os.O_RDWR | os.O_NOCTTY)
        try:
            done = kilotwin("flash", "robot", image, *VIA, "-P", port, expect=3)
        finally:
            os.close(other)
        assert re.search(rf"{port} is in use by .* \(process {os.getpid()}\)", refused(done))


def test_without_avrdude_the_line_says_how_to_get_it(
    image: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    done = kilotwin("flash", "robot", image, "--via", "isp", expect=3, env={"PATH": str(tmp_path)})
    assert refused(done) == "kilotwin: avrdude is not here; type: apt-get install avrdude"


@pytest.mark.parametrize("fuse", [KEEPS_EEPROM, LOSES_EEPROM])
def test_a_programmer_unplugged_in_mid_page_is_said_and_mended_by_what_is_said(
    fuse: int, image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex", high_fuse=fuse)
    with Unplugged(chip, page=5) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, expect=3, timeout_s=600)
    line = refused(done)
    assert "is gone; the chip is erased and half written, it runs nothing" in line
    (file,) = kept(tmp_path)
    assert f"its EEPROM is in {file}; type: kilotwin flash robot {image}" in line
    program = IntelHex(str(image)).tobinstr()
    assert flash_of(chip)[4 : len(program)] != program[4:]

    # The command that it says to type, at the new port.
    words = line.split("type: kilotwin ")[1].replace(port, "{port}").split()
    assert ("--eeprom" in words) == (fuse == LOSES_EEPROM)
    with serving(chip, environment) as port:
        kilotwin(*(word.format(port=port) for word in words))
    check_recorded(flash_of(chip), image)
    assert chip_file.plug_in(chip).eeprom == eeprom_of_a_robot()


def test_a_chip_that_does_not_hold_what_was_written_is_no_success(
    image: Path, kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex")
    with WornChip(chip) as port:
        done = kilotwin("flash", "robot", image, *VIA, "-P", port, "--json", expect=1)
    line = refused(done)
    assert "what was read back is not what was written; look at the plug and the battery" in line
    assert "the chip is erased and half written" in line
    report = json.loads(done.stdout)
    assert not report["written"]
    assert not report["verified"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[: len(text) // 2], r"is cut off or damaged|end record is missing"),
        (lambda text: "\n".join(text.splitlines()[:20]) + "\n", r"half a hex file"),
        (lambda text: text.replace("0", "1", 5), r":1: "),
        (lambda text: "", r"has no bytes to flash"),
        (lambda text: ":10700000" + "00" * 16 + "80\n:00000001FF\n", r"boot loader alone"),
        (lambda text: ":016E0000FF92\n:00000001FF\n", r"221 pages .* 220 at most"),
        (
            lambda text: ":020000040001F9\n:01000000AA55\n:00000001FF\n",
            r"a byte at 0x10000; it goes from 0x0000 to 0x7FFF",
        ),
    ],
)
def test_a_hex_that_cannot_be_flashed_is_refused_before_the_chip_is_asked(
    change: "object", said: str, image: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    assert callable(change)
    bad = tmp_path / "bad.hex"
    bad.write_text(change(image.read_text()))
    done = kilotwin("flash", "robot", bad, *VIA, "-P", "/dev/nowhere", expect=2)
    assert re.search(said, refused(done)), done.stderr


def test_files_that_do_not_go_with_the_options_are_refused(
    image: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    words = ("flash", "robot", image, "--via", "isp")
    (tmp_path / "eeprom.hex").write_text(image.read_text())
    (tmp_path / "notes.txt").write_text("")
    for options, said in (
        (["-D", "N=3"], r"is built already; -I and -D are for a \.c or a folder"),
        (["--loader", image], r"it goes from 0x7000 to 0x7FFF"),
        (["--loader", tmp_path / "no.hex"], r"no\.hex: no such file or directory"),
        (["--eeprom", tmp_path / "eeprom.hex"], r"are not in the EEPROM of 1 KB"),
    ):
        assert re.search(said, refused(kilotwin(*words, *options, expect=2)))
    odd = kilotwin("flash", "robot", tmp_path / "notes.txt", "--via", "isp", "--force", expect=2)
    assert "is not C source; name a folder or a .c file, or a .hex" in refused(odd)


def test_ctrl_c_while_it_reads_leaves_the_chip_as_it_was(
    image: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    ours, theirs = os.openpty()  # a port that answers nothing: avrdude waits
    tty.setraw(theirs)
    port = os.ttyname(theirs)
    os.close(theirs)
    with subprocess.Popen(
        [KILOTWIN, "flash", "robot", image, *VIA, "-P", port],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "reading the chip\n"
        os.read(ours, 1)  # avrdude is at work
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=600)
    os.close(ours)
    assert errors == "kilotwin: interrupted; nothing was written\n"
    assert process.returncode == 130


def test_ctrl_c_while_it_writes_must_be_meant(
    image: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    chip = make_chip(tmp_path / "chip.hex", high_fuse=LOSES_EEPROM)
    programmer = Unplugged(chip, page=3, hangs=True)
    with (
        programmer as port,
        subprocess.Popen(
            [KILOTWIN, "flash", "robot", image, *VIA, "-P", port],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as process,
    ):
        assert process.stderr is not None
        assert programmer.failed.wait(600)
        process.send_signal(signal.SIGINT)
        lines = iter(process.stderr.readline, "")
        assert "the chip is being written; Ctrl-C again leaves it half written\n" in lines
        while process.poll() is None:  # the next one that is no repetition of the first
            process.send_signal(signal.SIGINT)
            time.sleep(0.1)
        _, errors = process.communicate(timeout=600)
    (file,) = kept(tmp_path)
    assert errors.startswith("kilotwin: interrupted; the chip is erased and half written")
    assert errors.endswith(f"--eeprom {file}\n")
    assert process.returncode == 130


def test_plain_avrdude_writes_fuses_and_lock_bits_of_a_new_chip(
    environment: dict[str, str], tmp_path: Path
) -> None:
    chip = tmp_path / "new.hex"
    with serving(chip, environment) as port:
        words = ["avrdude", "-qq", "-p", "m328p", "-c", "stk500v2", "-P", port]
        writes = ["-U", "hfuse:w:0xD9:m", "-U", "efuse:w:0xFD:m", "-U", "lock:w:0xEF:m"]
        subprocess.run([*words, *writes], check=True, timeout=600)
    new: _emulator.Programmer = chip_file.plug_in(chip)
    assert new.fuses == bytes([0xE2, 0xD9, 0xFD])
    assert new.lock_bits == 0xEF
