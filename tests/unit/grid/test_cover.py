"""Modules are told what they need by few messages, and exactly that."""

from hypothesis import given
from hypothesis import strategies as st

from kilotwin.table.grid.cover import ALL_MODULES, Group, Module, apply, cover

FREE, WALL, SITE = b"\0", b"\1", b"\2"


def modules(columns: int, rows: int) -> list[Module]:
    return [(x, y) for y in range(rows) for x in range(columns)]


@st.composite
def wishes(draw: st.DrawFn) -> tuple[list[Module], dict[Module, bytes]]:
    """A grid, and what some or all of its modules want."""
    everybody = modules(draw(st.integers(1, 6)), draw(st.integers(1, 6)))
    content = st.sampled_from(
        [FREE, WALL, SITE, None] if draw(st.booleans()) else [FREE, WALL, SITE]
    )
    wanted = {module: draw(content) for module in everybody}
    return everybody, {module: what for module, what in wanted.items() if what is not None}


@given(wishes())
def test_every_module_gets_what_it_wants_and_no_other_is_told(
    wish: tuple[list[Module], dict[Module, bytes]],
) -> None:
    everybody, wanted = wish
    assert apply(cover(wanted, everybody), everybody) == wanted


@given(wishes())
def test_there_are_never_more_messages_than_modules_or_than_a_broadcast_and_the_others(
    wish: tuple[list[Module], dict[Module, bytes]],
) -> None:
    everybody, wanted = wish
    messages = cover(wanted, everybody)
    assert len(messages) <= len(wanted)
    if wanted.keys() == set(everybody):
        contents = list(wanted.values())
        others = len(contents) - max(map(contents.count, contents))
        assert len(messages) <= 1 + others


@given(wishes())
def test_the_messages_do_not_depend_on_the_order_of_the_modules(
    wish: tuple[list[Module], dict[Module, bytes]],
) -> None:
    everybody, wanted = wish
    backwards = dict(reversed(wanted.items()))
    assert cover(backwards, everybody[::-1]) == cover(wanted, everybody)


def test_one_content_takes_one_broadcast() -> None:
    grid = modules(10, 5)
    (only,) = cover(dict.fromkeys(grid, FREE), grid)
    assert only.group == ALL_MODULES


def test_a_border_takes_a_broadcast_lines_and_corners() -> None:
    """Edges differ as a ring of wall cells makes them: each side its own, corners their own."""
    grid = modules(10, 20)
    wanted = dict.fromkeys(grid, FREE)
    for x, y in grid:
        sides = (
            b"L" if x == 0 else b"R" if x == 9 else b"",
            b"B" if y == 0 else b"T" if y == 19 else b"",
        )
        if any(sides):
            wanted[x, y] = b"".join(sides)
    messages = cover(wanted, grid)
    assert len(messages) == 1 + 4 + 4
    assert messages[0].group == ALL_MODULES
    lines = {Group(0, None), Group(9, None), Group(None, 0), Group(None, 19)}
    assert lines < {telling.group for telling in messages}


def test_stripes_take_a_row_each() -> None:
    grid = modules(10, 10)
    wanted = {(x, y): SITE if y in (1, 2, 8) else FREE for x, y in grid}
    assert len(cover(wanted, grid)) == 4


def test_modules_that_want_nothing_are_not_in_a_broadcast() -> None:
    grid = modules(3, 1)
    messages = cover({(0, 0): WALL, (1, 0): WALL}, grid)
    assert {telling.group for telling in messages} == {Group(0, 0), Group(1, 0)}
