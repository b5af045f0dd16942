"""The packages of host_tools/kilotwin import one way, at the top of their files.

The rules are functions of a tree, so that each of them is also tried on a small bad tree.
"""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .tree import ROOT, lazy_imports, plant, sources

KILOTWIN = "host_tools/kilotwin"
AT_THE_TOP = ("__init__", "__main__", "errors", "units")
# A package imports from itself, from those on its left, from errors and units, and the engine.
ORDER = (
    *(
        "files",
        "ports",
        "parameters",
        "aggregation",
        "experiment",
        "build",
        "port",
        "coverage",
        "can",
        "grid",
        "links",
        "environment",
    ),
    *("metrics", "runs", "lab", "sweep", "compare", "plot", "paper", "scenario"),
    *("testing", "view", "export", "search", "flash"),
    "commands",
)
BELOW_ALL = ("errors", "units", "_emulator", "__version__")
# Where modules are loaded by name, on first use: the Python API, commands, and pytest's plugin.
LAZY = (
    *(f"{KILOTWIN}/__init__.py", f"{KILOTWIN}/files/lazy.py"),
    *(f"{KILOTWIN}/testing/__init__.py", f"{KILOTWIN}/testing/plugin.py"),
)


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
        if package in ("__init__", "__main__"):
            continue
        below = ORDER[: ORDER.index(package) + 1] if package in ORDER else ()
        allowed = (*below, *BELOW_ALL)
        found += [
            f"{path}: imports {name}, which is above {package}"
            for name in (*own_imports(tree), *lazy_imports(tree))
            if name.split(".")[0] not in allowed
        ]
    return found


def lazy_imports_of_nothing(root: Path) -> list[str]:
    return [
        f"{path}: there is no {name} to load"
        for path, tree in modules(root)
        for name in lazy_imports(tree)
        if not (root / KILOTWIN / f"{name.replace('.', '/')}.py").exists()
    ]


def late_imports(root: Path) -> list[str]:
    functions = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
    return [
        f"{path}: imports {name} in a function"
        for path, tree in modules(root)
        for node in ast.walk(tree)
        if isinstance(node, functions)
        for name in own_imports(node)
    ]


def imports_by_name(root: Path) -> list[str]:
    return [
        f"{path}: loads a module by name"
        for path, tree in modules(root)
        for node in ast.walk(tree)
        if isinstance(node, ast.Name | ast.Attribute)
        and (node.id if isinstance(node, ast.Name) else node.attr)
        in ("import_module", "__import__")
        and path.as_posix() not in LAZY
    ]


RULES = [
    modules_at_the_top,
    upward_imports,
    lazy_imports_of_nothing,
    late_imports,
    imports_by_name,
]


@pytest.mark.parametrize("rule", RULES)
def test_packages_import_one_way(rule: Callable[[Path], list[str]]) -> None:
    assert rule(ROOT) == []


def test_the_order_has_every_package() -> None:
    found = {path.parent for path, _ in modules(ROOT) if path.name == "__init__.py"}
    assert found == {Path(KILOTWIN), *(Path(KILOTWIN, package) for package in ORDER)}


@pytest.mark.parametrize(
    ("rule", "name", "text"),
    [
        (modules_at_the_top, "run.py", ""),
        (upward_imports, "runs/run.py", "from kilotwin.sweep.plan import Plan\n"),
        (upward_imports, "can/x.py", "def f():\n    import kilotwin.grid.links\n"),
        (upward_imports, "can/x.py", "from kilotwin import grid\n"),
        (upward_imports, "runs/run.py", "def f():\n    lazy.load('sweep.plan')\n"),
        (lazy_imports_of_nothing, "runs/run.py", "def f():\n    lazy.load('runs.nothing')\n"),
        (upward_imports, "units.py", "from kilotwin.experiment import schema\n"),
        (late_imports, "runs/run.py", "def f():\n    from kilotwin.runs import job\n"),
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
