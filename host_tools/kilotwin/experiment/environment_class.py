"""Where the program of an [environment] is: a file, and a class in it."""

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.experiment.environment_schema import EnvironmentTable
from kilotwin.experiment.files import find_file, shown
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath

_PATH: KeyPath = ("environment", "program")


@dataclass(frozen=True)
class EnvironmentClass:
    """A class, not loaded."""

    file: Path
    class_name: str

    def sha256(self) -> str:
        """Digest of its file and of the modules beside it, which it may import."""
        digest = hashlib.sha256()
        for module in sorted({self.file, *self.file.parent.glob("*.py")}):
            digest.update(hashlib.sha256(module.read_bytes()).digest())
        return digest.hexdigest()


def environment_class(
    table: EnvironmentTable | None, origin: ExperimentText
) -> EnvironmentClass | None:
    """The class that `program` names, if there is an [environment].

    InputError unless the file is there, is Python, and binds such a name."""
    if table is None:
        return None
    written, colon, class_name = table.program.rpartition(":")
    if not colon or not written or not class_name.isidentifier():
        example = 'write a file and a class, as in "pheromone.py:Pheromone"'
        raise InputError(f"{origin.where(_PATH)}: '{table.program}' names no class; {example}")
    file = find_file(written, _PATH, origin)
    try:
        tree = ast.parse(file.read_bytes(), str(file))
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        what = f"{shown(file)}{f':{line}' if line else ''}: {getattr(error, 'msg', error)}"
        raise InputError(f"{origin.where(_PATH)}: it is not Python: {what}") from None
    names = set(_bound_names(tree))
    if class_name not in names and "*" not in names:
        classes = ", ".join(node.name for node in tree.body if isinstance(node, ast.ClassDef))
        what = f"{shown(file)} has no class '{class_name}'; it has {classes or 'none'}"
        raise InputError(f"{origin.where(_PATH)}: {what}")
    return EnvironmentClass(file, class_name)


def _bound_names(tree: ast.Module) -> Iterator[str]:
    """Names that a class may have come by; "*" for anything."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.alias):
            yield node.asname or node.name
