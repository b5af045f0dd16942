"""Python of the user's that an experiment names: found without running it, loaded, and blamed."""

import ast
import hashlib
import importlib.util
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from kilotwin.errors import InputError
from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath

_DEFINITIONS: dict[str, type[ast.ClassDef | ast.FunctionDef]] = {
    "class": ast.ClassDef,
    "function": ast.FunctionDef,
}


@dataclass(frozen=True)
class PythonName:
    """A class or a function in a file, not loaded."""

    file: Path
    name: str

    def sha256(self) -> str:
        """Digest of its file and of the modules beside it, which it may import."""
        digest = hashlib.sha256()
        for module in sorted({self.file, *self.file.parent.glob("*.py")}):
            digest.update(hashlib.sha256(module.read_bytes()).digest())
        return digest.hexdigest()


def find_python(
    written: str, path: KeyPath, origin: ExperimentText, kind: Literal["class", "function"]
) -> PythonName:
    """The file and the name in a text as "file.py:name".

    InputError unless the file is there, is Python, and binds such a name."""
    where, colon, name = written.rpartition(":")
    if not colon or not where or not name.isidentifier():
        example = "pheromone.py:Pheromone" if kind == "class" else "analysis.py:spread"
        what = f"'{written}' names no {kind}; write a file and a {kind}, as in \"{example}\""
        raise InputError(f"{origin.where(path)}: {what}")
    file = find_file(where, path, origin)
    try:
        tree = ast.parse(file.read_bytes(), str(file))
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        what = f"{shown(file)}{f':{line}' if line else ''}: {getattr(error, 'msg', error)}"
        raise InputError(f"{origin.where(path)}: it is not Python: {what}") from None
    names = set(_bound_names(tree))
    if name not in names and "*" not in names:
        there = ", ".join(n.name for n in tree.body if isinstance(n, _DEFINITIONS[kind]))
        what = f"{shown(file)} has no {kind} '{name}'; it has {there or 'none'}"
        raise InputError(f"{origin.where(path)}: {what}")
    return PythonName(file, name)


def _bound_names(tree: ast.Module) -> Iterator[str]:
    """Names that a class or function may have come by; "*" for anything."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.alias):
            yield node.asname or node.name


def load_name(named: PythonName) -> Any:
    """The object of that name, or None. Modules beside the file can be imported meanwhile.

    Loaded anew each time; what goes wrong in it is raised as it is.
    """
    spec = importlib.util.spec_from_file_location(f"_user_{named.file.stem}", named.file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    sys.path.insert(0, str(named.file.parent))
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = before
        sys.path.remove(str(named.file.parent))
    return getattr(module, named.name, None)


def blamed_line(error: BaseException, file: Path) -> str:
    """`file:line`, the last line of the file's own, or of its neighbours, that was under way."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return f"{shown(Path(error.filename))}:{error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if Path(f.filename).is_relative_to(file.parent)]
    if not own:
        return str(shown(file))
    return f"{shown(Path(own[-1].filename))}:{own[-1].lineno}"


def what_happened(error: BaseException) -> str:
    """`ValueError: its text`."""
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
