"""docs/code_overview.md says of each part of the tree what it includes, and that is so.

`python -m tests.architecture.test_overview` writes the last column of its table anew.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

from .tree import C_SUFFIXES, ROOT, includes, owners_of, plant, sources

DOCUMENT = "docs/code_overview.md"
ROW = re.compile(r"^\| `([\w/]+)` \| (.+?) \| (.*?) \|$", re.MULTILINE)
FOLDERS = ("firmware", "kilogrid_modules", "emulator", "host_tools/kilotwin")
PACKAGE = "host_tools/kilotwin"
ENGINE = "emulator/python"
# Guests find the C library here; a robot's compiler has its own.
C_LIBRARY = "emulator/robots/native/include"
MADE = "kilogrid_modules/protocol/kilogrid_can.h"  # by builds, elsewhere

Table = dict[str, set[str]]


def written(root: Path) -> Table:
    """The table of the document: of each part the parts that it includes."""
    text = (root / DOCUMENT).read_text(encoding="utf-8")
    return {part: set(re.findall(r"`([\w/]+)`", names)) for part, _, names in ROW.findall(text)}


def part_of(parts: Table, file: str) -> str | None:
    """The innermost part in which a file lies."""
    return max((part for part in parts if file.startswith(f"{part}/")), key=len, default=None)


def included(root: Path, parts: Table) -> Iterator[tuple[str, list[str]]]:
    """Parts that an include of each C or C++ file can mean."""
    files = [path.as_posix() for path in sources(root, C_SUFFIXES)]
    for file in files:
        if file.startswith(FOLDERS):
            for name, quoted in includes(root / file):
                owners = owners_of([*files, MADE], Path(file), name, quoted)
                found = {part_of(parts, owner) for owner in owners} - {None, C_LIBRARY}
                yield file, sorted(part for part in found if part)


def imported(root: Path) -> Iterator[tuple[str, str]]:
    """Files or folders that each Python file of the package imports."""
    for path in sources(root, {".py"}):
        if not path.as_posix().startswith(f"{PACKAGE}/"):
            continue
        tree = ast.parse((root / path).read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            names: list[str] = []
            if isinstance(node, ast.ImportFrom):
                above = path.parts[1 : len(path.parts) - node.level] if node.level else ()
                base = [*above, node.module] if node.module else above
                names = [".".join([*base, alias.name]) for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                if name.startswith("kilotwin."):
                    yield path.as_posix(), f"host_tools/{name.replace('.', '/')}/"


def actual(root: Path) -> Table:
    """Which of the parts named in the table include which, by their sources."""
    parts = written(root)
    found: Table = {part: set() for part in parts}
    doubtful: dict[str, list[list[str]]] = defaultdict(list)
    for file, owners in included(root, parts):
        part = part_of(parts, file) or ""
        if part in owners or not owners:
            continue
        if len(owners) == 1:
            found.setdefault(part, set()).add(owners[0])
        else:
            doubtful[part].append(owners)
    # Among headers of one name, the one of a part that is included anyway; else the robots' API.
    for part, several in doubtful.items():
        for owners in several:
            if not found.setdefault(part, set()) & set(owners):
                found[part].add(owners[-1])
    for file, name in imported(root):
        engine = name.startswith(f"{PACKAGE}/_emulator")
        part, owner = part_of(parts, file) or "", ENGINE if engine else part_of(parts, name)
        if owner and owner != part:
            found.setdefault(part, set()).add(owner)
    return found


def homeless(root: Path) -> list[str]:
    """Sources that lie in no part of the table."""
    parts = written(root)
    paths = (path.as_posix() for path in sources(root, C_SUFFIXES | {".py"}))
    return [path for path in paths if path.startswith(FOLDERS) and not part_of(parts, path)]


def renewed(root: Path) -> str:
    """The document with the last column of its table made from the sources."""
    found = actual(root)

    def row(match: re.Match[str]) -> str:
        names = ", ".join(f"`{name}`" for name in sorted(found[match[1]])) or "nothing"
        return f"| `{match[1]}` | {match[2]} | {names} |"

    return ROW.sub(row, (root / DOCUMENT).read_text(encoding="utf-8"))


def test_every_source_lies_in_a_part_of_the_table() -> None:
    assert homeless(ROOT) == []


def test_the_table_says_what_includes_what() -> None:
    hint = "write it anew: python -m tests.architecture.test_overview"
    assert written(ROOT) == actual(ROOT), hint


GOOD = {
    DOCUMENT: "| part | what | includes |\n|---|---|---|\n"
    "| `emulator/base` | a | nothing |\n"
    "| `emulator/grid` | b | `emulator/base`, `firmware/kilolib` |\n"
    "| `emulator/python` | c | `emulator/grid` |\n"
    "| `firmware/kilogrid` | d | nothing |\n"
    "| `firmware/kilolib` | e | nothing |\n"
    "| `host_tools/kilotwin` | f | nothing |\n"
    "| `host_tools/kilotwin/can` | g | `host_tools/kilotwin` |\n"
    "| `host_tools/kilotwin/runs` | h | `emulator/python`, `host_tools/kilotwin/can` |\n",
    "emulator/base/clock.h": "#include <vector>\n",
    "emulator/grid/bus.h": '#include "base/clock.h"\n#include <kilolib.h>\n#include "own.h"\n',
    "emulator/grid/own.h": "",
    "emulator/python/module.cpp": '#include "../grid/bus.h"\n',
    "firmware/kilogrid/kilolib.h": "",
    "firmware/kilolib/kilolib.h": "",
    "host_tools/kilotwin/errors.py": "import json\n",
    "host_tools/kilotwin/can/buses.py": "from kilotwin.errors import InputError\n",
    "host_tools/kilotwin/runs/run.py": "from kilotwin import _emulator\nfrom ..can import buses\n",
}


def test_a_good_table_passes_and_is_written_as_it_was(tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    assert written(tmp_path) == actual(tmp_path)
    assert renewed(tmp_path) == GOOD[DOCUMENT]
    assert homeless(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("emulator/base/clock.h", '#include "grid/bus.h"\n'),
        ("emulator/grid/bus.h", "#include <kilolib.h>\n"),
        ("host_tools/kilotwin/runs/run.py", "import kilotwin.can.buses\n"),
        ("host_tools/kilotwin/can/buses.py", "def f():\n    from kilotwin.runs import run\n"),
        ("host_tools/kilotwin/can/buses.py", "from .. import errors, runs\n"),
    ],
)
def test_a_planted_difference_is_caught(name: str, text: str, tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    plant(tmp_path, {name: text})
    assert written(tmp_path) != actual(tmp_path)


def test_a_planted_folder_that_the_table_lacks_is_caught(tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    plant(tmp_path, {"emulator/engine/world.h": ""})
    assert homeless(tmp_path) == ["emulator/engine/world.h"]


if __name__ == "__main__":
    (ROOT / DOCUMENT).write_text(renewed(ROOT), encoding="utf-8")
