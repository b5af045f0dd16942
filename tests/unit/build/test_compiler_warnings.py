"""A program's own warnings are shown when it is compiled, once, and counted by `kilotwin check`."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.programs import Program, find_program
from kilotwin.programs import compiler_warnings
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import build
from kilotwin.studies.scenario.program_check import on_this_computer

PROGRAM = """\
#include <kilolib.h>
#include "mine.h"
static void hear(message_t *message, distance_measurement_t *distance) {}
static void setup(void) {}
static void loop(void) { %s }
int main(void) { kilo_init(); kilo_message_rx = hear; kilo_start(setup, loop); return 0; }
"""
UNUSED = "int unused;"


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "cache"))


def program(folder: Path, body: str, header: str = "") -> Program:
    (folder / "my.c").write_text(PROGRAM % body)
    (folder / "mine.h").write_text(header)
    return find_program([str(folder / "my.c")], folder, [], [])


def warned(of: Program) -> str:
    """Lines of its compilation, but for the one that says so."""
    said: list[str] = []
    build_image(of, said.append)
    return "\n".join(line for line in said if not line.startswith("compiling"))


def test_what_the_compiler_warns_of_is_said_with_its_line_once(tmp_path: Path) -> None:
    found = program(tmp_path, UNUSED)
    said = warned(found)
    assert said.startswith(f"{tmp_path}/my.c:5:")
    assert "warning: unused variable 'unused' [-Wunused-variable]" in said
    assert UNUSED in said  # its line
    assert warned(found) == ""


def test_a_header_of_the_programs_own_is_looked_at_too(tmp_path: Path) -> None:
    said = warned(program(tmp_path, "", "static int spare(void) { return 1; }\n"))
    assert "mine.h:1:" in said
    assert "'spare' defined but not used" in said


def test_a_parameter_that_a_callback_does_not_need_is_nothing_to_warn_of(tmp_path: Path) -> None:
    assert warned(program(tmp_path, "")) == ""


def test_warnings_of_other_headers_are_not_the_users() -> None:
    said = (
        "In file included from my.c:1:0:\n"
        "/elsewhere/kilolib.h: In function 'f':\n"
        "/elsewhere/kilolib.h:3:5: warning: unused variable 'a' [-Wunused-variable]\n"
        "  int a;\n"
    )
    here = find_program([str(Path(__file__).parents[3] / "firmware/blank.c")], Path(), [], [])
    assert compiler_warnings.own_warnings(here, said) == []


def test_of_many_the_first_are_shown_and_the_others_counted() -> None:
    shown = compiler_warnings.shown([f"my.c:{line}: warning" for line in range(25)])
    assert shown.splitlines()[19:] == ["my.c:19: warning", "5 more warnings"]


@pytest.mark.parametrize("make", [build, build_image])
def test_a_name_that_nobody_has_comes_with_the_one_that_is_meant(
    make: "type[object]", tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="has set_motor; did you mean set_motors"):
        make(program(tmp_path, "set_motor(0, 0);"))  # type: ignore[call-arg]


def test_the_check_counts_them_and_does_not_fail(tmp_path: Path) -> None:
    step = on_this_computer(program(tmp_path, UNUSED + " int other;"), print)
    assert step.said == "for this computer, 2 of the compiler's warnings"
    assert not step.fails
    assert [(one.level, one.line) for one in step.found] == [("warning", 5)] * 2
