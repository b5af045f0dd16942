"""Words of `--over`, and the spaces that they make."""

import re

import pytest

from kilotwin.errors import InputError
from kilotwin.studies.search.space import parse_axes, settings_of


@pytest.mark.parametrize(
    ("text", "number", "value"),
    [
        ("controller.beta=1..4", 1.23456789, 1.23457),
        ("controller.beta=1.0..4.0", 2.5, 2.5),
        ("swarm.size=10..50", 20, 20),
        ("swarm.size=10..50:10", 20.0, 20),
        ("x=0.001..1,log", 0.0123456789, 0.0123457),
        ("x=-2.5..-1", -2.0, -2.0),
        ("x=1e-3..1e-1,log", 0.01, 0.01),
        ("medium.kind=ideal|kilobot", "ideal", "ideal"),
        ("x=true|false", True, True),
    ],
)
def test_a_range_or_choices_are_understood(text: str, number: object, value: object) -> None:
    (axis,) = parse_axes([text])
    found = axis.value(number)
    assert found == value
    assert type(found) is type(value) or axis.whole
    (setting,) = settings_of({axis.key: found})
    assert setting.keys == tuple(axis.key.split("."))


def test_numbers_are_whole_where_the_key_wants_them() -> None:
    texts = [
        "robots.0.count=1..4",
        "temperature=0..9",
        "controller.beta=1..4",
        "light.ambient=0..9",
    ]
    axes = parse_axes(texts)
    assert [axis.whole for axis in axes] == [True, True, False, False]


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ([], "--over: which keys? Add --over KEY=1..4"),
        (["beta"], "--over beta: not of the form KEY=1..4"),
        (["beta=3"], "--over beta=3: not of the form KEY=1..4"),
        (["beta=4..1"], "the range must lead up"),
        (["beta=0..1,log"], "with log a range begins above 0"),
        (["beta=0..1:2"], "the step must be above 0, and within the range"),
        (["beta=0..1", "beta=2..3"], "beta comes twice"),
        (["swarm.size=1.5..4"], "swarm.size takes whole numbers; write them as 10..50"),
        (["beta=1e..2"], "--over beta=1e..2: not of the form"),
    ],
)
def test_what_is_none_is_refused(texts: list[str], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        parse_axes(texts)
