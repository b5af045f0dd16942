"""Effects of an ATmega328P's instructions, as C by the macros of translated/code.h, and what it
costs."""

from kilotwin.programs.translate.instructions import Instruction

_CYCLES = {
    **dict.fromkeys(["mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu", "adiw", "sbiw"], 2),
    **dict.fromkeys(["ld", "ld+", "-ld", "ldd", "st", "st+", "-st", "std", "lds", "sts"], 2),
    **dict.fromkeys(["push", "pop", "cbi", "sbi", "rjmp", "ijmp"], 2),
    **dict.fromkeys(["lpm", "lpm+", "lpm_r0", "jmp", "rcall", "icall"], 3),
    **dict.fromkeys(["call", "ret", "reti"], 4),
}

SKIPS = {
    "cpse": "{d} == {r}",
    "sbrc": "!({d} >> {k} & 1)",
    "sbrs": "{d} >> {k} & 1",
    "sbic": "!(M[{a}] >> {k} & 1)",
    "sbis": "M[{a}] >> {k} & 1",
}
"""When an instruction skips the next one."""

Z = 1
"""The flag's number."""

_FLAGS = ["cf", "zr", "nr >> 7", "vr >> 7", "sr >> 7", "hr >> 4 & 1", "tf", "inf"]
_I = 7
_SET = ["cf = 1", "zr = 0", "nr = 0x80", "vr = 0x80", "sr = 0x80", "hr = 0x10", "tf = 1"]
_CLEAR = ["cf = 0", "zr = 1", "nr = 0", "vr = 0", "sr = 0", "hr = 0", "tf = 0"]

_OPERATIONS = {
    "nop": "",
    "mov": "{d} = {r};",
    "movw": "{d} = {r}, {d1} = {r1};",
    "ldi": "{d} = {k};",
    "add": "ADD({live}, {d}, {r}, 0u);",
    "adc": "ADD({live}, {d}, {r}, cf);",
    "sub": "SUB({live}, {d}, {r});",
    "subi": "SUB({live}, {d}, {k});",
    "sbc": "SBC({live}, {d}, {r});",
    "sbci": "SBC({live}, {d}, {k});",
    "cp": "CP({live}, {d}, {r});",
    "cpi": "CP({live}, {d}, {k});",
    "cpc": "CPC({live}, {d}, {r});",
    "and": "LOGIC({live}, {d}, {d} & {r});",
    "andi": "LOGIC({live}, {d}, {d} & {k});",
    "or": "LOGIC({live}, {d}, {d} | {r});",
    "ori": "LOGIC({live}, {d}, {d} | {k});",
    "eor": "LOGIC({live}, {d}, {d} ^ {r});",
    "com": "COM({live}, {d});",
    "neg": "NEG({live}, {d});",
    "inc": "INC({live}, {d});",
    "dec": "DEC({live}, {d});",
    "swap": "SWAP({d});",
    "lsr": "SHIFT({live}, {d}, 0);",
    "asr": "SHIFT({live}, {d}, {d} & 0x80);",
    "ror": "SHIFT({live}, {d}, cf << 7);",
    "mul": "MUL({live}, {d} * {r}, 0);",
    "muls": "MUL({live}, (int8_t){d} * (int8_t){r}, 0);",
    "mulsu": "MUL({live}, (int8_t){d} * {r}, 0);",
    "fmul": "MUL({live}, {d} * {r}, 1);",
    "fmuls": "MUL({live}, (int8_t){d} * (int8_t){r}, 1);",
    "fmulsu": "MUL({live}, (int8_t){d} * {r}, 1);",
    "adiw": "ADIW({live}, {d}, {d1}, {k});",
    "sbiw": "SBIW({live}, {d}, {d1}, {k});",
    "bst": "BST({d}, {k});",
    "bld": "BLD({d}, {k});",
    "ld": "LOAD({here}, {d}, {pair});",
    "ldd": "LOAD({here}, {d}, {pair} + {k});",
    "st": "STORE({here}, {pair}, {d});",
    "std": "STORE({here}, {pair} + {k}, {d});",
    "ld+": "LOAD({here}, value, {pair}); {next} {d} = value;",
    "st+": "STORE({here}, {pair}, {d}); {next}",
    "-ld": "LOAD({here}, value, {pair} - 1); {previous} {d} = value;",
    "-st": "STORE({here}, {pair} - 1, {d}); {previous}",
    "in": "IN({here}, {d}, {k});",
    "out": "OUT({here}, {k}, {d});",
    "push": "PUSH({here}, {d});",
    "pop": "POP({here}, {d});",
    "lpm_r0": "LPM({here}, r0, PAIR(r30, r31));",
    "lpm": "LPM({here}, {d}, PAIR(r30, r31));",
    "lpm+": "LPM({here}, value, {pair}); LPM_NEXT({d}, value);",
    "sbi": "FOR_EFFECT({here}, {a}, READ_EFFECT); OUT({here}, {a}, M[{a}] | 1 << {k});",
    "cbi": "FOR_EFFECT({here}, {a}, READ_EFFECT); OUT({here}, {a}, M[{a}] & ~(1 << {k}));",
}
"""Instructions that go on with the next one; {here} are address and offset."""

