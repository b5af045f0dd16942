"""Symbols and debug information of a built guest: its size, and where its variables are. Of a
robot that runs translated these are in its image's .elf, and its state is the chip's data space.

For size reports, for tests that look into a program, and for metrics that are a variable. Nothing
else looks: no result of a run depends on it.
"""

import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elftools.dwarf.compileunit import CompileUnit
from elftools.dwarf.die import DIE
from elftools.dwarf.dwarfinfo import DWARFInfo
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from kilotwin.errors import InputError
from kilotwin.files import resources

_OP_ADDR, _OP_ADDRX, _OP_PLUS = 0x03, 0xA1, 0x23
_WRAPPERS = {
    "DW_TAG_typedef",
    "DW_TAG_const_type",
    "DW_TAG_volatile_type",
    "DW_TAG_restrict_type",
    "DW_TAG_atomic_type",
}
_STRUCTURES = ("DW_TAG_structure_type", "DW_TAG_union_type")
_BOOLEAN, _FLOAT, _SIGNED = 0x02, 0x04, {0x05, 0x06, 0x0D}
# The thin half of the mock API, which is part of every guest, and the runtime of an image.
_OURS = {
    file.name
    for folder in ("emulator/robots/native/side", "firmware/kilolib/core", "firmware/kilolib/avr")
    for file in resources.path(folder).glob("*.c")
}
_AVR_DATA = 0x800000  # data space of an ATmega328P, as avr-gcc numbers it; SRAM is 0x100 to 0x900
_FLOAT_FORMATS = {4: "<f", 8: "<d"}
# "hops", "file.c:hops", "me.hops", "table[2]".
_PLACE = re.compile(r"(?P<name>(?:[^:\[\]]+:)?\w+)(?P<steps>(?:\.\w+|\[\d+\])*)")


@dataclass(frozen=True)
class NumberPlace:
    """Where a number lies in a robot's state."""

    offset: int
    length: int
    encoding: int

    def read(self, state: bytes) -> float:
        """Its value in a robot's state."""
        return float(_decoded(state[self.offset : self.offset + self.length], self.encoding))


@dataclass(frozen=True)
class GuestSize:
    """Bytes. The robot's own are in its .hex, see `make firmware`; these are the PC's."""

    state: int
    text: int


@dataclass(frozen=True)
class _Variable:
    name: str
    source: str
    function: str  # empty: of the whole file
    offset: int
    kind: DIE


class GuestSymbols:
    """A guest's shared object, read once."""

    def __init__(self, file: Path) -> None:
        """Reads all symbols and variables; the file is not needed afterwards."""
        self._file = file
        with file.open("rb") as stream:
            elf = ELFFile(stream)
            table, code = elf.get_section_by_name(".symtab"), elf.get_section_by_name(".text")
            assert isinstance(table, SymbolTableSection)
            assert code is not None
            self._base, self._begin, self._end = _AVR_DATA, _AVR_DATA + 0x100, _AVR_DATA + 0x900
            if elf["e_machine"] != "EM_AVR":
                symbols = {symbol.name: int(symbol["st_value"]) for symbol in table.iter_symbols()}
                self._base = self._begin = symbols["kt_state_begin"]
                self._end = symbols["kt_state_end"]
            self.size = GuestSize(self._end - self._begin, int(code["sh_size"]))

    def read(self, state: bytes, name: str) -> Any:
        """The value of a global or static variable in a robot's state.

        `name` is the variable's; where several have it, `file.c:name` or `function:name` tells them
        apart. Structures are dicts, arrays lists, pointers and enums numbers. InputError says what
        there is.
        """
        with self._file.open("rb") as stream:
            found = self._find(ELFFile(stream).get_dwarf_info(), name)
            return _value(found.kind, state, found.offset)

    def extents(self) -> list[tuple[int, int]]:
        """Where the program's own variables lie in a robot's state: from, and to before."""
        with self._file.open("rb") as stream:
            dwarf = ELFFile(stream).get_dwarf_info()
            found = [
                (one.offset, one.offset + _bytes_of(kind))
                for one in self._variables(dwarf, None)
                if one.source not in _OURS and (kind := _type_of(one.kind)) is not None
            ]
        return sorted(set(found))

    def number(self, name: str) -> NumberPlace:
        """Where a number is, so that it is read fast: a variable, or what is in one.

        Beside the names of read(): "me.hops" of a structure, "table[2]" of an array. InputError if
        it is not there, or no number.
        """
        matched = _PLACE.fullmatch(name)
        if matched is None:
            what = 'write a name, as "hops", "file.c:hops", "me.hops" or "table[2]"'
            raise InputError(f"'{name}' names no variable; {what}")
        steps = re.findall(r"\w+", matched["steps"])
        with self._file.open("rb") as stream:
            found = self._find(ELFFile(stream).get_dwarf_info(), matched["name"])
            owner, offset = found.kind, found.offset
            lengths: list[int] | None = None
            for step in steps:
                owner, offset, lengths = _within(owner, offset, lengths, step, name)
            kind = _element_type(owner) if lengths == [] else _type_of(owner)
            if kind is None or kind.tag in (*_STRUCTURES, "DW_TAG_array_type"):
                raise InputError(f"'{name}' is no number{_contents(kind)}")
            return NumberPlace(offset, _bytes_of(kind), _encoding(kind))

    def _find(self, dwarf: DWARFInfo, name: str) -> _Variable:
        """The one variable with that name."""
        where, _, plain = name.rpartition(":")
        found = [
            variable
            for variable in self._variables(dwarf, plain)
            if where in ("", variable.source, variable.function)
        ]
        if len({variable.offset for variable in found}) != 1:
            raise InputError(self._complaint(dwarf, name, found))
        return found[0]

    def _complaint(self, dwarf: DWARFInfo, name: str, found: list[_Variable]) -> str:
        if found:
            places = ", ".join(f"{v.function or v.source}:{v.name}" for v in found)
            return f"{self._file.stem} has several variables '{name}'; name one of: {places}"
        names = sorted({v.name for v in self._variables(dwarf, None) if v.source not in _OURS})
        shown = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
        return f"{self._file.stem} has no variable '{name}'; it has: {shown}"

    def _variables(self, dwarf: DWARFInfo, name: str | None) -> Iterator[_Variable]:
        """Those of the program that lie in its state."""
        for unit in dwarf.iter_CUs():
            top = unit.get_top_DIE()
            source = Path(_text(top, "DW_AT_name")).name
            for die, function in _dies(top, ""):
                if die.tag != "DW_TAG_variable" or "DW_AT_location" not in die.attributes:
                    continue
                declared = _declaration(die)
                own_name = _text(declared, "DW_AT_name")
                if name not in (None, own_name):
                    continue
                address = _address(dwarf, unit, die.attributes["DW_AT_location"].value)
                if address is None or not self._begin <= address < self._end:
                    continue
                offset = address - self._base
                yield _Variable(own_name, source, function, offset, declared)


