"""Programs for the ATmega328P are built once per content, and errors are the compiler's."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.programs import find_program
from kilotwin.programs.image.image import Image, build_image

pytestmark = pytest.mark.usefixtures("cache")


def build(folder: Path, *defines: str) -> Image:
    return build_image(find_program("blink.c", folder, (), defines))


def test_a_program_becomes_an_image_with_symbols_objects_and_stack_usage(folder: Path) -> None:
    image = build(folder)
    assert image.elf.read_bytes().startswith(b"\x7fELF")
    assert image.hex.read_text().startswith(":")
    (own,) = image.objects("program")
    assert "setup" in own.with_suffix(".su").read_text()
    assert len(image.objects("kilolib")) > 10


def test_the_same_content_is_built_once_and_any_change_again(folder: Path) -> None:
    first = build(folder)
    made = first.elf.stat().st_mtime_ns
    assert build(folder) == first
    assert first.elf.stat().st_mtime_ns == made
    assert build(folder, "N=2").key != first.key
    source = folder / "blink.c"
    source.write_text(source.read_text().replace("500", "400"))
    assert build(folder).key != first.key


def test_what_does_not_compile_is_told_in_the_compilers_words(folder: Path) -> None:
    (folder / "blink.c").write_text("int main(void) { return nothing; }\n")
    with pytest.raises(InputError) as caught:
        build(folder)
    assert "does not compile for the robot" in str(caught.value)
    assert "blink.c:1" in caught.value.detail
    assert {file.name.rpartition("-")[2] for file in (folder / "cache").glob("*")} <= {"objects"}


def test_what_nobody_has_is_named_with_the_file_that_wants_it(folder: Path) -> None:
    source = folder / "blink.c"
    source.write_text(source.read_text().replace("count++", "fly_away()"))
    with pytest.raises(InputError, match="neither the program nor the API has fly_away;") as caught:
        build(folder)
    assert caught.value.detail.startswith(f"{source}:")
    assert caught.value.detail.endswith("undefined reference to 'fly_away'")


def test_a_program_without_main_is_told_what_it_lacks(folder: Path) -> None:
    (folder / "blink.c").write_text("void setup(void) {}\n")
    with pytest.raises(InputError, match=r"blink.c: has no main\(\); add the one .* kilo_init\(\)"):
        build(folder)


def test_a_kilogrid_program_gets_the_helpers_that_it_lacks(tmp_path: Path) -> None:
    (tmp_path / "main.c").write_text(
        "#include <kilolib.h>\n#include <kilob_tracking.h>\n"
        "message_rx_t utils_message_rx;\nvoid move_straight(void) {}\n"
        "static void setup(void) { kilob_tracking_init(); }\n"
        "static void loop(void) { kilob_message_send(); move_straight(); }\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); }\n"
    )
    program = find_program("main.c", tmp_path)
    assert program.api == "kilogrid"
    assert build_image(program).hex.exists()
