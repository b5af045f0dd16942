"""`.kconf` files: which module of a Kilogrid gets which configuration bytes.

A file is a list of blocks. A block is a line `address`, lines that name modules, a line `data`
and one hex byte per line, up to 48. `#` begins a comment; empty lines mean nothing.

    address
    module:0-0,9-0      modules by column and row
    x:1-8               whole columns, here 1 to 8
    y:0,19              whole rows

    data
    0x01                a byte each for cells 0 to 3, as most programs take them
    0x01
    0x02
    2

Where blocks name a module twice it is sent both, one after the other, as the lab's tool does it:
its program sees each, and keeps the last one unless it notes them. A file without a block is
allowed: then modules get no configuration.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from kilotwin.errors import InputError, cause_of

MOST_BYTES = 48
LAST = 30
"""Columns and rows are 0 to this: five bits of a CAN identifier, less the one that means all."""

Module = tuple[int, int]
"""(x, y): column and row."""

InTurn = tuple[bytes, ...]
"""Configurations of one module, the first to be sent first."""
Content = bytes | InTurn
"""Bytes that a module is to have in the end, or those that it is sent in turn."""

_FORMS = "module:x-y, x:columns or y:rows (lists with commas, ranges as 3-7)"
_NUMBER = re.compile(r"\d{1,3}")
_HEX = re.compile(r"(0[xX])?[0-9a-fA-F]+")


@dataclass(frozen=True)
class Target:
    """Modules that a block is for: one of them, a whole column `x`, or a whole row `y`."""

    kind: Literal["module", "x", "y"]
    x: int | None = None
    y: int | None = None
    line: int = field(default=0, compare=False)  # in its file

    def covers(self, module: Module) -> bool:
        """Whether it means this module."""
        return self.x in (None, module[0]) and self.y in (None, module[1])


@dataclass(frozen=True)
class Block:
    """The same bytes for some modules."""

    targets: tuple[Target, ...]
    data: bytes


def read(file: Path) -> list[Block]:
    """The blocks of a file; InputError names the file and the line."""
    try:
        return parse(file.read_bytes().decode(), str(file))
    except UnicodeDecodeError:
        raise InputError(f"{file}: not UTF-8 text; name a .kconf file") from None
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"{file}: {reason}; name a .kconf file") from None


def parse(text: str, source: str = ".kconf") -> list[Block]:
    """The blocks of a text; InputError names `source` and the line."""
    return list(_Parser(text, source).blocks())


def write(file: Path, blocks: Iterable[Block]) -> None:
    """A file that `read`, and the lab's own tool, take."""
    file.write_text(to_text(blocks))


def to_text(blocks: Iterable[Block]) -> str:
    """The text of blocks; `parse` gives the same blocks back."""
    return "\n".join(_block_text(block) for block in blocks)


def configurations(
    blocks: Iterable[Block], columns: int, rows: int, source: str = ".kconf"
) -> dict[Module, InTurn]:
    """Configurations of each module, in the file's order; without modules that no block names.

    InputError for blocks that name a module outside the grid.
    """
    found: dict[Module, InTurn] = {}
    for block in blocks:
        for target in block.targets:
            if not _inside(target, columns, rows):
                raise InputError(
                    f"{source}:{target.line}: {_target_text(target)} is not on a grid of "
                    f"{columns} x {rows} modules; columns are 0 to {columns - 1}, rows 0 to "
                    f"{rows - 1}"
                )
            for y in range(rows) if target.y is None else (target.y,):
                for x in range(columns) if target.x is None else (target.x,):
                    found[x, y] = (*found.get((x, y), ()), block.data)
    return found


def blocks_of(configuration: Mapping[Module, Content]) -> list[Block]:
    """One block per distinct content, in the order of the first module that has it.

    What a module is sent in turn is in as many blocks, in their order.
    """
    modules: dict[InTurn, list[Module]] = {}
    for module in sorted(configuration, key=lambda place: (place[1], place[0])):
        content = configuration[module]
        in_turn = (content,) if isinstance(content, bytes) else content
        modules.setdefault(in_turn, []).append(module)
    return [
        Block(tuple(Target("module", x, y) for x, y in places), data)
        for in_turn, places in modules.items()
        for data in in_turn
    ]


def _inside(target: Target, columns: int, rows: int) -> bool:
    return (target.x or 0) < columns and (target.y or 0) < rows


