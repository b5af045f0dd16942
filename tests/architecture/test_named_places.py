"""Places that docs/code_overview.md names are there, and where it says which files know a thing,
it names them all.
"""

import ast
import re

import pytest

from .tree import C_SUFFIXES, ROOT, sources

OVERVIEW = (ROOT / "docs/code_overview.md").read_text(encoding="utf-8")
FILES = [path.as_posix() for path in sources(ROOT)]
SUFFIXES = "c|cpp|h|ld|map|mjs|mk|py|ts"
# Rows begin with what is to be added or sought; the second column says where.
TABLES = OVERVIEW[OVERVIEW.index("## Where to add") : OVERVIEW.index("## The build")]
ROWS = dict(re.findall(r"^\| ([^|]+) \| (.*`.*) \|$", TABLES, re.MULTILINE))


def named(text: str) -> list[str]:
    """Files and folders of the tree that a text names, from its top."""
    return [name for name in re.findall(r"`([\w./-]+/[\w./-]+)`", text) if (ROOT / name).exists()]


def holding(pattern: str, folder: str) -> list[str]:
    """Sources of the engine in which a line matches."""
    found = (path for path in sources(ROOT, C_SUFFIXES) if path.as_posix().startswith(folder))
    return [
        path.as_posix()
        for path in found
        if re.search(pattern, (ROOT / path).read_text(encoding="utf-8"))
    ]


def with_word(word: str) -> list[str]:
    """Files of the package in which this is a text of its own: the name of a profile, a medium."""
    return [
        path.as_posix()
        for path in sources(ROOT, {".py"})
        if path.as_posix().startswith("host_tools/kilotwin/")
        and any(
            isinstance(node, ast.Constant) and node.value == word
            for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8")))
        )
    ]


def test_every_source_that_is_named_is_there_be_it_by_the_end_of_its_path() -> None:
    names = re.findall(rf"`([\w./-]+\.(?:{SUFFIXES}))`", OVERVIEW)
    assert len(names) > 200
    tails = {f"/{name}" for name in names}
    assert {tail for tail in tails if not any(f"/{file}".endswith(tail) for file in FILES)} == set()


@pytest.mark.parametrize("what", ROWS)
def test_what_is_added_or_sought_is_in_a_file_of_its_row(what: str) -> None:
    places = named(ROWS[what])
    files = [file for place in places for file in FILES if f"{file}/".startswith(f"{place}/")]
    text = "\n".join((ROOT / file).read_text(errors="replace") for file in files)
    words = re.findall(r"`(\w+)(?:\(\))?`", ROWS[what])
    assert [word for word in words if not re.search(rf"\b{word}\b", text)] == []


def test_all_files_that_know_simavr_are_named() -> None:
    known = [file.rpartition("/")[2] for file in holding(r"#include <simavr/", "emulator/")]
    (said,) = re.findall(r"simavr to (\w+) files of\s+`emulator/avr/chip`: ([^:]*)\.\n", OVERVIEW)
    assert ["none", "one", "two", "three", "four", "five", "six"].index(said[0]) == len(known)
    assert re.findall(r"`(.*?)`", said[1]) == known


def test_all_kinds_of_stations_are_named() -> None:
    kinds = holding(r"\bclass \w+ (?:final )?: public Stations\b", "emulator/")
    assert len(kinds) == 5
    assert [file for file in kinds if f"`{file}`" not in OVERVIEW] == []


@pytest.mark.parametrize(
    ("what", "word", "but"),
    [
        ("profile", "foot-bot", set()),
        (
            "medium",
            "ideal",
            {
                "host_tools/kilotwin/experiment/schema/profile_defaults.py",
                "host_tools/kilotwin/studies/bench/workloads.py",
            },
        ),
    ],
)
def test_a_row_names_all_files_in_which_its_like_is_named(
    what: str, word: str, but: set[str]
) -> None:
    files = with_word(word)
    assert len(files) > 2
    assert {*files} - but <= {*named(ROWS[what])}
