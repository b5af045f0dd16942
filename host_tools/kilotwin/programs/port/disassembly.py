"""A linked program as the robot runs it: functions, their calls, and the variables that they touch.

Read from `avr-objdump`, whose lines carry the source's file and line. A call by a function pointer
may go to any function whose address is taken.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import Symbol, SymbolTableSection

from kilotwin.programs.image.image import Image
from kilotwin.programs.image.image_size import size_of
from kilotwin.programs.native.guest import run_tool

_FUNCTION = re.compile(r"^([0-9a-f]{8}) <([^>]+)>:$")
_INSTRUCTION = re.compile(r"^ +([0-9a-f]+):\t(?:[0-9a-f]{2} )+\s*\t?(\S+)(?:\t([^;]*))?(?:;(.*))?$")
_PLACE = re.compile(r"^(/.*|[^\s:]+\.[chS]):(\d+)(?: \(discriminator \d+\))?$")
_TARGET = re.compile(r"0x([0-9a-f]+) <([^>+]+)(\+0x[0-9a-f]+)?>")
_DATA = re.compile(r"0x80([0-9a-f]{4})")
_RELOCATION = re.compile(r"R_AVR_(?:LO8_LDI|HI8_LDI|16)_?(?:GS|PM)\s+(\S+)")
_OBJECT_HEADING = re.compile(r"^.+:\s+file format elf32-avr$", re.MULTILINE)
_CALLS = {"call", "rcall"}
_JUMPS = {"jmp", "rjmp"}
_ENDS = _JUMPS | {"ret", "reti", "ijmp"}
_SKIPS = {"cpse", "sbrc", "sbrs", "sbic", "sbis"}
_SREG = "0x3f,"
_NO_BSS = 0x10000
_DATA_BASE = 0x800000
_RESET = "__vectors"  # a jump to address 0 begins anew
# A program that uses one of these may have streams of its own.
_STREAMS = {"__iob", "fdevopen", "fprintf", "vfprintf", "fputc", "fputs", "fwrite"}


@dataclass(frozen=True)
class Place:
    """Where in the source."""

    file: str
    line: int


@dataclass(frozen=True)
class Instruction:
    """One of a function; `place` None where the compiler gives no line (libgcc)."""

    address: int
    name: str
    operands: str
    comment: str
    place: Place | None

    @cached_property
    def data_address(self) -> int | None:
        """Address that `lds` or `sts` reads or writes, in the data space."""
        found = _DATA.search(self.comment) if self.name in ("lds", "sts") else None
        return int(found[1], 16) if found else None

    @cached_property
    def target(self) -> tuple[int, str, bool] | None:
        """Target of a call or jump: address, symbol, and whether it is the symbol's own address."""
        found = _TARGET.search(self.comment)
        return (int(found[1], 16), found[2], found[3] is None) if found else None

    @property
    def ends(self) -> bool:
        """Whether the next one is never executed behind it, unless something jumps there."""
        return self.name in _ENDS

    @property
    def skips(self) -> bool:
        """Whether it may skip the next one."""
        return self.name in _SKIPS


@dataclass
class Function:
    """Under its name; static functions of several files may have one: `entries` has them all."""

    name: str
    instructions: list[Instruction] = field(default_factory=list)
    entries: list[int] = field(default_factory=list)

    @property
    def calls(self) -> list[tuple[Instruction, str]]:
        """Calls, and jumps into another function (tail calls)."""
        found = []
        for instruction in self.instructions:
            target = instruction.target
            if target is None or target[1] == _RESET or not target[2]:
                continue
            itself = target[1] == self.name
            if instruction.name in _CALLS:
                # The C library's own code has places of a name that it calls, and it ends.
                counts = not itself or instruction.place is not None
            else:
                counts = instruction.name in _JUMPS and not itself
            if counts:
                found.append((instruction, target[1]))
        return found

    @cached_property
    def uninterrupted(self) -> set[int]:
        """Addresses of instructions before which, on every way there, interrupts were switched off.

        A `cli` holds until a `sei`, or until SREG is as it was. Where a function has a frame the
        compiler has both around a write to the stack pointer, and nothing else.
        """
        code = self.instructions
        if not any(instruction.name == "cli" for instruction in code):
            return set()
        place = {instruction.address: index for index, instruction in enumerate(code)}
        known = {after for index in range(len(code)) for after in self._following(index, place)}
        off = [index > 0 and index in known for index in range(len(code))]
        changed = True
        while changed:
            changed = False
            for index, instruction in enumerate(code):
                after = self._off_after(instruction, before=off[index])
                for following in self._following(index, place):
                    if off[following] and not after:
                        off[following], changed = False, True
        return {
            instruction.address for instruction, is_off in zip(code, off, strict=True) if is_off
        }

    @staticmethod
    def _off_after(instruction: Instruction, *, before: bool) -> bool:
        if instruction.name == "cli":
            return True
        restores = instruction.name == "out" and instruction.operands.startswith(_SREG)
        return before and not restores and instruction.name != "sei"

    def _following(self, index: int, place: dict[int, int]) -> list[int]:
        instruction = self.instructions[index]
        following = [] if instruction.ends else [index + 1]
        if instruction.skips:
            following.append(index + 2)
        if instruction.target is not None and instruction.name not in _CALLS:
            following.append(place.get(instruction.target[0], len(self.instructions)))
        return [other for other in following if other < len(self.instructions)]


@dataclass(frozen=True)
class Located:
    """An instruction, the function it is in, that one's entry, and the address behind."""

    instruction: Instruction
    function: str
    start: int
    next: int


@dataclass(frozen=True)
class Variable:
    """A symbol in RAM."""

    name: str
    address: int
    size: int


