"""Walks over the tree for the tests of this folder, and small trees to plant faults in."""

import ast
import os
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

C_SUFFIXES = {".c", ".h", ".cpp", ".hpp", ".inl"}
# At the top of the tree: made by tools, not by us.
NOT_SOURCES = {".git", ".venv", "build", "runs"}
CACHE = re.compile(r"(_cache|__pycache__|\.egg-info)$")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:"([^"]+)"|<([^>]+)>)', re.MULTILINE)


def sources(root: Path, suffixes: set[str] | None = None) -> Iterator[Path]:
    """Every file of the project below `root` in a fixed order, relative to it."""
    for folder, folders, files in os.walk(root):
        made = NOT_SOURCES if Path(folder) == root else set()
        folders[:] = sorted(f for f in folders if f not in made and not CACHE.search(f))
        for name in sorted(files):
            path = Path(folder, name)
            if name in made:  # .git of a worktree
                continue
            if suffixes is None or path.suffix in suffixes:
                yield path.relative_to(root)


def texts(root: Path) -> Iterator[tuple[Path, str]]:
    """Every file that is a text, relative to `root`, with what it holds."""
    for path in sources(root):
        try:
            yield path, (root / path).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # a picture


def includes(path: Path) -> Iterator[tuple[str, bool]]:
    """The includes of a file: what is named, and whether in quotes."""
    for match in INCLUDE.finditer(path.read_text(encoding="utf-8")):
        yield (match[1], True) if match[1] else (match[2], False)


def owners_of(files: list[str], includer: Path, name: str, quoted: bool) -> list[str]:
    """Which of `files` the `name` can mean: the one beside the includer, else all that end so."""
    beside = os.path.normpath(includer.parent / name)
    if quoted and beside in files:
        return [beside]
    tail = "/" + re.sub(r"^(\.\.?/)+", "", name)
    return [file for file in files if f"/{file}".endswith(tail)]


def imports(path: Path) -> Iterator[str]:
    """Top-level names of the absolute imports of a Python file, also those inside functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.split(".")[0]


def plant(root: Path, files: dict[str, str]) -> Path:
    """Writes a small tree below `root`."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return root
