"""Files that a program may include: a compiler reads its folders and the system's, no others."""

from dataclasses import replace
from pathlib import Path

import pytest

from kilotwin.build.guest import build
from kilotwin.errors import InputError
from kilotwin.experiment.programs import find_program

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


def test_folders_that_an_experiment_includes_are_read(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib/mine.h").write_text("#define MINE 1\n")
    source = tmp_path / "a/b/c/there.c"
    source.parent.mkdir(parents=True)
    source.write_text(f'#include "mine.h"\n{BLINK}')
    found = find_program(str(source), HERE)
    assert build(replace(found, include_folders=(tmp_path / "lib",))).file.is_file()
