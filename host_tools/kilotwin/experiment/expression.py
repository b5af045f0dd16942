"""Expressions of `[[expect]]`: `resting.black >= 60 and not led.red`.

A small part of Python's grammar, which Python parses and we evaluate: numbers, names, + - * /,
comparisons (chained too), and, or, not, min, max, abs and brackets. Nothing is executed.
"""

import ast
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Value = float | None
"""None: a name has no value at that moment, as the spread of no robots."""

ALLOWED = "numbers, names, + - * /, comparisons, and, or, not, min(), max(), abs() and brackets"

_MOST_CHARACTERS = 200
_OPERATORS: dict[type[ast.AST], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_COMPARISONS: dict[type[ast.AST], Callable[[float, float], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_FUNCTIONS: dict[str, Callable[..., float]] = {"min": min, "max": max, "abs": abs}
_MARKS = {ast.Mod: "%", ast.Pow: "**", ast.FloorDiv: "//"}


class ExpressionError(ValueError):
    """A text that is no expression; it says why, and what is allowed."""


@dataclass(frozen=True)
class Expression:
    """`names` are those in it, in the order of the text."""

    text: str
    names: tuple[str, ...]
    _tree: ast.expr

    @staticmethod
    def of(text: str) -> "Expression":
        """ExpressionError if it is none."""
        if len(text) > _MOST_CHARACTERS:
            raise ExpressionError(f"has {len(text)} characters; write {_MOST_CHARACTERS} at most")
        try:
            with warnings.catch_warnings(action="ignore"):  # of Python, about its own pitfalls
                tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            place = f" at character {error.offset}" if isinstance(error, SyntaxError) else ""
            raise ExpressionError(f"is no expression{place}; {_hint(text)}") from None
        names = tuple(dict.fromkeys(_names(tree)))
        return Expression(text, names, tree)

    def value(self, names: Mapping[str, Value]) -> Value:
        """Its value, 1 and 0 for true and false; None where a name in it has none, or of a division
        by zero."""
        try:
            found = _value(self._tree, names)
        except (ZeroDivisionError, OverflowError):
            return None
        return None if found is None else float(found)

    def holds(self, names: Mapping[str, Value]) -> bool:
        """Whether it is true: any value but 0."""
        return bool(self.value(names))


def _hint(text: str) -> str:
    if "=" in text and not set("<>!") & set(text) and "==" not in text:
        return "for equal write =="
    if "&&" in text or "||" in text:
        return "write and, or"
    return f"allowed: {ALLOWED}"


def _refused(what: str) -> ExpressionError:
    return ExpressionError(f"has {what}; allowed: {ALLOWED}")


def _names(tree: ast.expr) -> Iterator[str]:
    """The names in a tree; ExpressionError of what is not allowed in one."""
    if isinstance(tree, ast.Name | ast.Attribute | ast.Subscript):
        yield name_of(tree)
    elif isinstance(tree, ast.Constant):
        if type(tree.value) not in (int, float, bool):
            raise _refused(f"{tree.value!r:.40}, which is no number")
    else:
        for part in _parts(tree):
            yield from _names(part)


def _parts(tree: ast.expr) -> list[ast.expr]:
    if isinstance(tree, ast.BoolOp):
        return tree.values
    if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not | ast.USub | ast.UAdd):
        return [tree.operand]
    if isinstance(tree, ast.BinOp):
        if type(tree.op) not in _OPERATORS:
            mark = _MARKS.get(type(tree.op), type(tree.op).__name__)
            raise _refused(f"the operator {mark}")
        return [tree.left, tree.right]
    if isinstance(tree, ast.Compare):
        if any(type(mark) not in _COMPARISONS for mark in tree.ops):
            raise _refused("a comparison by `in` or `is`")
        return [tree.left, *tree.comparators]
    if isinstance(tree, ast.Call):
        name = tree.func.id if isinstance(tree.func, ast.Name) else ""
        least, most = (1, 1) if name == "abs" else (2, 20)
        if name not in _FUNCTIONS or tree.keywords or not least <= len(tree.args) <= most:
            raise _refused(f"a call of '{ast.unparse(tree)[:40]}'")
        return tree.args
    raise _refused(f"'{ast.unparse(tree)[:40]}'")


def name_of(tree: ast.expr) -> str:
    """`resting.black` of `resting.black` and `resting["black"]`."""
    if isinstance(tree, ast.Name):
        return tree.id
    inner = tree.value if isinstance(tree, ast.Attribute | ast.Subscript) else None
    if isinstance(inner, ast.Name):
        if isinstance(tree, ast.Attribute):
            return f"{inner.id}.{tree.attr}"
        assert isinstance(tree, ast.Subscript)
        if isinstance(tree.slice, ast.Constant) and isinstance(tree.slice.value, str):
            return f"{inner.id}.{tree.slice.value}"
    raise _refused(f"'{ast.unparse(tree)[:40]}', which is no name")


def _value(tree: ast.expr, names: Mapping[str, Value]) -> Any:
    if isinstance(tree, ast.Constant):
        return float(tree.value)  # type: ignore[arg-type] # _names() has seen that it is a number
    if isinstance(tree, ast.Name | ast.Attribute | ast.Subscript):
        return names[name_of(tree)]
    values = [_value(part, names) for part in _parts(tree)]
    if isinstance(tree, ast.BoolOp):
        return _joined(isinstance(tree.op, ast.And), values)
    if any(value is None for value in values):
        return None
    if isinstance(tree, ast.UnaryOp):
        if isinstance(tree.op, ast.Not):
            return float(not values[0])
        return -values[0] if isinstance(tree.op, ast.USub) else values[0]
    if isinstance(tree, ast.BinOp):
        return _OPERATORS[type(tree.op)](*values)
    if isinstance(tree, ast.Compare):
        pairs = zip(tree.ops, values, values[1:], strict=False)
        return float(all(_COMPARISONS[type(mark)](left, right) for mark, left, right in pairs))
    assert isinstance(tree, ast.Call)
    assert isinstance(tree.func, ast.Name)
    return _FUNCTIONS[tree.func.id](*values)


def _joined(all_of_them: bool, values: list[Value]) -> Value:
    """`and`, `or`: what one part decides does not depend on parts without a value."""
    known = [bool(value) for value in values if value is not None]
    if (not all(known)) if all_of_them else any(known):
        return float(not all_of_them)
    return float(all_of_them) if len(known) == len(values) else None