# By address: where `in` and `out` lead, and SRAM.
_LOW = {"lds": _OPERATIONS["in"], "sts": _OPERATIONS["out"]}
_HIGH = {"lds": "{d} = M[{k}];", "sts": "NOTE_STORE({here}, {k}, {d}); WRITE_STATIC({k}, {d});"}

REGISTERS, _IO_END, DATA_END = 0x20, 0x100, 0x900
_SPL, _SPH, _SREG = 0x5D, 0x5E, 0x5F


def cycles(instruction: Instruction) -> int:
    """Cycles of an instruction that does not skip or branch; of a branch that is not taken."""
    return _CYCLES.get(instruction.name, 1)


def is_interpreted(instruction: Instruction) -> bool:
    """Whether the interpreter executes it, always."""
    if instruction.name in ("lds", "sts"):
        return not REGISTERS <= instruction.k < DATA_END
    if instruction.name in ("bset", "bclr"):
        return False
    return instruction.name in ("sleep", "break", "wdr", "spm", "reti", "invalid")


def is_often_interpreted(instruction: Instruction) -> bool:
    """Whether the interpreter executes it, sometimes at least, where a program does no harm."""
    name = instruction.name
    if name in ("in", "out", "lds", "sts"):
        own = (_SPL, _SPH, _SREG) if name in ("in", "lds") else (_SPL, _SPH)
        return instruction.k < _IO_END and instruction.k not in own
    if name == "bset":
        return instruction.k == _I
    return name in ("sbi", "cbi", "sbic", "sbis") or is_interpreted(instruction)


def lets_interrupts(instruction: Instruction) -> bool:
    """Whether it may, one instruction later."""
    name = instruction.name
    return (name == "bset" and instruction.k == _I) or (
        name in ("out", "sts") and instruction.k == _SREG
    )


def registers(instruction: Instruction) -> set[int]:
    """Those that its C names, or more."""
    name = instruction.name
    if is_interpreted(instruction):
        return set()
    used = {instruction.d, instruction.d + 1, instruction.r, instruction.r + 1}
    if name.startswith(("mul", "fmul", "lpm")):
        used |= {0, 1}
    if name.startswith("lpm") or name in ("ijmp", "icall"):
        used |= {30, 31}
    return {number for number in used if number < REGISTERS}


def statement(instruction: Instruction, offset: int, live: int) -> str:
    """C of an instruction that goes on with the next one, `offset` cycles into its block; of the
    flags it sets those that are `live`."""
    at = f"0x{instruction.address:x}"
    if instruction.name == "reti":
        return f"END_INTERRUPT({at}, {offset});"
    if is_interpreted(instruction):
        return f"HAND_OVER({at}, {offset});"
    name = instruction.name
    if name in ("bset", "bclr"):
        return _flag_statement(instruction, (at, offset))
    if name in ("lds", "sts"):
        pattern = (_LOW if instruction.k < _IO_END else _HIGH)[name]
    else:
        pattern = _OPERATIONS[name]
    low, high = f"r{instruction.r}", f"r{instruction.r + 1}"
    return pattern.format(
        d=f"r{instruction.d}",
        d1=f"r{instruction.d + 1}",
        r=low,
        r1=high,
        live=f"0x{live:02x}",
        k=instruction.k,
        a=instruction.r,
        here=f"{at}, {offset}",
        pair=f"PAIR({low}, {high})",
        next=f"SET_PAIR({low}, {high}, PAIR({low}, {high}) + 1);",
        previous=f"SET_PAIR({low}, {high}, PAIR({low}, {high}) - 1);",
    )


def condition(instruction: Instruction) -> str:
    """When a branch is taken, or a skip skips."""
    if instruction.name in SKIPS:
        return SKIPS[instruction.name].format(
            d=f"r{instruction.d}", r=f"r{instruction.r}", k=instruction.k, a=instruction.r
        )
    if instruction.k == Z:
        return "zr == 0" if instruction.name == "brbs" else "zr != 0"
    flag = _FLAGS[instruction.k]
    return flag if instruction.name == "brbs" else f"!({flag})"


def _flag_statement(instruction: Instruction, here: tuple[str, int]) -> str:
    at, offset = here
    if instruction.name == "bclr":
        return f"HOLD({offset});" if instruction.k == _I else _CLEAR[instruction.k] + ";"
    if instruction.k == _I:
        return f"if (!inf && !AWAITS) HAND_OVER({at}, {offset}); LET({offset});"
    return _SET[instruction.k] + ";"
