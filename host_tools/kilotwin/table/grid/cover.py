"""Configures every module of a bus by as few messages as possible.

A message on a bus goes to all its modules, to a column, to a row or to one module. A later message
overwrites an earlier one. So a grid of one background with a border and some spots takes one
broadcast, a few lines and the spots, in that order.
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


ALL_MODULES = Group(None, None)


@dataclass(frozen=True)
class Message:
    """One message: the modules that it reaches, and the bytes that they are to have."""

    group: Group
    content: bytes


def cover(wanted: Mapping[Module, bytes], modules: Iterable[Module]) -> list[Message]:
    """Messages that leave each module of `wanted` with its content, in the order to send them.

    `modules` are all on the bus; those that are not in `wanted` get no message. At most a message
    per module, and never more than a broadcast and one for each module with another content.
    """
    if not wanted:
        return []
    wanted = {module: wanted[module] for module in sorted(wanted)}
    excluded = set(modules) - set(wanted)
    candidates = [_backwards(wanted, excluded, lines) for lines in (True, False)]
    candidates.append([Message(Group(*module), content) for module, content in wanted.items()])
    return min(candidates, key=len)


def apply(messages: Sequence[Message], modules: Iterable[Module]) -> dict[Module, bytes]:
    """Configuration of each module after these messages; those that none reached are left out."""
    everywhere = list(modules)
    return {
        module: message.content
        for message in messages
        for module in everywhere
        if message.group.covers(module)
    }


def _backwards(wanted: Mapping[Module, bytes], excluded: set[Module], lines: bool) -> list[Message]:
    """Finds the last message first: what a later message sets, an earlier one may set to anything.

    One message closes a line whose open modules all need the same content. When there is no such
    line, messages go to the single modules that stand in the way of the most open modules.
    """
    open_ = dict(wanted)
    last_first: list[Message] = []
    while open_:
        most, count = _most_common(open_.values())
        if count == len(open_) and not excluded:
            # A single module gets a message of its own.
            last_first.append(
                Message(ALL_MODULES if count > 1 else Group(*next(iter(open_))), most)
            )
            break
        line = _best_line(open_, excluded, most) if lines else None
        if line is not None:
            content = next(open_[module] for module in open_ if line.covers(module))
            last_first.append(Message(line, content))
            open_ = {module: open_[module] for module in open_ if not line.covers(module)}
            continue
        in_the_way = _in_the_way(open_, excluded, most) if lines and not excluded else None
        others = [module for module in open_ if excluded or open_[module] != most]
        for module in in_the_way or others:
            last_first.append(Message(Group(*module), open_.pop(module)))
    return last_first[::-1]


def _most_common(contents: Iterable[bytes]) -> tuple[bytes, int]:
    """The most common content and its count; ties go to the least, whatever the order."""
    counts = Counter(contents)
    content = min(counts, key=lambda content: (-counts[content], content))
    return content, counts[content]


def _lines(
    open_: Mapping[Module, bytes], excluded: set[Module]
) -> Iterable[tuple[Group, list[Module]]]:
    """Every column and row with open modules, and these; none that holds an excluded module."""
    for column in sorted({x for x, _ in open_} - {x for x, _ in excluded}):
        yield Group(column, None), [module for module in open_ if module[0] == column]
    for row in sorted({y for _, y in open_} - {y for _, y in excluded}):
        yield Group(None, row), [module for module in open_ if module[1] == row]


def _best_line(
    open_: Mapping[Module, bytes], excluded: set[Module], background: bytes
) -> Group | None:
    """The line that closes the most modules, of those where one content suits all open ones.

    A line of background is left to the broadcast, unless there can be none.
    """
    best: tuple[int, Group] | None = None
    for group, modules in _lines(open_, excluded):
        contents = {open_[module] for module in modules}
        if len(contents) > 1 or (background in contents and not excluded) or len(modules) < 2:
            continue
        if best is None or len(modules) > best[0]:
            best = len(modules), group
    return None if best is None else best[1]


def _in_the_way(
    open_: Mapping[Module, bytes], excluded: set[Module], background: bytes
) -> list[Module] | None:
    """Modules to address alone so that one message suits their line, where that saves messages."""
    best: tuple[int, list[Module]] | None = None
    for _, modules in _lines(open_, excluded):
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
