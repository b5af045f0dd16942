"""Machine code of an ATmega328P to C that does the same, cycle by cycle.

Code is found from the interrupt vectors on along jumps, calls, branches and skips; what is left of
the flash is read from its begin on, since code reached by pointers is there too (and tables,
which do no harm). It is cut into blocks, and may be entered where a block begins: where a direct
jump leads, behind a call, behind an end, and where a word of a table or a pair of `ldi` may point
to. The blocks from one called address to the next make a region, a function of C. Where the
translation cannot be entered the emulator interprets.

With a seam it is a guest's: a block begins at each access to a register, so that its effect comes
at its time; the begin of a function that is the engine's leaves the code, as do passes of the main
loop (emulator/robots/translated/code.h). What of its runtime hardly ever runs is left out
(seam.py).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from kilotwin.files.flash_map import FLASH_BYTES
from kilotwin.programs.translate.counters import Counter, find_counters
from kilotwin.programs.translate.instructions import Instruction, decode, is_long
from kilotwin.programs.translate.liveness import ALL_FLAGS, live_flags
from kilotwin.programs.translate.loops import divisor, turns_left_out
from kilotwin.programs.translate.registers import Function
from kilotwin.programs.translate.routines import NUMBERS, routine_at
from kilotwin.programs.translate.seam import Seam
from kilotwin.programs.translate.shared import tearing
from kilotwin.programs.translate.statements import (
    DATA_END,
    REGISTERS,
    SKIPS,
    condition,
    cycles,
    is_interpreted,
    is_often_interpreted,
    lets_interrupts,
    registers,
    statement,
)
from kilotwin.programs.variant import MARKED, Variant

_VECTORS, _VECTOR_BYTES = 26, 4
_SRAM_BEGIN = 0x100
_TICK_VECTOR = 14  # timer 0's compare match
_BOOT_SECTIONS = (0x7000, 0x7800, 0x7C00, 0x7E00)
_ERASED = b"\xff\xff"
_CALLS = {"call", "rcall"}
_JUMPS = {"jmp", "rjmp"}
_BRANCHES = {"brbs", "brbc"}
_NOWHERE = {"ret", "reti", "ijmp", "invalid"}
_LEAVES = {*_CALLS, *_JUMPS, "ret", "ijmp", "icall", *_BRANCHES, *SKIPS}
_MOST_OF_A_REGION = 400  # instructions; of a file, too: several are compiled at once
_MOST_OF_A_FILE = 1500
_MOST_OF_THE_PROGRAM = 6000  # instructions of the region that a guest mostly is in
_SCRATCH = (0, *range(18, 28), 30, 31)  # registers that a function may change (avr-gcc)
_HEAD = """\
#define TRANSLATED_CODE
#include "robots/translated/code.h"
"""
_GUEST_HEAD = "#define TRANSLATED_GUEST\n"
_STACK_HEAD = "#define VARIABLES_END {}\n"
_COUNTER_HEAD = "#define COUNTERS\n"
_WATCHED_HEAD = "#define TRANSLATED_WATCHED\n"
_MARKED_HEAD = "#define TRANSLATED_MARKED\n"
_COUNTED = """\
static const translated_counter_t counters[] = {{{counters}}};
static const translated_bound_t bounds[] = {{{bounds}}};
static const translated_counters_t counted = {{{count}, counters, {bounds_count}, bounds}};
"""
_COVERAGE = '__attribute__((visibility("default"))) uint8_t translation_coverage[COVERAGE_BYTES]'
_IN_PLACE = "".join(f"#define r{at} M[{at}]\n" for at in range(REGISTERS))
_TABLE = """\
{declarations}
static const translated_region_t code[] = {{{code}}};
static const uint16_t extent[][2] = {{{extent}}};
static const uint16_t region_of[] = {{{region_of}}};
static const uint8_t flash[] = {{{flash}}};
static const uint16_t eeprom[][2] = {{{eeprom}}};
{seam}
{counted}
__attribute__((visibility("default"))) const translation_t translation = {{
    TRANSLATION_VERSION, {count}, code, extent, region_of, flash, {eeprom_bytes}, eeprom,
    {met_at}}};