def _dies(die: DIE, function: str) -> Iterator[tuple[DIE, str]]:
    for child in die.iter_children():
        yield child, function
        if child.tag in ("DW_TAG_subprogram", "DW_TAG_lexical_block"):
            name = _text(_declaration(child), "DW_AT_name") or function
            yield from _dies(child, name)


def _declaration(die: DIE) -> DIE:
    """Where the name and the type stand."""
    for link in ("DW_AT_specification", "DW_AT_abstract_origin"):
        if link in die.attributes:
            return _declaration(die.get_DIE_from_attribute(link))
    return die


def _text(die: DIE, attribute: str) -> str:
    if attribute not in die.attributes:
        return ""
    return str(die.attributes[attribute].value.decode(errors="replace"))


def _address(dwarf: DWARFInfo, unit: CompileUnit, location: Any) -> int | None:
    """The address that a location expression stands for, if it is as plain as that."""
    if not isinstance(location, list) or not location:
        return None
    if location[0] == _OP_ADDR:
        return int.from_bytes(bytes(location[1:9]), "little")
    if location[0] == _OP_ADDRX:
        return int(dwarf.get_addr(unit, _leb128(location[1:])))
    return None


def _type_of(die: DIE) -> DIE | None:
    """Its type, without typedef and qualifiers; None for void."""
    while "DW_AT_type" in die.attributes:
        die = die.get_DIE_from_attribute("DW_AT_type")
        if die.tag not in _WRAPPERS:
            return die
    return None


def _value(owner: DIE, state: bytes, offset: int) -> Any:
    kind = _type_of(owner)
    if kind is None:
        return None
    if kind.tag == "DW_TAG_array_type":
        return _array(kind, state, offset, _lengths(kind))
    if kind.tag in _STRUCTURES:
        return {
            _text(member, "DW_AT_name"): _member(member, state, offset)
            for member in kind.iter_children()
            if member.tag == "DW_TAG_member"
        }
    return _number(kind, state[offset : offset + _bytes_of(kind)])