@dataclass(frozen=True)
class Disassembly:
    """The whole program."""

    functions: dict[str, Function]
    variables: dict[int, Variable]
    """By address: static variables of several files may have one name."""
    flash_bytes: int
    ram_bytes: int
    address_taken: frozenset[str]
    """Functions of the program that a pointer may lead to."""
    runtime_callbacks: frozenset[str]
    """Functions that interrupts call until the program sets a callback of its own."""
    stream_functions: frozenset[str]
    """Functions that fputc() may call, the program's and the runtime's."""
    bss_begin: int = 0
    """From this address on variables are 0 at the start; beyond all if none are."""

    @staticmethod
    def of(image: Image) -> "Disassembly":
        """Reads the image's ELF and objects."""
        text = run_tool(["avr-objdump", "-d", "-l", str(image.elf)], f"{image.elf}: not readable")
        with image.elf.open("rb") as file:
            elf = ELFFile(file)
            variables = {
                symbol["st_value"] - _DATA_BASE: Variable(
                    symbol.name, symbol["st_value"] - _DATA_BASE, symbol["st_size"]
                )
                for symbol in _symbols(elf)
                if symbol["st_info"]["type"] == "STT_OBJECT" and symbol["st_value"] >= _DATA_BASE
            }
            begins = [
                symbol["st_value"] - _DATA_BASE
                for symbol in _symbols(elf)
                if symbol.name == "__bss_start"
            ]
        size = size_of(image.elf)
        program = _read_objects(image.objects("program"))
        runtime = _read_objects(image.objects("kilolib"))
        return Disassembly(
            parse(text),
            variables,
            size.flash,
            size.ram,
            _address_taken(program),
            _address_taken(file for file in runtime if not file.uses_streams),
            _address_taken(file for file in [*program, *runtime] if file.uses_streams),
            begins[0] if begins else _NO_BSS,
        )

    @cached_property
    def code(self) -> dict[int, Located]:
        """All instructions by address, in order."""
        found: dict[int, Located] = {}
        for function in self.functions.values():
            for instruction in function.instructions:
                start = max(entry for entry in function.entries if entry <= instruction.address)
                found[instruction.address] = Located(instruction, function.name, start, 0)
        order = sorted(found)
        behind = {address: order[index + 1] for index, address in enumerate(order[:-1])}
        return {
            address: replace(found[address], next=behind.get(address, address + 2))
            for address in order
        }

    def reached_from(self, roots: Iterable[str]) -> set[str]:
        """All functions that may run when these do, but for those called by address."""
        found: set[str] = set()
        waiting = [root for root in roots if root in self.functions]
        while waiting:
            name = waiting.pop()
            if name in found:
                continue
            found.add(name)
            callees = [callee for _, callee in self.functions[name].calls]
            waiting += [callee for callee in callees if callee in self.functions]
        return found

    def at(self, address: int) -> tuple[str, Place | None]:
        """The function with the instruction at `address`, and where that is in the source."""
        for function in self.functions.values():
            for instruction in function.instructions:
                if instruction.address == address:
                    return function.name, instruction.place
        return "?", None

    def variable_at(self, address: int) -> Variable | None:
        """The variable that holds this byte."""
        for variable in self.variables.values():
            if variable.address <= address < variable.address + max(variable.size, 1):
                return variable
        return None


def parse(text: str) -> dict[str, Function]:
    """The functions in what `avr-objdump -d -l` prints."""
    functions: dict[str, Function] = {}
    function: Function | None = None
    place: Place | None = None
    for line in text.splitlines():
        if found := _FUNCTION.match(line):
            function = functions.setdefault(found[2], Function(found[2]))
            function.entries.append(int(found[1], 16))
            place = None
        elif found := _PLACE.match(line):
            place = Place(found[1], int(found[2]))
        elif (found := _INSTRUCTION.match(line)) and function is not None:
            function.instructions.append(
                Instruction(
                    int(found[1], 16),
                    found[2],
                    (found[3] or "").strip(),
                    (found[4] or "").strip(),
                    place,
                )
            )
    return functions


def _symbols(elf: ELFFile) -> Iterable[Symbol]:
    table = elf.get_section_by_name(".symtab")
    assert isinstance(table, SymbolTableSection)
    return table.iter_symbols()


@dataclass(frozen=True)
class _ObjectFile:
    uses_streams: bool
    address_taken: frozenset[str]
    """Functions that a pointer may lead to: the linker leaves no trace of them."""


def _read_objects(files: Sequence[Path]) -> list[_ObjectFile]:
    listing = run_tool(["avr-objdump", "-r", *map(str, files)], f"{files[0].parent}: not readable")
    parts = _OBJECT_HEADING.split(listing)[1:]
    return [_read_object(file, part) for file, part in zip(files, parts, strict=True)]


def _read_object(file: Path, relocations: str) -> _ObjectFile:
    with file.open("rb") as stream:
        elf = ELFFile(stream)
        symbols = list(_symbols(elf))
        functions = {
            (elf.get_section(symbol["st_shndx"]).name, symbol["st_value"]): symbol.name
            for symbol in symbols
            if symbol["st_info"]["type"] == "STT_FUNC" and symbol["st_shndx"] != "SHN_UNDEF"
        }
    taken = set()
    for meant in _RELOCATION.findall(relocations):
        section, _, offset = meant.partition("+")
        taken.add(functions.get((section, int(offset or "0", 16)), section))
    return _ObjectFile(any(symbol.name in _STREAMS for symbol in symbols), frozenset(taken))


def _address_taken(objects: Iterable[_ObjectFile]) -> frozenset[str]:
    return frozenset().union(*(file.address_taken for file in objects))
