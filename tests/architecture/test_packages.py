"""The rooms of host_tools/kilotwin import one way, also in functions.

The rules are functions of a tree, so that each of them is also tried on a small bad tree.
"""

import ast
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .tree import ROOT, plant, sources

KILOTWIN = "host_tools/kilotwin"
# Besides packages: what everything knows, and what users' tests and environments import.
AT_THE_TOP = ("__init__", "__main__", "errors", "units", "testing", "environment")
# A room imports from itself, from those on its left, from errors and units, and the engine.
ORDER = (
    *("files", "experiment", "programs", "metrics", "table", "runs"),
    *("session", "studies", "view", "commands"),
)
MOST_FILES = 40  # of a folder
BELOW_ALL = ("errors", "units", "_emulator", "__version__")
# Commands are loaded by name: there is a module for each.
BY_NAME = (f"{KILOTWIN}/commands/cli.py",)


def modules(root: Path) -> Iterator[tuple[Path, ast.Module]]:
    """Every Python file of kilotwin, relative to `root`, parsed."""
    for path in sources(root, {".py"}):
        if path.is_relative_to(KILOTWIN):
            yield path, ast.parse((root / path).read_text(encoding="utf-8"))


def own_imports(tree: ast.AST) -> Iterator[str]:
    """Imports of kilotwin anywhere in `tree`, without the `kilotwin.`"""
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the package"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        yield from (n.removeprefix("kilotwin.") for n in names if n.startswith("kilotwin."))


def modules_at_the_top(root: Path) -> list[str]:
    return [
        f"{path}: belongs into a package"
        for path, _ in modules(root)
        if path.parent.as_posix() == KILOTWIN and path.stem not in AT_THE_TOP
    ]


def upward_imports(root: Path) -> list[str]:
    found = []
    for path, tree in modules(root):
        package = Path(path.relative_to(KILOTWIN).parts[0]).stem
        if package in AT_THE_TOP and package not in BELOW_ALL:
            continue
        below = ORDER[: ORDER.index(package) + 1] if package in ORDER else ()
        allowed = (*below, *BELOW_ALL)
        found += [
            f"{path}: imports {name}, which is above {package}"
            for name in own_imports(tree)
            if name.split(".")[0] not in allowed
        ]
    return found


def crowded_folders(root: Path) -> list[str]:
    files = [path for path in sources(root, {".py"}) if path.is_relative_to(KILOTWIN)]
    folders = Counter(path.parent for path in files)
    return [f"{folder}: {n} files" for folder, n in folders.items() if n > MOST_FILES]


def imports_by_name(root: Path) -> list[str]:
    return [
        f"{path}: loads a module by name"
        for path, tree in modules(root)
        for node in ast.walk(tree)
        if isinstance(node, ast.Name | ast.Attribute)
        and (node.id if isinstance(node, ast.Name) else node.attr)
        in ("import_module", "__import__")
        and path.as_posix() not in BY_NAME
    ]


RULES = [
    modules_at_the_top,
    upward_imports,
    crowded_folders,
    imports_by_name,
]


@pytest.mark.parametrize("rule", RULES)
def test_rooms_import_one_way(rule: Callable[[Path], list[str]]) -> None:
    assert rule(ROOT) == []


def test_the_order_has_every_room() -> None:
    found = {path.relative_to(KILOTWIN).parts[0] for path, _ in modules(ROOT)}
    assert found == {*ORDER, *(f"{name}.py" for name in AT_THE_TOP)}


@pytest.mark.parametrize(
    ("rule", "name", "text"),
    [
        (modules_at_the_top, "run.py", ""),
        (upward_imports, "runs/run.py", "from kilotwin.studies.sweep.plan import Plan\n"),
        (upward_imports, "table/x.py", "def f():\n    import kilotwin.session.run\n"),
        (upward_imports, "files/x.py", "from kilotwin import table\n"),
        (upward_imports, "units.py", "from kilotwin.experiment import schema\n"),
        (imports_by_name, "runs/run.py", "importlib.import_module('kilotwin.runs.job')\n"),
    ],
)
def test_a_planted_bad_module_is_caught(
    rule: Callable[[Path], list[str]], name: str, text: str, tmp_path: Path
) -> None:
    plant(tmp_path, {f"{KILOTWIN}/{name}": text, f"{KILOTWIN}/errors.py": ""})
    found = rule(tmp_path)
    assert len(found) == 1, found
    assert found[0].startswith(f"{KILOTWIN}/{name}")


def test_a_crowded_folder_is_caught(tmp_path: Path) -> None:
    plant(tmp_path, {f"{KILOTWIN}/runs/n{n}.py": "" for n in range(MOST_FILES + 1)})
    assert crowded_folders(tmp_path) == [f"{KILOTWIN}/runs: {MOST_FILES + 1} files"]