"""
_MAIN = "#define MAIN_REGION\n"
_REGION = """\
translated_end_t region_{number}(translated_chip_t *const chip) {{
ENTER
uint8_t value; (void)value;
{load}
DISPATCH
switch (pc) {{
{entries}
default: STOP(pc, 0, NOT_HERE);
}}
{blocks}
MAIN_REGION_ENDS({in_main}, {differing}, {note}, {scratch_differing}, {note_scratch})
out:
{store}
LEAVE
}}
"""


def translate(
    flash: bytes,
    eeprom: Mapping[int, int],
    seam: Seam | None = None,
    functions: Sequence[Function] = (),
    *,
    variant: Variant = "plain",
) -> list[str]:
    """C files for a whole image: flash, 32 KB as the chip has them, and the EEPROM's bytes by
    address that come with it; of a guest the seam, and its functions that are C.

    The same image gives the same text. Costs some tenths of a second.
    """
    code = _Code(flash, seam, variant)
    if seam is not None:
        code.counters = find_counters(
            code.instructions,
            code.skipped_to,
            variables=seam.variables,
            functions=functions,
            pointed=code.pointed,
            live_flags=code.live,
        )
    regions = code.regions()
    variables_end = _SRAM_BEGIN if seam is None else max(seam.variables_end, _SRAM_BEGIN)
    head = _STACK_HEAD.format(variables_end) + _HEAD
    if seam is not None:
        head = _GUEST_HEAD + head
    if code.counters:
        head = _COUNTER_HEAD + head
    if variant in ("watched", "debugged"):
        head = _WATCHED_HEAD + head
    if variant in MARKED:
        head = f"{_MARKED_HEAD}{head}extern {_COVERAGE};\n"
    if variant == "debugged":
        head += _IN_PLACE
    files: list[str] = []
    room = 0
    for number, region in enumerate(regions):
        size = sum(map(len, region))
        if seam is not None and number == 0:
            files.append(_MAIN + head + _counted(code.counters))
        elif size > room:
            files.append(head)
            room = _MOST_OF_A_FILE
        files[-1] += _region_text(number, region, code)
        room -= size
    marks = f"{_COVERAGE};\n" if variant in MARKED else ""
    return [*files, head + marks + _table(regions, code, eeprom)]


@dataclass(frozen=True)
class Block:
    """Instructions that run one after the other, from byte address `begin` to before `end`.

    `branch` is the last one's address, if it may go two ways; `jump`, if it always goes elsewhere.
    """

    begin: int
    end: int
    branch: int | None
    jump: int | None


def blocks_of(flash: bytes, seam: Seam) -> list[Block]:
    """The blocks of a guest's translation, in order of addresses."""
    blocks = [block for region in _Code(flash, seam).regions() for block in region]
    return sorted((_extent(block) for block in blocks), key=lambda block: block.begin)


def _extent(block: "_Block") -> Block:
    last = block[-1]
    branch = last.address if last.name in _BRANCHES | SKIPS.keys() else None
    jump = last.address if last.name in _JUMPS else None
    return Block(block[0].address, last.end, branch, jump)


def _counted(counters: Sequence[Counter]) -> str:
    """Counters and bounds, as passes that repeat need them."""
    if not counters:
        return ""
    bounds = [
        f"{{{number}, {bits}, {at}u}}"
        for number, counter in enumerate(counters)
        for bits, at in counter.bounds
    ]
    places = (f"{{{counter.address}, {counter.bytes}}}" for counter in counters)
    return _COUNTED.format(
        counters=", ".join(places),
        count=len(counters),
        bounds=", ".join(bounds) or "{0, 1, 0}",
        bounds_count=len(bounds),
    )


def _is_counted(counters: Sequence[Counter]) -> str:
    """By address of data space, whether a byte is a counter's."""
    own = {one.address + byte for one in counters for byte in range(one.bytes)}
    return ", ".join("NOT_COUNTED" if at in own else "0" for at in range(DATA_END))


