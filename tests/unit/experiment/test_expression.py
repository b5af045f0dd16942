"""Expressions of [[expect]]: what they are worth, and what is refused."""

import math

import pytest

from kilotwin.experiment.expression import Expression, ExpressionError

NAMES = {"a": 2.0, "b": -3.0, "none": None, "resting.black": 60.0, "site.a b": 7.0, "zero": 0.0}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("resting.black >= 60", 1),
        ("1 < a < 3", 1),
        ("1 < a < 2", 0),
        ("a + b * 2 / 4 - -1", 1.5),
        ("not a or b == -3", 1),
        ("max(a, b, 9) + min(a, b) + abs(b)", 9),
        ('site["a b"]', 7),
        ("True and a != 2", 0),
        ("none > 1", None),
        ("none > 1 or a == 2", 1),
        ("none > 1 and a == 3", 0),
        ("none > 1 and a == 2", None),
        ("a / zero", None),
        ("9e300 * 9e300 > 1", 1),
    ],
)
def test_an_expression_has_the_value_that_python_gives_it_or_none(
    text: str, value: float | None
) -> None:
    assert Expression.of(text).value(NAMES) == value


def test_what_has_no_value_does_not_hold() -> None:
    assert not Expression.of("none <= 5").holds(NAMES)
    assert Expression.of("a").holds(NAMES)
    assert not Expression.of("zero").holds(NAMES)


def test_names_are_found_once_each_in_the_order_of_the_text() -> None:
    assert Expression.of('b > a and site["x"] + site.x > a').names == ("b", "a", "site.x")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("__import__('os').system('x')", "a call of"),
        ("(lambda: 1)()", "a call of"),
        ("a.b.c > 1", "which is no name"),
        ("a[0] > 1", "which is no name"),
        ("[a for a in b]", "has '"),
        ("a ** 99", r"the operator \*\*"),
        ("a in b", "a comparison by `in`"),
        ("'text' > 1", "which is no number"),
        ("2j > 1", "which is no number"),
        ("min(a)", "a call of"),
        ("abs(a, b)", "a call of"),
        ("max(*a, b)", "has '"),
        ("a = 3", "for equal write =="),
        ("a > 1 && b", "write and, or"),
        ("", "is no expression"),
        ("a >", "is no expression at character"),
        ("a; b", "is no expression"),
        ("~a", "has '~a'"),
        ("a if b else 1", "has '"),
        ("a := 3", "is no expression"),
        (r"a == '\d'", "which is no number"),
        ("1if a else 2", "has '"),
        ("a\0b", "is no expression"),
        ("a == \ud800", "is no expression"),
        ("-" * 300 + "a", "write 200 at most"),
        ("(" * 150 + "a", "is no expression"),
    ],
)
def test_what_is_no_expression_is_refused_with_the_reason(text: str, why: str) -> None:
    with pytest.raises(ExpressionError, match=why):
        Expression.of(text)


def test_the_deepest_one_that_is_allowed_is_evaluated() -> None:
    assert Expression.of("-" * 199 + "a").value(NAMES) == -2
    assert math.isclose(Expression.of("1+" * 99 + "1").value(NAMES) or 0, 100)
