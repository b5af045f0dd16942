"""Tells every module of a bus what it needs by as few messages as may be.

A bus takes messages to all its modules, to a column, to a row and to one module. Each of them may
be told again later: the last one counts. So a grid of one background with a border and some spots
takes one broadcast, a few lines and the spots, in that order.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

Module = tuple[int, int]
"""(x, y): column and row."""


@dataclass(frozen=True)
class Group:
    """Modules of one bus that one message reaches: x and y, or None for every column or row."""

    x: int | None
    y: int | None

    def covers(self, module: Module) -> bool:
        """Whether the message reaches this module."""
        return self.x in (None, module[0]) and self.y in (None, module[1])


EVERYBODY = Group(None, None)


@dataclass(frozen=True)
class Telling:
    """One message: to whom, and what."""

    group: Group
    content: bytes


def cover(wanted: Mapping[Module, bytes], everybody: Iterable[Module]) -> list[Telling]:
    """Messages that leave each module of `wanted` with its content, in the order to send them.

    `everybody` is on the bus; modules that are not in `wanted` are told nothing. At most a message
    per module, and never more than a broadcast and one for each module that wants something else.
    """
    if not wanted:
        return []
    wanted = {module: wanted[module] for module in sorted(wanted)}
    silent = set(everybody) - set(wanted)
    candidates = [_backwards(wanted, silent, lines) for lines in (True, False)]
    candidates.append([Telling(Group(*module), content) for module, content in wanted.items()])
    return min(candidates, key=len)


def apply(tellings: Sequence[Telling], everybody: Iterable[Module]) -> dict[Module, bytes]:
    """What each module has after these messages; those told nothing are left out."""
    modules = list(everybody)
    return {
        module: telling.content
        for telling in tellings
        for module in modules
        if telling.group.covers(module)
    }


def _backwards(wanted: Mapping[Module, bytes], silent: set[Module], lines: bool) -> list[Telling]:
    """Finds the last message first: what a later message sets, an earlier one may set to anything.

    A line whose open modules all want the same can be told as a whole; that closes it. When no line
    can, single modules are told which stand in the way of the most open modules.
    """
    open_ = dict(wanted)
    last_first: list[Telling] = []
    while open_:
        most, count = _most_common(open_.values())
        if count == len(open_) and not silent:
            # A lone module is told alone.
            last_first.append(Telling(EVERYBODY if count > 1 else Group(*next(iter(open_))), most))
            break
        group = _best_line(open_, silent, most) if lines else None
        if group is not None:
            content = next(open_[module] for module in open_ if group.covers(module))
            last_first.append(Telling(group, content))
            open_ = {module: open_[module] for module in open_ if not group.covers(module)}
            continue
        in_the_way = _in_the_way(open_, silent, most) if lines and not silent else None
        others = [module for module in open_ if silent or open_[module] != most]
        for module in in_the_way or others:
            last_first.append(Telling(Group(*module), open_.pop(module)))
    return last_first[::-1]


def _most_common(contents: Iterable[bytes]) -> tuple[bytes, int]:
    """Of equally common ones the least, so that the result does not depend on the order."""
    counts = Counter(contents)
    content = min(counts, key=lambda content: (-counts[content], content))
    return content, counts[content]


def _lines(
    open_: Mapping[Module, bytes], silent: set[Module]
) -> Iterable[tuple[Group, list[Module]]]:
    """Every column and row with open modules, and these; none that holds a silent module."""
    for column in sorted({x for x, _ in open_} - {x for x, _ in silent}):
        yield Group(column, None), [module for module in open_ if module[0] == column]
    for row in sorted({y for _, y in open_} - {y for _, y in silent}):
        yield Group(None, row), [module for module in open_ if module[1] == row]


def _best_line(
    open_: Mapping[Module, bytes], silent: set[Module], background: bytes
) -> Group | None:
    """The line that closes the most modules, of those where one content suits all open ones.

    A line of background is left to the broadcast, unless there can be none.
    """
    best: tuple[int, Group] | None = None
    for group, modules in _lines(open_, silent):
        contents = {open_[module] for module in modules}
        if len(contents) > 1 or (background in contents and not silent) or len(modules) < 2:
            continue
        if best is None or len(modules) > best[0]:
            best = len(modules), group
    return None if best is None else best[1]


def _in_the_way(
    open_: Mapping[Module, bytes], silent: set[Module], background: bytes
) -> list[Module] | None:
    """Modules to tell alone so that a line can be told as a whole, where that saves messages."""
    best: tuple[int, list[Module]] | None = None
    for _, modules in _lines(open_, silent):
        spots = [open_[module] for module in modules if open_[module] != background]
        if not spots:
            continue
        most, count = _most_common(spots)
        others = [module for module in modules if open_[module] != most]
        # The line saves `count` messages for one, and needs one for each of the background in it;
        # what else is in it would need its own, or another line, anyhow.
        saved = count - 1 - sum(open_[module] == background for module in others)
        if saved > 0 and (best is None or saved > best[0]):
            best = saved, others
    return None if best is None else best[1]