def _table(regions: "list[_Region]", code: "_Code", eeprom: Mapping[int, int]) -> str:
    region_of = [0] * (FLASH_BYTES // 2)
    for number, region in enumerate(regions, 1):
        for block in region:
            region_of[block[0].address // 2] = number
    names = [f"region_{number}" for number in range(len(regions))]
    extent = (f"{{{region[0][0].address}, {region[-1][-1].end}}}" for region in regions)
    return _TABLE.format(
        declarations="\n".join(f"translated_end_t {name}(translated_chip_t *);" for name in names),
        code=", ".join(names),
        extent=", ".join(extent),
        region_of=", ".join(map(str, region_of)),
        flash=", ".join(map(str, code.flash)),
        eeprom=", ".join(f"{{{address}, {byte}}}" for address, byte in sorted(eeprom.items())),
        eeprom_bytes=len(eeprom),
        count=len(regions),
        seam=f"static const translated_seam_t seam = {code.seam.text()};" if code.seam else "",
        counted=f"const uint8_t is_counted[] = {{{_is_counted(code.counters)}}};"
        if code.counters
        else "",
        met_at="&seam" if code.seam else "0",
    )


_Block = list[Instruction]
_Region = list[_Block]


@dataclass
class _Code:
    """Code found in a flash."""

    flash: bytes
    seam: Seam | None
    variant: Variant = "plain"
    instructions: dict[int, Instruction] = field(default_factory=dict)
    """By address; they do not overlap."""
    entries: set[int] = field(default_factory=set)
    """Addresses at which blocks begin."""
    called: set[int] = field(default_factory=set)
    """Those at which functions begin."""
    counters: list[Counter] = field(default_factory=list)
    pointed: set[int] = field(default_factory=set)
    """Those that a pointer may lead to."""
    live: dict[int, int] = field(default_factory=dict)
    """Flags that are set by an instruction, by its address, if not all are: a chip's interpreter
    may go on behind any of them."""
    _owners: dict[int, int] = field(default_factory=dict)
    """By word address, the instruction that the word belongs to."""

    def __post_init__(self) -> None:
        sections = [0, *(begin for begin in _BOOT_SECTIONS if self._is_programmed(begin))]
        for begin in sections:
            for vector in range(_VECTORS):
                self._follow(begin + vector * _VECTOR_BYTES)
        reached = set(self.instructions)
        self._sweep()
        self._take_pointers(reached)
        self.entries &= set(self.instructions)
        self.called &= set(self.instructions)
        if self.seam is not None:
            start = self.seam.main_loop[0]
            callable_ = self.pointed & set(self.seam.functions)
            objects = self.seam.objects
            self.entries |= tearing(self.instructions, self.skipped_to, start, callable_, objects)
            self.live = live_flags(self.instructions, self.skipped_to)

    def _is_programmed(self, address: int) -> bool:
        return self.flash[address : address + 2] not in (_ERASED, b"")

    def _follow(self, begin: int) -> None:
        """Finds code from an entry on."""
        self.called.add(begin)
        open_ends = [begin]
        while open_ends:
            at = open_ends.pop()
            self.entries.add(at)
            while at not in self.instructions and self._take(at):
                instruction = self.instructions[at]
                open_ends += self._entries_from(instruction)
                if instruction.name in (_NOWHERE | _JUMPS):
                    break
                at = instruction.end

    def _take(self, at: int) -> bool:
        """Adds the instruction at an address, if there is one and its words are free."""
        if at + 2 > FLASH_BYTES or not self._is_programmed(at):
            return False
        instruction = decode(self.flash, at)
        words = range(at // 2, instruction.end // 2)
        if instruction.end > FLASH_BYTES or any(word in self._owners for word in words):
            return False
        self.instructions[at] = instruction
        self._owners.update(dict.fromkeys(words, at))
        return True

    def _entries_from(self, instruction: Instruction) -> list[int]:
        """Where an instruction leads to, but for the next one if it does nothing but go on."""
        name, end = instruction.name, instruction.end
        has_effect = is_often_interpreted(instruction)
        if has_effect and self.seam is not None:
            self.entries.add(instruction.address)
        entries = [end] if name in _LEAVES or has_effect else []
        if name in _CALLS | _JUMPS | _BRANCHES:
            entries.append(instruction.target)
        if name in _CALLS:
            self.called.add(instruction.target)
        if name in SKIPS:
            entries.append(self.skipped_to(instruction))
        self.entries.update(entries)
        return [] if name in _NOWHERE else entries[name in _JUMPS :]

    def skipped_to(self, skip: Instruction) -> int:
        """The address behind the instruction that it skips."""
        word = int.from_bytes(self.flash[skip.end : skip.end + 2].ljust(2, b"\xff"), "little")
        return skip.end + (4 if is_long(word) else 2)

    def engine_call(self, address: int) -> int | None:
        """The number of the engine's function that begins there."""
        calls = () if self.seam is None else self.seam.calls
        return calls.index(address) if address != 0 and address in calls else None

    def count(self, instruction: Instruction) -> Iterator[str]:
        """Notes before an instruction that has to do with counters."""
        place = 0
        for counter in self.counters:
            if instruction.address in counter.others:
                yield "changed |= NOT_COUNTED;"
            if instruction.address in counter.adds:
                yield f"COUNT({instruction.k}, {place + instruction.k - counter.address});"
            place += counter.bytes

    def ends_by(self, jump: Instruction) -> bool:
        """Whether a function may end by that jump, as avr-gcc has a call that comes last."""
        return jump.target in self.called

    def begins(self, instruction: Instruction, offset: int) -> list[str]:
        """Says so, `offset` cycles after its block's begin, of code that is debugged."""
        return (
            [f"INSTRUCTION(0x{instruction.address:x}, {offset})"]
            if self.variant == "debugged"
            else []
        )

    def routine(self, address: int, used: set[int]) -> str | None:
        """The statement that has the routine computed that begins there, or None; `used` are
        registers that are locals."""
        routine = routine_at(address, self.instructions, self.skipped_to)
        if routine is None:
            return None
        marked = any(not routine.addresses.isdisjoint(one.others) for one in self.counters)
        kept = sorted(used & routine.pushed)
        give = " ".join(f"M[{register}] = r{register};" for register in kept)
        names = [[f"r{at}" if at in used else f"M[{at}]" for at in group] for group in NUMBERS]
        for place, group in enumerate(names):
            give += f" chip->numbers[{place}] = NUMBER({', '.join((*group, '0', '0')[:4])});"
        take = " ".join(
            f"n_ = chip->numbers[{place}];"
            + " ".join(
                f"{name} = (uint8_t)(n_ >> {8 * byte});"
                for byte, name in enumerate(group)
                if name not in ("r1", "M[1]")
            )
            for place, group in enumerate(names)
        )
        sites = f"sites_0x{address:x}"
        return (
            f"{{ static const uint16_t {sites}[] = {{{', '.join(map(str, routine.sites))}}};\n"
            f"ROUTINE({routine.name}, {sites}, {'NOT_COUNTED' if marked else 0}, {give}, {take}) }}"
        )

    def waits(self, address: int) -> bool:
        """Whether it is one of delay(): time goes by there in loops alone."""
        begin, end = (0, 0) if self.seam is None else self.seam.delay
        return begin <= address < end

    def go(self, jump: Instruction, target: int, spent: int, inside: set[int]) -> str:
        """To a block, in this region or not, `spent` cycles after the begin of the one before."""
        if target not in inside:
            return f"STOP(0x{target:x}, {spent}, GO_ON);"
        if self.seam is not None and target <= jump.address:
            begin, end = self.seam.main_loop
            return f"{'PASS' if begin <= target < end else 'JUMP_BACK'}(0x{target:x}, {spent});"
        return f"left -= {spent}; goto block_0x{target:x};"

    def _sweep(self) -> None:
        """Reads what is left of the flash, as if it were code."""
        at = 0
        fresh = True
        while at < FLASH_BYTES:
            if at // 2 in self._owners:
                at, fresh = at + 2, True
            elif self._take(at):
                instruction = self.instructions[at]
                if fresh:
                    self.entries.add(at)
                fresh = False
                self._entries_from(instruction)
                at = instruction.end
            else:
                at, fresh = at + 2, True

    def _take_pointers(self, reached: set[int]) -> None:
        """Takes what tables, variables and pairs of ldi may point to for entries."""
        for at in range(0, FLASH_BYTES, 2):
            if self._owners.get(at // 2) not in reached:
                self.pointed.add(2 * int.from_bytes(self.flash[at : at + 2], "little"))
        for low in list(self.instructions.values()):
            high = self.instructions.get(low.end)
            if high and low.name == high.name == "ldi" and high.d == low.d + 1:
                self.pointed.add(2 * (low.k | high.k << 8))
        self.entries |= self.pointed

    def _blocks(self) -> Iterator[_Block]:
        extents = () if self.seam is None else self.seam.rare
        left_out = {at for begin, end in extents for at in range(begin, end)}
        block: _Block = []
        for at in sorted(self.instructions.keys() - left_out):
            if block and (at in self.entries or at != block[-1].end):
                yield block
                block = []
            block.append(self.instructions[at])
        if block:
            yield block

    def regions(self) -> list[_Region]:
        """All code; first what a guest is mostly in, as one: its program, the main loop, and what
        they call."""
        functions = list(self._functions())
        if self.seam is None:
            return functions
        place = {block[0].address: at for at, region in enumerate(functions) for block in region}
        wanted = [self.seam.main_loop[0], _TICK_VECTOR * _VECTOR_BYTES]
        wanted += [*filter(None, self.seam.calls), *self.seam.functions]
        merged: set[int] = set()
        size = 0
        while wanted:
            at = place.get(wanted.pop(0))
            more = 0 if at is None else sum(map(len, functions[at]))
            if at is None or at in merged or size + more > _MOST_OF_THE_PROGRAM:
                continue
            merged.add(at)
            size += more
            lasts = [block[-1] for block in functions[at]]
            # Where code begins anew, at address 0, the engine looks: the region is left for that.
            jumps = [last for last in lasts if last.name in _CALLS | _JUMPS]
            targets = [jump.target for jump in jumps if jump.target != 0]
            goes_on = [] if lasts[-1].name in _NOWHERE | _JUMPS else [lasts[-1].end]
            # Behind the jump of a vector there is nothing but filling.
            is_vector = functions[at][-1][-1].end <= _VECTORS * _VECTOR_BYTES
            wanted = [targets[0], *wanted] if is_vector else [*goes_on, *wanted, *targets]
        first = [block for at in sorted(merged) for block in functions[at]]
        rest = [region for at, region in enumerate(functions) if at not in merged]
        return [first, *rest] if first else rest

    def _functions(self) -> Iterator[_Region]:
        """The same, apart."""
        region: _Region = []
        size = 0
        for block in self._blocks():
            begins = block[0].address in self.called or size > _MOST_OF_A_REGION
            if region and (begins or block[0].address != region[-1][-1].end):
                yield region
                region, size = [], 0
            region.append(block)
            size += len(block)
        if region:
            yield region


def _region_text(number: int, region: _Region, code: _Code) -> str:
    used = {24, 25}  # results of the engine's calls
    for block in region:
        for instruction in block:
            used |= registers(instruction)
    local = [] if code.variant == "debugged" else sorted(used)
    inside = {block[0].address for block in region}
    own = {instruction.address: instruction for block in region for instruction in block}
    everything = {at: f"r{at}" if at in used else f"M[{at}]" for at in range(REGISTERS)}
    kept = {at: name for at, name in everything.items() if at not in _SCRATCH}
    scratch = {at: everything[at] for at in _SCRATCH}
    begin, end = code.seam.main_loop if code.seam else (0, 0)
    return _REGION.format(
        number=number,
        load=" ".join(f"uint8_t r{register} = M[{register}];" for register in local),
        store=" ".join(f"M[{register}] = r{register};" for register in local),
        entries="\n".join(f"case 0x{at:x}: goto block_0x{at:x};" for at in sorted(inside)),
        blocks="\n".join(_block_text(block, own, inside, used, code) for block in region),
        in_main=f"pc >= {begin} && pc < {end}",
        differing=_differing(kept),
        note=_note(kept),
        scratch_differing=_differing(scratch),
        note_scratch=_note(scratch),
    )


def _differing(names: Mapping[int, str]) -> str:
    return " | ".join(f"({name} ^ pass_->registers[{at}])" for at, name in names.items())


def _note(names: Mapping[int, str]) -> str:
    return "; ".join(f"pass_->registers[{at}] = {name}" for at, name in names.items())


def _block_text(
    block: _Block,
    own: Mapping[int, Instruction],
    inside: set[int],
    used: set[int],
    code: _Code,
) -> str:
    offsets = [0]
    for instruction in block:
        offsets.append(offsets[-1] + cycles(instruction))
    lines = [f"BLOCK(0x{block[0].address:x}, {offsets[-2]})"]
    if code.variant in MARKED:
        lines.append(_cover(block[0].address, "RAN"))
    shortcut = turns_left_out(block[0].address, own)
    if shortcut and code.waits(block[0].address):
        lines.append("chip->passed = 1;")
    call = code.engine_call(block[0].address)
    if call is not None:
        lines += code.begins(block[0], 0)
        lines.append(f"ENGINE_CALL(0x{block[0].address:x}, {call})")
    if code.seam is not None and (number := divisor(block[0].address, own)):
        lines.append(f"DIVIDES_BY(0x{block[0].address:x}, {number})")
    if shortcut and code.variant != "covered":
        lines.append(f"if (LEAPS) {{ {shortcut} }}" if code.variant == "debugged" else shortcut)
    computed = code.variant in ("plain", "hunted")
    routine = code.routine(block[0].address, used) if computed else None
    if routine is not None:
        lines.append(routine)
    for instruction, (offset, behind) in zip(block, pairwise(offsets), strict=True):
        lines += code.begins(instruction, offset)
        lines += code.count(instruction)
        if instruction.name in _LEAVES and not is_interpreted(instruction):
            lines += _leave(instruction, offset, behind, inside, code)
        else:
            live = code.live.get(instruction.address, ALL_FLAGS)
            lines.append(statement(instruction, offset, live))
    if code.seam is not None and lets_interrupts(block[-1]) and block[-1].end in inside:
        lines.append(f"left -= {offsets[-1]}; goto begun_0x{block[-1].end:x};")
    elif block[-1].name not in _LEAVES:
        lines.append(code.go(block[-1], block[-1].end, offsets[-1], inside))
    return "\n".join(lines)


def _cover(address: int, what: str) -> str:
    return f"COVER(0x{address:x}, {what})"


def _leave(
    instruction: Instruction, offset: int, behind: int, inside: set[int], code: _Code
) -> list[str]:
    """The last instruction of a block, which does more than go on with the next."""
    name, end = instruction.name, instruction.end
    here = f"0x{instruction.address:x}, {offset}"
    if name == "ret":
        return [f"RETURN({here}, {behind});"]
    lines = []
    if name in _CALLS or name == "icall":
        lines.append(f"PUSH_RETURN({here}, 0x{end:x});")
    if name in ("ijmp", "icall"):
        return [*lines, f"GO_TO(PAIR(r30, r31) * 2u, {behind});"]
    if name in _CALLS:
        return [*lines, code.go(instruction, instruction.target, behind, inside)]
    if name in _JUMPS:
        if code.ends_by(instruction):
            lines.append(f"NOTE_JUMP(0x{instruction.address:x});")
        return [*lines, code.go(instruction, instruction.target, behind, inside)]
    target, more = instruction.target, 1
    if name in SKIPS:
        target = code.skipped_to(instruction)
        more = (target - end) // 2
        if name in ("sbic", "sbis"):
            lines.append(f"FOR_EFFECT({here}, {instruction.r}, READ_EFFECT);")
    taken = code.go(instruction, target, behind + more, inside)
    not_taken = code.go(instruction, end, behind, inside)
    if code.variant in MARKED:
        taken = f"{_cover(instruction.address, 'TAKEN')} {taken}"
        not_taken = f"{_cover(instruction.address, 'NOT_TAKEN')} {not_taken}"
    return [*lines, f"if ({condition(instruction)}) {{ {taken} }}", not_taken]