def _member(member: DIE, state: bytes, offset: int) -> Any:
    attributes = member.attributes
    if "DW_AT_bit_size" not in attributes:
        return _value(member, state, offset + _place_in(member))
    bits = attributes["DW_AT_bit_size"].value
    first = _first_bit(member)
    whole = int.from_bytes(state[offset : offset + (first + bits + 7) // 8], "little")
    value = whole >> first & (1 << bits) - 1
    kind = _type_of(member)
    signed = kind is not None and _encoding(kind) in _SIGNED
    return value - (1 << bits) if signed and value >> (bits - 1) else value


def _place_in(member: DIE) -> int:
    """Its offset in the structure: a number, or in older forms an expression that adds one."""
    if "DW_AT_data_member_location" not in member.attributes:
        return 0
    at = member.attributes["DW_AT_data_member_location"].value
    return int(at) if isinstance(at, int) else _leb128(at[1:]) if at[0] == _OP_PLUS else 0


def _leb128(encoded: Sequence[int]) -> int:
    number = 0
    for place, byte in enumerate(encoded):
        number |= (byte & 0x7F) << 7 * place
    return number


def _first_bit(member: DIE) -> int:
    """First bit of a bit field, from the structure's; some compilers count from a unit's end."""
    attributes = member.attributes
    if "DW_AT_bit_offset" not in attributes:
        return attributes["DW_AT_data_bit_offset"].value if _bit_counted(member) else 0
    kind = _type_of(member)
    assert kind is not None
    end = 8 * (_place_in(member) + _bytes_of(kind))
    return int(end - attributes["DW_AT_bit_offset"].value - attributes["DW_AT_bit_size"].value)


def _bit_counted(member: DIE) -> bool:
    return "DW_AT_data_bit_offset" in member.attributes


def _lengths(array: DIE) -> list[int]:
    lengths = []
    for part in array.iter_children():
        if part.tag != "DW_TAG_subrange_type":
            continue
        if "DW_AT_count" in part.attributes:
            lengths.append(int(part.attributes["DW_AT_count"].value))
        elif "DW_AT_upper_bound" in part.attributes:
            lengths.append(int(part.attributes["DW_AT_upper_bound"].value) + 1)
        else:
            lengths.append(0)
    return lengths


def _array(array: DIE, state: bytes, offset: int, lengths: list[int]) -> Any:
    if not lengths:
        return _value(array, state, offset)
    element = _type_of(array)
    assert element is not None
    step = _bytes_of(element)
    for length in lengths[1:]:
        step *= length
    return [_array(array, state, offset + i * step, lengths[1:]) for i in range(lengths[0])]


def _bytes_of(kind: DIE) -> int:
    if kind.tag == "DW_TAG_array_type":
        element = _type_of(kind)
        assert element is not None
        total = _bytes_of(element)
        for length in _lengths(kind):
            total *= length
        return total
    if "DW_AT_byte_size" in kind.attributes:
        return int(kind.attributes["DW_AT_byte_size"].value)
    return 8  # a pointer


def _encoding(kind: DIE) -> int:
    if kind.tag == "DW_TAG_enumeration_type" and "DW_AT_type" in kind.attributes:
        inner = _type_of(kind)
        return 0 if inner is None else _encoding(inner)
    return int(kind.attributes["DW_AT_encoding"].value) if _encoded(kind) else 0


def _encoded(kind: DIE) -> bool:
    return "DW_AT_encoding" in kind.attributes


def _element_type(owner: DIE) -> DIE | None:
    """The type of an array's elements."""
    array = _type_of(owner)
    return None if array is None else _type_of(array)


def _within(
    owner: DIE, offset: int, lengths: list[int] | None, step: str, name: str
) -> tuple[DIE, int, list[int] | None]:
    """The type that a member's name or an index leads to; `lengths` of an array still open."""
    kind = _element_type(owner) if lengths == [] else _type_of(owner)
    if lengths == []:
        lengths = None
    if kind is not None and kind.tag in _STRUCTURES and lengths is None:
        for member in kind.iter_children():
            if member.tag == "DW_TAG_member" and _text(member, "DW_AT_name") == step:
                if "DW_AT_bit_size" in member.attributes:
                    raise InputError(f"'{name}' is a bit field, which is not read")
                return member, offset + _place_in(member), None
    elif kind is not None and kind.tag == "DW_TAG_array_type" and step.isdigit():
        lengths = _lengths(kind) if lengths is None else lengths
        element = _type_of(kind)
        if element is not None and int(step) < lengths[0]:
            size = _bytes_of(element)
            for length in lengths[1:]:
                size *= length
            return owner, offset + int(step) * size, lengths[1:]
    raise InputError(f"'{name}': there is no '{step}'{_contents(kind)}")


def _contents(kind: DIE | None) -> str:
    """Members of a structure, indexes of an array, for messages."""
    if kind is not None and kind.tag in _STRUCTURES:
        members = [_text(part, "DW_AT_name") for part in kind.iter_children()]
        return f"; it has {', '.join(filter(None, members))}"
    if kind is not None and kind.tag == "DW_TAG_array_type":
        return f"; the array has {' x '.join(map(str, _lengths(kind)))} items"
    return ""


def _number(kind: DIE, raw: bytes) -> int | float | bool:
    return _decoded(raw, _encoding(kind))


def _decoded(raw: bytes, encoding: int) -> int | float | bool:
    if encoding == _FLOAT and len(raw) in _FLOAT_FORMATS:
        return float(struct.unpack(_FLOAT_FORMATS[len(raw)], raw)[0])
    number = int.from_bytes(raw, "little", signed=encoding in _SIGNED)
    return bool(number) if encoding == _BOOLEAN else number
