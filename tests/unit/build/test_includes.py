"""Files that a program may read: at least those that the compiler says it does."""

import subprocess
from pathlib import Path

import pytest

from kilotwin.programs.includes import files_read
from kilotwin.programs.native.guest import prerequisites

FILES = {
    "main.c": '#include "a.h"\n  #  include <far.h> // import this\n#include "d.h"\n#if 0\n'
    '#include "never.h"\n#endif\n#include <stdint.h>\nchar *text = "include";\nint include;\n',
    "a.h": '#ifndef A\n#define A 1 \\\n  + 2\n#include "sub/b.h"\n#endif\n',
    "sub/b.h": '#include "../a.h"\r\n#include_next "c.h"\n',
    "sub/c.h": "",
    "never.h": "",
    "folder/far.h": '#import "c.h"\n',
    "folder/c.h": "#pragma once\n",
    "forced.h": "\n",
    "quoted/d.h": "",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(text.encode())
    return tmp_path


def flags(folder: Path) -> list[str]:
    folders = [f"-I{folder}/folder", f"-iquote{folder}/quoted"]
    return [*folders, "-include", f"{folder}/forced.h"]


def told(folder: Path) -> set[str] | None:
    files = files_read([folder / "main.c"], [*flags(folder), "-DX=1"])
    return None if files is None else {str(file.resolve().relative_to(folder)) for file in files}


def by_compiler(folder: Path) -> set[str]:
    words = ["gcc", "-w", *flags(folder), "-MM", f"{folder}/main.c"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return {str(Path(name).resolve().relative_to(folder)) for name in prerequisites(done.stdout)}


def test_all_that_is_included_is_found_and_what_might_be(folder: Path) -> None:
    assert told(folder) == {*FILES}
    assert by_compiler(folder) < {*FILES}


def test_headers_that_include_each_other_by_ways_up_are_read_once(folder: Path) -> None:
    files = files_read([folder / "main.c"], flags(folder))
    assert files is not None
    assert len(files) == len(FILES)


def test_a_header_that_would_come_first_is_found_once_it_is_there(folder: Path) -> None:
    (folder / "far.h").write_text("")
    assert told(folder) == {*FILES, "far.h"}


@pytest.mark.parametrize(
    "text",
    [
        '#define FILE "hidden.h"\n#include FILE\n',
        '/* why */ #include "hidden.h"\n',
        '/* why\n*/ #include "hidden.h"\n',
        '# /* why */ include "hidden.h"\n',
        '# /* why\n*/ include "hidden.h"\n',
        '#inc\\\nlude "hidden.h"\n',
        '#\\\ninclude "hidden.h"\n',
        '# \\\r\n  include "hidden.h"\r\n',
        '#include \\\n"hidden.h"\n',
        '%:include "hidden.h"\n',
        '\ufeff#include "hidden.h"\n',
        '\f#include "hidden.h"\n',
        '#include /* why */ "hidden.h"\n',
    ],
)
def test_what_is_not_plain_is_left_to_the_compiler(text: str, folder: Path) -> None:
    (folder / "hidden.h").write_text("")
    (folder / "a.h").write_bytes(text.encode())
    assert told(folder) is None
    assert "hidden.h" in by_compiler(folder)


@pytest.mark.parametrize("linked", [False, True])
def test_a_file_of_another_folder_is_left_to_the_confined_compiler(
    linked: bool, folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    secret = tmp_path_factory.mktemp("other") / "secret.h"
    secret.write_text("")
    if linked:
        (folder / "hidden.h").symlink_to(secret)
    (folder / "a.h").write_text(f'#include "{"hidden.h" if linked else secret}"\n')
    assert told(folder) is None


def test_a_file_that_cannot_be_read_is_left_to_the_compiler(folder: Path) -> None:
    assert files_read([folder / "none.c"], []) is None
