"""`kilotwin build --hex`: what is written, what is said of it, and what is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kilotwin.errors import InputError, KilotwinError
from kilotwin.experiment.programs import Api, find_program
from kilotwin.files.flash_image import read_hex
from kilotwin.programs.image.flash_report import build_hex, built_text, show_hex, shown_text
from kilotwin.programs.image.image_size import FLASH_BYTES, RAM_BYTES, size_of
from kilotwin.programs.report import build_program

from ..conftest import BLINK

MODULE = """\
#include <module.h>
#include <moduleLED.h>
static void setup(void) { set_all_LEDs(RED); }
static void loop(void) {}
int main(void) { module_init(); module_start(setup, loop); }
"""
KILOGRID = """\
#include <kilolib.h>
#include <kilob_tracking.h>
static void setup(void) { kilob_tracking_init(); }
static void loop(void) { kilob_message_send(); }
int main(void) { kilo_init(); kilo_start(setup, loop); }
"""
# A table that the linker must keep.
LARGE = """\
#include <avr/pgmspace.h>
#include <kilolib.h>
#define FOUR(x) x, x, x, x
static const uint8_t table[%d] PROGMEM = {FOUR(FOUR(1))};
static uint8_t seen[%d];
static void setup(void) {}
static void loop(void) { seen[kilo_uid] = pgm_read_byte(&table[kilo_ticks]); set_color(seen[1]); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


SOURCES = {
    "blink.c": BLINK,
    "wink.c": BLINK,
    "more.c": "#include <avr/eeprom.h>\n#include <avr/io.h>\n"
    "uint8_t EEMEM lost[3] = {1, 2, 3};\nFUSES = {1, 2, 3};\n" + BLINK,
    "cell.c": MODULE,
    "lab.c": KILOGRID,
    "both.c": MODULE + "// not kilo_start()\n",
    "much_flash.c": LARGE % (26000, 100),
    "much_ram.c": LARGE % (10, 2000),
}

Built = Callable[..., dict[str, Any]]
Refused = Callable[..., KilotwinError]


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of programs, so that each is compiled once."""
    folder = tmp_path_factory.mktemp("sources")
    for name, text in SOURCES.items():
        (folder / name).write_text(text)
    return folder


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, an empty one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def built(sources: Path, place: Path) -> Built:
    """The report on a program's image, which is written to `output`."""

    def build(name: str = "blink.c", output: str = "out.hex", api: Api | None = None) -> Any:
        return build_hex(find_program(name, sources, api=api), Path(output), lambda _: None)

    return build


@pytest.fixture
def refused(built: Built, place: Path) -> Refused:
    """Why a program is refused. Nothing may have been written."""

    def refuse(*words: str, **more: Any) -> KilotwinError:
        before = set(place.rglob("*"))
        with pytest.raises(KilotwinError) as caught:
            built(*words, **more)
        assert set(place.rglob("*")) == before
        return caught.value

    return refuse


def test_the_image_and_its_elf_are_written_and_measured(built: Built, place: Path) -> None:
    report = built()
    image = read_hex(place / "out.hex")
    assert (place / "out.elf").read_bytes().startswith(b"\x7fELF")
    assert report["flash_bytes"] == len(image.content) == size_of(place / "out.elf").flash
    assert report["pages"] == len(image.pages)
    assert report["image_id"] == f"{image.image_id:08X}"
    assert report["crc16"] == f"{image.crc16:04X}"
    assert 32 < report["ram_bytes"] < 200
    assert (report["flash_budget_bytes"], report["ram_budget_bytes"]) == (28160, 2048)


def test_the_text_has_sizes_shares_and_the_build_id(built: Built) -> None:
    report = built()
    first, flash, ram, image, made = built_text(report).splitlines()
    assert first == "blink, for a robot: out.hex, out.elf"
    share = f"({report['flash_bytes'] / FLASH_BYTES:.1%}; {report['pages']} of 220 pages)"
    assert flash == f"  flash  {report['flash_bytes']:6,} of 28,160 bytes {share}"
    assert ram.endswith(f"of 2,048 bytes of variables ({report['ram_bytes'] / RAM_BYTES:.1%})")
    assert image == f"  image  {report['image_id']}, CRC-16 {report['crc16']}"
    assert made == f"  built  {report['build_id']}"
    assert made.startswith("  built  robot blink avr-gcc-")


def test_what_a_hex_file_holds_is_read_back_from_it_alone(built: Built, place: Path) -> None:
    report = built()
    shown = show_hex(place / "out.hex")
    assert {**report, **shown} == {**report, "hex": str(place / "out.hex")}
    assert shown["built_from"]["program"] == "blink"
    assert shown_text(shown).splitlines()[-1] == f"  built  {report['build_id']}"


def test_a_hex_file_of_others_has_no_build_id(place: Path) -> None:
    (place / "old.hex").write_text(":020000001234B8\n:00000001FF\n")
    shown = show_hex(place / "old.hex")
    assert shown["build_id"] is shown["built_from"] is None
    assert shown_text(shown).splitlines()[-1].startswith("  built  none: ")


def test_an_image_is_the_same_from_everywhere_and_at_any_time(
    built: Built, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built()
    (place / "blink.c").write_text(BLINK)
    monkeypatch.setenv("KILOTWIN_CACHE", str(place / "cache"))
    assert built(output="mine.hex")["sources"] == [str(place / "blink.c")]
    assert (place / "mine.hex").read_bytes() == (place / "out.hex").read_bytes()


def test_the_build_id_changes_no_byte_before_it(built: Built, place: Path) -> None:
    code = []
    for name in ("blink", "wink"):
        text = built(f"{name}.c", f"{name}.hex")["build_id"].encode()
        content = read_hex(place / f"{name}.hex").content
        end = text + bytes([len(text)]) + b"KTID"
        assert content.endswith(end)
        code.append(content.removesuffix(end))
    assert code[0] == code[1]


def test_eeprom_and_fuses_are_left_out_and_said(built: Built) -> None:
    plain, report = built(output="plain.hex"), built("more.c")
    assert plain["left_out_bytes"] == {}
    assert report["left_out_bytes"] == {".eeprom": 3, ".fuse": 3}
    assert report["flash_bytes"] == plain["flash_bytes"] - len("blink") + len("more")
    eeprom, fuse = built_text(report).splitlines()[-2:]
    assert eeprom.startswith("  3 bytes of .eeprom are left out: ")
    assert fuse == "  3 bytes of .fuse are left out: a .hex has flash only"


def test_a_program_of_a_lab_and_one_of_a_module_become_images(built: Built) -> None:
    assert built("lab.c")["build_id"].startswith("robot lab ")
    report = built("cell.c", api="module")
    assert report["for"] == "module"
    assert report["build_id"].startswith("module cell ")
    assert built_text(report).startswith("cell, for a Kilogrid module: out.hex")


@pytest.mark.parametrize(
    ("name", "api", "said"),
    [
        ("cell.c", None, "is a program for a Kilogrid module, not for a robot; add --for module"),
        (
            "lab.c",
            "module",
            "is a program for a robot, not for a Kilogrid module; leave out --for module",
        ),
    ],
)
def test_a_program_for_the_other_target_is_named_in_one_line(
    name: str, api: Api | None, said: str, sources: Path, refused: Refused
) -> None:
    program = find_program(name, sources, api=api)
    with pytest.raises(InputError) as caught:
        build_program(program, None, lambda _: None)
    for error in (refused(name, api=api), caught.value):
        assert str(error) == f"{sources / name}: {said}"
        assert error.detail == ""
        assert error.exit_code == 2


def test_a_program_with_words_of_both_keeps_the_compilers(refused: Refused) -> None:
    error = refused("both.c")
    assert "does not compile" in str(error)
    assert "module.h" in error.detail


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("much_flash.c", " bytes of flash, an image has at most 28,160 (220 pages); leave out"),
        ("much_ram.c", " bytes of RAM, of 2,048"),
    ],
)
def test_an_image_that_does_not_fit_is_refused(name: str, said: str, refused: Refused) -> None:
    error = refused(name)
    assert said in str(error)
    assert error.exit_code == 1


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ("no/where.hex", "--hex no/where.hex: no such file or directory; name another file"),
        ("folder.hex", "--hex folder.hex: is a folder; name another file"),
        ("taken.hex", "--hex taken.hex: is a folder; name another file"),
        ("blink.c", "--hex blink.c: not the name of a .hex file; write blink.c.hex"),
        ("/proc/out.hex", "--hex /proc/out.hex: "),
    ],
)
def test_a_file_that_cannot_be_written_is_refused(
    output: str, said: str, place: Path, refused: Refused
) -> None:
    (place / "folder.hex").mkdir()
    (place / "taken.elf").mkdir()
    error = refused("blink.c", output)
    assert str(error).startswith(said)
    assert error.exit_code == 2


def test_without_avr_gcc_it_says_what_to_install(
    refused: Refused, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools = tmp_path_factory.mktemp("tools")
    monkeypatch.setenv("PATH", str(tools))
    assert str(refused("blink.c")).startswith("avr-gcc is not here; type: apt-get install gcc-avr")
    (tools / "avr-gcc").write_text("#!/bin/sh\n")
    (tools / "avr-gcc").chmod(0o755)
    assert str(refused("blink.c")).startswith("avr-nm is not here; type: apt-get install")
