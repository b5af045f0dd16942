"""Classes have few members that may be None.

Each such member is a mode: every method has to know in which one it is. A list of companions, an
object that does nothing, or a class of its own says the same once.
`python -m tests.architecture.test_optional_members [FOLDER]` lists the classes that have too many.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from .tree import ROOT, plant, sources

MOST = 2
# Tables of a file, and orders of a page: there what was not written is None, and no mode.
TABLES = {"BaseModel", "Section", "InformedShares", "AggregationTables"}
# Records without behaviour, in which what is not known, or was not given, is None.
RECORDS = {
    "Budget": "limits as options give them",
    "Difference": "statistics that few trials have not, as `compare --json` prints them",
    "Experiment": "what was made of an experiment's tables, of which each may be missing",
    "Film": "options of a video",
    "Robot": "what a robot answered, as far as it did (table/flash/upload.py)",
    "Wanted": "options of a figure",
}
_MEMBER = re.compile(r"^ +(?:mutable )?std::optional<[^()\n]*> (\w+_)(?:;| =|\{)", re.MULTILINE)


def is_optional(annotation: ast.expr | None) -> bool:
    match annotation:
        case ast.Constant(str() as quoted):
            return is_optional(ast.parse(quoted, mode="eval").body)
        case ast.BinOp(left, ast.BitOr(), right):
            return is_optional(left) or is_optional(right)
        case ast.Constant(value):
            return value is None
    return False


def members(node: ast.ClassDef) -> set[str]:
    """The members of a class that are declared, or assigned, as ones that may be None."""
    found = {
        statement.target.id
        for statement in node.body
        if isinstance(statement, ast.AnnAssign)
        and isinstance(statement.target, ast.Name)
        and is_optional(statement.annotation)
    }
    for method in (one for one in node.body if isinstance(one, ast.FunctionDef)):
        arguments = [*method.args.args, *method.args.kwonlyargs]
        optional = {argument.arg for argument in arguments if is_optional(argument.annotation)}
        for statement in ast.walk(method):
            match statement:
                case ast.AnnAssign(ast.Attribute(ast.Name("self"), name), annotation):
                    if is_optional(annotation):
                        found.add(name)
                case ast.Assign([ast.Attribute(ast.Name("self"), name)], ast.Name(value)):
                    if value in optional:
                        found.add(name)
    return found


def crowded_classes(root: Path) -> Iterator[str]:
    for path in sources(root / "host_tools", {".py"}):
        for node in ast.walk(ast.parse((root / "host_tools" / path).read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ClassDef) or node.name in RECORDS:
                continue
            if TABLES & {ast.unparse(base).rpartition(".")[2] for base in node.bases}:
                continue
            if len(found := members(node)) > MOST:
                names = ", ".join(sorted(found))
                yield f"host_tools/{path}:{node.lineno}: {node.name} has {names}"


def crowded_headers(root: Path) -> Iterator[str]:
    for path in sources(root / "emulator", {".h"}):
        found = _MEMBER.findall((root / "emulator" / path).read_text(encoding="utf-8"))
        if len(found) > MOST:
            yield f"emulator/{path}: {', '.join(found)}"


def crowded(root: Path) -> list[str]:
    return [*crowded_classes(root), *crowded_headers(root)]


def test_no_class_has_more_than_two_optional_members() -> None:
    assert crowded(ROOT) == []


def test_each_record_that_is_listed_is_there_and_has_more() -> None:
    found = {
        node.name
        for path in sources(ROOT / "host_tools", {".py"})
        for node in ast.walk(ast.parse((ROOT / "host_tools" / path).read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef) and len(members(node)) > MOST
    }
    assert RECORDS.keys() <= found


def test_classes_with_too_many_are_found(tmp_path: Path) -> None:
    declared = "class Kept:\n    a: int | None = None\n    b: 'int | None' = None\n"
    assigned = "    def __init__(self, c: int | None) -> None:\n        self._c = c\n"
    header = "".join(f"    std::optional<Grid> grid{n}_;\n" for n in range(3))
    plant(tmp_path, {"host_tools/a.py": declared + assigned, "emulator/b.h": header})
    assert crowded(tmp_path) == [
        "host_tools/a.py:1: Kept has _c, a, b",
        "emulator/b.h: grid0_, grid1_, grid2_",
    ]


if __name__ == "__main__":
    print("\n".join(crowded(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)))
