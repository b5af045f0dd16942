"""Files that a program may include: a compiler reads its folders and the system's, no others."""

import os
import resource
from dataclasses import replace
from pathlib import Path

import pytest

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import find_program
from kilotwin.programs.native.guest import build

from ..conftest import BLINK

HERE = Path()


@pytest.mark.parametrize("include", ['"/etc/passwd"', '"../../secret.h"'])
def test_a_file_elsewhere_is_not_shown_by_a_compile_error(include: str, tmp_path: Path) -> None:
    secret = "mysecret:x:0:0"
    source = tmp_path / "project/a/b/curious.c"
    source.parent.mkdir(parents=True)
    for folder in (tmp_path, tmp_path / "project"):
        (folder / "secret.h").write_text(secret)
    source.write_text(f"#include {include}\n{BLINK}")
    with pytest.raises(InputError, match="it may read the program's folders") as caught:
        build(find_program(str(source), HERE))
    assert "Permission denied" in caught.value.detail
    assert "root:" not in caught.value.detail
    assert "mysecret" not in caught.value.detail


def test_headers_above_a_program_and_in_its_checkout_are_read(tmp_path: Path) -> None:
    source = tmp_path / "checkout/robots/one/here.c"
    source.parent.mkdir(parents=True)
    (tmp_path / "checkout/.git").mkdir()
    (tmp_path / "checkout/top.h").write_text("#define TOP 1\n")
    (tmp_path / "checkout/robots/above.h").write_text("#define ABOVE 1\n")
    source.write_text(f'#include "../above.h"\n#include "../../top.h"\n{BLINK}')
    assert build(find_program(str(source), HERE)).file.is_file()


def test_headers_of_a_run_folders_parcel_are_read(tmp_path: Path) -> None:
    source = tmp_path / "run/parcel/lab/robots/one/here.c"
    source.parent.mkdir(parents=True)
    (tmp_path / "run/parcel/lab/top.h").write_text("#define TOP 1\n")
    source.write_text(f'#include "../../top.h"\n{BLINK}')
    assert build(find_program(str(source), HERE)).file.is_file()


def test_folders_that_an_experiment_includes_are_read(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib/mine.h").write_text("#define MINE 1\n")
    source = tmp_path / "a/b/c/there.c"
    source.parent.mkdir(parents=True)
    source.write_text(f'#include "mine.h"\n{BLINK}')
    found = find_program(str(source), HERE)
    assert build(replace(found, include_folders=(tmp_path / "lib",))).file.is_file()


def test_a_program_in_the_home_folder_may_include_headers_there_and_read_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "homes/of/me"
    (home / "keys").mkdir(parents=True)
    monkeypatch.setenv("HOME", str(home))
    (home / "beside.h").write_text("#define BESIDE 1\n")
    (home / "key").write_text("mysecret")
    (home / "keys/inner.h").write_text("#define INNER 1\n")
    source = home / "mine.c"
    source.write_text(f'#include "beside.h"\n{BLINK}')
    assert build(find_program(str(source), HERE)).file.is_file()
    source.write_text(f'#include "keys/inner.h"\n{BLINK}')
    with pytest.raises(InputError, match="it may read the program's folders"):
        build(find_program(str(source), HERE))
    # What does not assemble is left out: the program is one for a robot.
    source.write_text(f'__asm__(".incbin \\"{home}/key\\"");\n{BLINK}')
    assert b"mysecret" not in build(find_program(str(source), HERE)).file.read_bytes()


def test_a_compiler_takes_no_more_memory_than_it_gets(tmp_path: Path) -> None:
    source = tmp_path / "a/b/vast.c"
    source.parent.mkdir(parents=True)
    source.write_text(f'__asm__(".rept 400000000\\n.long 1, 2\\n.endr");\n{BLINK}')
    build(find_program(str(source), HERE))
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 3.2e6  # kB


def test_a_compiler_makes_no_larger_file_than_it_may(tmp_path: Path) -> None:
    source = tmp_path / "a/b/vast.c"
    source.parent.mkdir(parents=True)
    source.write_text(f"char vast[300000000] = {{1}};\n{BLINK}")
    with pytest.raises(InputError, match="takes more memory, time or room than a compiler gets"):
        build(find_program(str(source), HERE))


def test_a_compiler_that_waits_for_ever_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kilotwin.programs.native.guest._LONGEST_S", 2.0)
    source = tmp_path / "a/b/waits.c"
    source.parent.mkdir(parents=True)
    os.mkfifo(source.with_name("pipe.h"))
    source.write_text(f'#define PIPE "pipe.h"\n#include PIPE\n{BLINK}')
    with pytest.raises(RunError, match="did not end within 2 s; look for a header that is a pipe"):
        build(find_program(str(source), HERE))
