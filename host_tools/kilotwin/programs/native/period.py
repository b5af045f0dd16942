"""Whether a robot's program can change kilo_tx_period after its set-up.

Told from objects that are made for this alone: not optimised, with a section for each function, so
that each use of a name is one relocation. Where it is not certain the answer is that it can.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

# The compiler's, besides the program's own. Addresses are plain numbers without -fPIC.
FLAGS = ["-O0", "-fno-pic", "-fno-pie", "-ffunction-sections", "-fno-jump-tables"]
PERIOD = "kilo_tx_period"
_MAIN, _START = "kt_guest_main", "kilo_start"

_SECTION = re.compile(r"(?:Disassembly of section |RELOCATION RECORDS FOR \[)([^\]:]+)\]?:")
_CODE = re.compile(r"^\s*[0-9a-f]+:\t([^#\t]*)")
_USE = re.compile(r"\t[0-9a-f]+: (?P<kind>R_\S+)\t(?P<name>\S+)")
_FURTHER_USE = re.compile(r"\n\t+(?=[0-9a-f]+: R_)")  # of the instruction before, on its own line
_RECORD = re.compile(r"^[0-9a-f]+ (?P<kind>R_\S+)\s+(?P<name>\S+)")
_PLACE = re.compile(r"[-+]0x[0-9a-f]+$")
_FIRST_ARGUMENT = re.compile(r"mov(abs)?\s+\$0x0,%[er]di")
# In place of its address the operand is a number, without `$` where memory is meant.
_IN_MEMORY = re.compile(r"(\s|,)0x0(,|$)")


@dataclass
class _Program:
    """Uses of names. Names of all files are taken together: that may add uses, and loses none."""

    functions: set[str] = field(default_factory=set)
    callers: defaultdict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    takers: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    changes: set[str] = field(default_factory=set)  # functions that use the period
    set_up: set[str] = field(default_factory=set)  # first arguments of kilo_start() in main()
    clear: bool = True  # nothing was found that cannot be judged


def functions_of(symbols: str) -> set[str]:
    """The functions that objects define, of what `nm -P` prints of them."""
    lines = [line.split() for line in symbols.splitlines()]
    return {words[0] for words in lines if len(words) > 1 and words[1] in "TtWwi"} - {""}


def is_settled(code: str, data: str, functions: set[str], missing: set[str]) -> bool:
    """Whether the period stays as it is once set-up is over.

    `code` and `data` are what `objdump -drw --no-show-raw-insn` and `objdump -rw` print of all
    objects, `functions` what they define, and `missing` what they want from others, but for what
    is known to have nothing to do with the period.
    """
    program = _Program()
    for section, _ in _by_section(code):
        if section.startswith(".text."):
            program.functions.add(section.removeprefix(".text."))
    if missing or functions - program.functions:
        return False
    _read_code(program, code)
    _read_data(program, data)
    changing = _with_callers(program)
    begins_once = not program.takers[_MAIN] and not program.callers[_MAIN]
    return (
        program.clear
        and begins_once
        and bool(program.changes)
        and all(_is_only_set_up(program, name) for name in changing - {_MAIN})
    )


def _is_only_set_up(program: _Program, name: str) -> bool:
    """Whether nothing has the address of a function but kilo_start(), as what sets up."""
    takers = program.takers[name]
    return not takers or (name in program.set_up and takers == [_MAIN])


def _by_section(text: str) -> Iterator[tuple[str, str]]:
    section = ""
    for line in text.splitlines():
        heading = _SECTION.match(line)
        if heading:
            section = heading[1]
        yield section, line


def _read_code(program: _Program, code: str) -> None:
    waiting = None  # what main() has as the first argument of its next call
    for section, line in _by_section(_FURTHER_USE.sub("\t", code)):
        instruction = _CODE.match(line)
        if instruction is None or not section.startswith(".text"):
            continue
        within, words = section.removeprefix(".text."), instruction[1].strip()
        uses = [(use["kind"], _name(use["name"])) for use in _USE.finditer(line)]
        for kind, name in uses:
            if name == PERIOD:
                program.changes.add(within)
                program.clear &= len(uses) == 1 and _is_access(words, kind)
            elif words.startswith(("call", "j")):
                program.callers[name].add(within)
                if within == _MAIN:
                    if name == _START and waiting is not None:
                        program.set_up.add(waiting)
                    waiting = None
            elif name in program.functions:
                program.takers[name].append(within)
                if within == _MAIN and _FIRST_ARGUMENT.match(words):
                    waiting = name


def _name(used: str) -> str:
    """The name without section and offset."""
    return _PLACE.sub("", used).removeprefix(".text.")


def _is_access(instruction: str, kind: str) -> bool:
    """Whether the instruction reads or writes the variable; else it may hand out its address."""
    if kind == "R_X86_64_PC32":
        return not instruction.startswith("lea")
    return kind == "R_X86_64_32S" and _IN_MEMORY.search(instruction) is not None


def _read_data(program: _Program, data: str) -> None:
    for section, line in _by_section(data):
        record = _RECORD.match(line)
        if record is None or section.startswith((".text", ".eh_frame", ".debug")):
            continue
        name = _name(record["name"])
        program.clear &= name != PERIOD
        program.takers[name].append(section)


def _with_callers(program: _Program) -> set[str]:
    """The functions that use the period, and all that call them, and so on."""
    found, new = set(program.changes), set(program.changes)
    while new:
        new = {caller for name in new for caller in program.callers[name]} - found
        found |= new
    return found
