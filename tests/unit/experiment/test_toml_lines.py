"""Every key of a TOML text is found on its line."""

import tomllib
from typing import Any

import pytest
import tomlkit
from hypothesis import assume, given
from hypothesis import strategies as st

from kilotwin.experiment.toml_lines import KeyPath, line_of, locate

EXAMPLE = '''\
# a comment with [brackets] = and "quotes
title = "a # inside"

[owner.address]   # comment
"quoted key" = 1
dotted.deep . key = 2

[[site]]
name = "one"
corners = [
    [0, 1],  # first
    [2, 3],
]

[[site]]
name = """
two
lines ] } , """
place = { x = 1, y = { z = [1, 2] } }

[site.extra]
more = true

[[site.part]]
id = 7

[[site.part]]
id = 8
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2),
        (("owner",), 4),
        (("owner", "address"), 4),
        (("owner", "address", "quoted key"), 5),
        (("owner", "address", "dotted", "deep", "key"), 6),
        (("site",), 8),
        (("site", 0), 8),
        (("site", 0, "name"), 9),
        (("site", 0, "corners", 0), 11),
        (("site", 0, "corners", 1), 12),
        (("site", 0, "corners", 1, 0), 12),
        (("site", 1), 15),
        (("site", 1, "place"), 19),
        (("site", 1, "place", "y", "z", 1), 19),
        (("site", 1, "extra", "more"), 22),
        (("site", 1, "part", 0, "id"), 25),
        (("site", 1, "part", 1), 27),
        (("site", 1, "part", 1, "id"), 28),
    ],
)
def test_a_key_is_found_on_its_line(path: KeyPath, line: int) -> None:
    assert locate(EXAMPLE)[path] == line


def test_a_missing_key_is_placed_at_what_is_around_it() -> None:
    assert line_of(locate(EXAMPLE), ("site", 1, "place", "height", 3)) == 19


def test_a_key_of_nothing_has_no_line() -> None:
    assert line_of(locate(EXAMPLE), ("elsewhere",)) is None


@pytest.mark.parametrize(
    "text",
    ["", "\n\n", "a=1", "a='''\n'''\nb=2", 'a="""\\""""\nb=2', "a=1\r\n\r\nb=2\r\n"],
    ids=repr,
)
def test_odd_texts_are_read(text: str) -> None:
    assert {path[0] for path in locate(text)} == set(tomllib.loads(text))


def test_line_ends_of_windows_count_once() -> None:
    assert locate("a=1\r\n\r\nb=2\r\n")["b",] == 3


def paths_of(value: Any, path: KeyPath = ()) -> set[KeyPath]:
    """Every path into tables and lists."""
    found = {path} if path else set()
    if isinstance(value, dict):
        for key, inner in value.items():
            found |= paths_of(inner, (*path, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            found |= paths_of(inner, (*path, index))
    return found


KEYS = st.text(min_size=1, max_size=6)
SCALARS = (
    st.booleans()
    | st.integers(-(2**40), 2**40)
    | st.floats(allow_nan=False)
    | st.text(max_size=12)
    | st.dates()
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=10,
)


def writable(tables: dict[str, Any]) -> str | None:
    """As tomlkit writes it; None for what TOML cannot say (some control characters)."""
    try:
        text = tomlkit.dumps(tables)
        return text if tomllib.loads(text) == tables else None
    except (tomllib.TOMLDecodeError, tomlkit.exceptions.TOMLKitError):
        return None


@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_every_key_that_tomlkit_writes_is_located(tables: dict[str, Any]) -> None:
    text = writable(tables)
    assume(text is not None)
    assert text is not None
    lines = locate(text)
    assert set(lines) == paths_of(tables)
    assert all(1 <= line <= text.count("\n") + 1 for line in lines.values())


@given(st.lists(st.sampled_from("abcdefgh"), min_size=1, unique=True), st.data())
def test_blank_lines_and_comments_shift_keys_as_they_should(
    keys: list[str], data: st.DataObject
) -> None:
    lines: list[str] = []
    expected = {}
    for key in keys:
        lines += data.draw(st.lists(st.sampled_from(["", "# x = 1", "   "]), max_size=3))
        lines.append(f"{key} = [1,\n 2]")
        expected[key] = sum(line.count("\n") + 1 for line in lines) - 1
    located = locate("\n".join(lines))
    assert {key: located[key,] for key in keys} == expected