class _Parser:
    """Reads one text from top to bottom."""

    def __init__(self, text: str, source: str) -> None:
        self._text = text
        self._source = source
        self._line = 0
        self._began = 0  # the line of the block's `address`
        self._targets: list[Target] = []
        self._data: list[int] | None = None  # None above `data`

    def blocks(self) -> Iterator[Block]:
        for number, written in enumerate(self._text.splitlines(), 1):
            self._line = number
            words = written.partition("#")[0].strip()
            if not words:
                continue
            if words == "address":
                yield from self._close()
                self._began = number
            elif not self._began:
                raise self._error(f"'{words}' stands before any block; begin with 'address'")
            elif words == "data":
                self._begin_data()
            elif self._data is None:
                self._targets += self._address(words)
            else:
                self._data.append(self._byte(words))
        yield from self._close()

    def _begin_data(self) -> None:
        if self._data is not None:
            raise self._error("a second 'data' in one block; begin the next with 'address'")
        if not self._targets:
            raise self._error(f"no address above 'data'; add a line such as {_FORMS}")
        self._data = []

    def _close(self) -> Iterator[Block]:
        """The block that ends here, if there is one."""
        if not self._began:
            return
        at = self._began
        if self._data is None:
            raise self._error("the block has no 'data'; add it and a hex byte per line", at)
        if not self._data:
            raise self._error(f"the block has no bytes; add 1 to {MOST_BYTES} below 'data'", at)
        yield Block(tuple(self._targets), bytes(self._data))
        self._targets, self._data = [], None

    def _address(self, words: str) -> Iterator[Target]:
        kind, colon, list_text = words.partition(":")
        kind = kind.strip()
        if kind == "cell" and colon:
            raise self._error(f"'{words}' is an old form; write module:{list_text.strip()}")
        if kind not in ("module", "x", "y") or not colon:
            raise self._error(f"'{words}' is no address; allowed: {_FORMS}")
        for item in list_text.split(","):
            first, dash, last = (part.strip() for part in item.partition("-"))
            if kind == "module":
                if not dash:
                    raise self._error(f"'{words}': write each module as column-row, as module:3-7")
                x, y = self._coordinate(first, words), self._coordinate(last, words)
                yield Target("module", x, y, self._line)
                continue
            low = self._coordinate(first, words)
            high = self._coordinate(last, words) if dash else low
            if high < low:
                raise self._error(f"'{words}': {low}-{high} runs backwards; write {high}-{low}")
            for number in range(low, high + 1):
                if kind == "x":
                    yield Target("x", x=number, line=self._line)
                else:
                    yield Target("y", y=number, line=self._line)

    def _coordinate(self, text: str, words: str) -> int:
        if not _NUMBER.fullmatch(text) or int(text) > LAST:
            raise self._error(f"'{words}': '{text}' is not 0 to {LAST}; allowed: {_FORMS}")
        return int(text)

    def _byte(self, words: str) -> int:
        if not _HEX.fullmatch(words) or int(words, 16) > 0xFF:
            raise self._error(f"'{words}' is no hex byte; allowed: 0x00 to 0xff, one per line")
        assert self._data is not None
        if len(self._data) == MOST_BYTES:
            raise self._error(f"more than {MOST_BYTES} bytes; a module has no room for them")
        return int(words, 16)

    def _error(self, what: str, line: int | None = None) -> InputError:
        return InputError(f"{self._source}:{line or self._line}: {what}")


def _block_text(block: Block) -> str:
    lines = ["address", *_address_lines(block.targets), "", "data"]
    lines += [f"0x{byte:02x}" for byte in block.data]
    return "\n".join(lines) + "\n"


def _address_lines(targets: Sequence[Target]) -> Iterator[str]:
    """A line for neighbours of one kind, in their order."""
    at = 0
    while at < len(targets):
        kind = targets[at].kind
        end = at
        while end < len(targets) and targets[end].kind == kind:
            end += 1
        same = targets[at:end]
        if kind == "module":
            yield "module:" + ",".join(f"{target.x}-{target.y}" for target in same)
        else:
            yield f"{kind}:" + ",".join(_ranges([getattr(target, kind) for target in same]))
        at = end


def _ranges(numbers: Sequence[int]) -> Iterator[str]:
    """3, 4, 5, 9 as 3-5 and 9."""
    first = last = numbers[0]
    for number in (*numbers[1:], None):
        if number == last + 1:
            last = last + 1
            continue
        yield str(first) if first == last else f"{first}-{last}"
        if number is not None:
            first = last = number


def _target_text(target: Target) -> str:
    return next(iter(_address_lines([target])))
