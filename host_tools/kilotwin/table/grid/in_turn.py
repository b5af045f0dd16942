"""Configurations that modules are sent one after the other, as a lab's host does it.

A module's program sees each configuration that its module is sent: setup() runs after it. So a
module gets those that are for it, in their order, and none that is for another one. Rounds do that:
in the first each module gets its first configuration, in the second its second. Where a module is
only to end up with its bytes, `cover` takes fewer frames.
"""

from collections.abc import Iterable, Mapping, Sequence

from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.experiment.spec.kconf import Content, InTurn
from kilotwin.files.message_crc import message_crc
from kilotwin.table.grid.cover import ALL_MODULES, Group, Message, cover


def in_turn(content: Content) -> InTurn:
    """The configurations of a module, the first one first."""
    return (content,) if isinstance(content, bytes) else content


def last(content: Content) -> bytes:
    """The configuration that a module has in the end."""
    return in_turn(content)[-1]


def is_held(content: Content, size: int, crc: int) -> bool:
    """Whether a module that says this size and CRC has what it is to have in the end."""
    wanted = last(content)
    return (size, crc) == (len(wanted), message_crc(wanted))


def behind(before: Content | None, content: Content) -> Content:
    """Messages for a module that lost all: bytes take the place of `before`, turns follow it."""
    if before is None or isinstance(content, bytes):
        return content
    return (*in_turn(before), *content)


def rounds_of(wanted: Iterable[Content]) -> int:
    """How many rounds these take."""
    return max((len(in_turn(content)) for content in wanted), default=0)


def rounds(wanted: Mapping[Module, Content], modules: Sequence[Module]) -> list[list[Message]]:
    """The messages of each round to the modules of one bus, which are `modules`."""
    whole = {module: content for module, content in wanted.items() if isinstance(content, bytes)}
    found = []
    for number in range(rounds_of(wanted.values())):
        single = {
            module: content[number]
            for module, content in wanted.items()
            if not isinstance(content, bytes) and number < len(content)
        }
        found.append([*(cover(whole, modules) if number == 0 else ()), *_exactly(single, modules)])
    return found


def _exactly(wanted: Mapping[Module, bytes], modules: Sequence[Module]) -> list[Message]:
    """Each module gets its message and no other: to all, to whole rows and columns, to the rest."""
    columns, rows = (sorted({module[axis] for module in modules}) for axis in (0, 1))
    groups = [ALL_MODULES, *(Group(None, y) for y in rows), *(Group(x, None) for x in columns)]
    open_ = dict(wanted)
    messages = []
    for group in groups:
        reached = [module for module in modules if group.covers(module)]
        contents = {open_.get(module) for module in reached}
        content = next(iter(contents), None)
        if len(reached) < 2 or len(contents) > 1 or content is None:
            continue
        messages.append(Message(group, content))
        for module in reached:
            del open_[module]
    return [*messages, *(Message(Group(*module), content) for module, content in open_.items())]
