"""Calls in a built program: which function an address lies in, and what a call there calls.

For an x86-64, on which guests run, and for the robots' ATmega328P.
"""

from bisect import bisect_right
from dataclasses import dataclass

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

# The begin of what gcc has put elsewhere since it rarely runs, by the name of the function.
_COLD = ".cold"
_X86_CALL = 0xE8
_AVR_ICALL, _AVR_RCALL, _AVR_CALL = 0x9509, 0xD, 0x940E
_AVR_REACH = 1 << 12  # of rcall, words


@dataclass(frozen=True)
class _Function:
    begin: int
    end: int
    entry: int


class Calls:
    """Functions and code of an ELF file."""

    def __init__(self, elf: ELFFile) -> None:
        """ValueError if it has no code or no symbols."""
        code, symbols = elf.get_section_by_name(".text"), elf.get_section_by_name(".symtab")
        if code is None or not isinstance(symbols, SymbolTableSection):
            raise ValueError("no code, or no symbols")
        self._begin, self._code = int(code["sh_addr"]), code.data()
        self._avr = elf["e_machine"] == "EM_AVR"
        entries, found = {}, []
        for symbol in symbols.iter_symbols():
            if symbol["st_info"]["type"] == "STT_FUNC" and symbol["st_size"]:
                entries[symbol.name] = int(symbol["st_value"])
                found.append((int(symbol["st_value"]), int(symbol["st_size"]), symbol.name))
        self._functions = [
            _Function(begin, begin + size, entries.get(name.removesuffix(_COLD), begin))
            for begin, size, name in sorted(found)
        ]
        self._begins = [function.begin for function in self._functions]

    def entry_of(self, address: int) -> int | None:
        """The begin of the function that an address lies in; None if it lies in none."""
        index = bisect_right(self._begins, address) - 1
        if index < 0 or address >= self._functions[index].end:
            return None
        return self._functions[index].entry

    def leads_to(self, call: int, entry: int | None) -> bool:
        """Whether the call of which `call` is in the last bytes can be one of the function that
        begins at `entry`; of None, of code that no symbol belongs to."""
        known, target = self._avr_target(call) if self._avr else self._x86_target(call)
        if not known:
            return True
        return target == entry if entry is not None else self.entry_of(target) is None

    def _x86_target(self, call: int) -> tuple[bool, int]:
        """Whether it names its target, and that."""
        end = call + 1 - self._begin
        if end < 5 or self._code[end - 5] != _X86_CALL:
            return False, 0
        way = int.from_bytes(self._code[end - 4 : end], "little", signed=True)
        return True, call + 1 + way

    def _avr_target(self, call: int) -> tuple[bool, int]:
        word = self._word(call)
        if word == _AVR_ICALL:
            return False, 0
        if self._word(call - 2) & 0xFE0E == _AVR_CALL:
            return True, 2 * word
        words = word & (_AVR_REACH - 1)
        way = words - _AVR_REACH if words >= _AVR_REACH // 2 else words
        return word >> 12 == _AVR_RCALL, call + 2 + 2 * way

    def _word(self, address: int) -> int:
        at = address - self._begin
        return int.from_bytes(self._code[at : at + 2], "little") if at >= 0 else 0
