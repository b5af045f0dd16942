"""Every instruction of the ATmega328P, translated to C, does what simavr does from any state."""

import random
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from kilotwin.files import resources
from kilotwin.programs.native.guest import find_compiler
from kilotwin.programs.translate.translator import translate

FLASH_BYTES = 0x8000
HARNESS = Path(__file__).with_name("instructions.c")
# Bits as the instruction set manual gives them: letters are operands.
ALWAYS = {
    "nop": "0000000000000000",
    "movw": "00000001ddddrrrr",
    "muls": "00000010ddddrrrr",
    "mulsu": "000000110ddd0rrr",
    "fmul": "000000110ddd1rrr",
    "fmuls": "000000111ddd0rrr",
    "fmulsu": "000000111ddd1rrr",
    "cpc": "000001rdddddrrrr",
    "sbc": "000010rdddddrrrr",
    "add": "000011rdddddrrrr",
    "cpse": "000100rdddddrrrr",
    "cp": "000101rdddddrrrr",
    "sub": "000110rdddddrrrr",
    "adc": "000111rdddddrrrr",
    "and": "001000rdddddrrrr",
    "eor": "001001rdddddrrrr",
    "or": "001010rdddddrrrr",
    "mov": "001011rdddddrrrr",
    "cpi": "0011KKKKddddKKKK",
    "sbci": "0100KKKKddddKKKK",
    "subi": "0101KKKKddddKKKK",
    "ori": "0110KKKKddddKKKK",
    "andi": "0111KKKKddddKKKK",
    "com": "1001010ddddd0000",
    "neg": "1001010ddddd0001",
    "swap": "1001010ddddd0010",
    "inc": "1001010ddddd0011",
    "asr": "1001010ddddd0101",
    "lsr": "1001010ddddd0110",
    "ror": "1001010ddddd0111",
    "dec": "1001010ddddd1010",
    "bset but I": "100101000sss1000",
    "bclr": "100101001sss1000",
    "ijmp": "1001010000001001",
    "jmp": "100101000000110000pppppppppppppp",
    "adiw": "10010110KKddKKKK",
    "sbiw": "10010111KKddKKKK",
    "cbi": "10011000AAAAAbbb",
    "sbic": "10011001AAAAAbbb",
    "sbi": "10011010AAAAAbbb",
    "sbis": "10011011AAAAAbbb",
    "mul": "100111rdddddrrrr",
    "in": "10110AAdddddAAAA",
    "rjmp": "1100kkkkkkkkkkkk",
    "ldi": "1110KKKKddddKKKK",
    "brbs": "111100kkkkkkksss",
    "brbc": "111101kkkkkkksss",
    "bld": "1111100ddddd0bbb",
    "bst": "1111101ddddd0bbb",
    "sbrc": "1111110ddddd0bbb",
    "sbrs": "1111111ddddd0bbb",
    "lds": "1001000ddddd00000000001mmmmmmmmm",
    "sts": "1001001ddddd00000000001mmmmmmmmm",
    "lds i/o": "1001000ddddd00000000000001mmmmmm",
}
# Those that the interpreter is asked for where they leave SRAM or let interrupts through.
MOSTLY = {
    "bset I": "1001010001111000",
    "ldd z": "10q0qq0ddddd0qqq",
    "ldd y": "10q0qq0ddddd1qqq",
    "std z": "10q0qq1ddddd0qqq",
    "std y": "10q0qq1ddddd1qqq",
    "ld z+": "1001000ddddd0001",
    "ld -z": "1001000ddddd0010",
    "ld y+": "1001000ddddd1001",
    "ld -y": "1001000ddddd1010",
    "ld x": "1001000ddddd1100",
    "ld x+": "1001000ddddd1101",
    "ld -x": "1001000ddddd1110",
    "st z+": "1001001ddddd0001",
    "st -z": "1001001ddddd0010",
    "st y+": "1001001ddddd1001",
    "st -y": "1001001ddddd1010",
    "st x": "1001001ddddd1100",
    "st x+": "1001001ddddd1101",
    "st -x": "1001001ddddd1110",
    "lpm r0": "1001010111001000",
    "lpm": "1001000ddddd0100",
    "lpm z+": "1001000ddddd0101",
    "pop": "1001000ddddd1111",
    "push": "1001001ddddd1111",
    "call": "100101000000111000pppppppppppppp",
    "rcall": "1101kkkkkkkkkkkk",
    "icall": "1001010100001001",
    "ret": "1001010100001000",
    "out": "10111AArrrrrAAAA",
    "sts i/o": "1001001ddddd00000000000001mmmmmm",
}
NEVER = {
    "reti": "1001010100011000",
    "sleep": "1001010110001000",
    "break": "1001010110011000",
    "wdr": "1001010110101000",
    "spm": "1001010111101000",
}
RET, RJMP_ON, NOP, LDS = 0x9508, 0xC000, 0x0000, (0x9000, 0x0123)


@dataclass
class Case:
    name: str
    address: int
    text: str


def words_of(pattern: str, name: str, draw: random.Random) -> list[int]:
    """Machine code with operands drawn at random."""
    bits = "".join(bit if bit in "01" else draw.choice("01") for bit in pattern)
    if name == "bset but I" and bits[9:12] == "111":
        bits = bits[:9] + "000" + bits[12:]
    return [int(bits[at : at + 16], 2) for at in range(0, len(bits), 16)]


def flash_of(patterns: dict[str, str], each: int, draw: random.Random) -> tuple[bytes, list[Case]]:
    """A flash with `each` variants of each instruction.

    Each begins behind a ret, so that the translation may be entered there. Behind it comes one
    that may be skipped, of one word or of two.
    """
    words: list[int] = [RET] * 0x40
    cases = []
    for name, pattern in patterns.items():
        for _ in range(each):
            own = words_of(pattern, name, draw)
            text = " ".join(f"{word:04X}" for word in own)
            cases.append(Case(name, 2 * len(words), text))
            words += own
            words += [RJMP_ON] if draw.random() < 0.5 else [*LDS]
            words += [NOP, RET]
    flash = b"".join(word.to_bytes(2, "little") for word in words)
    assert len(flash) <= FLASH_BYTES
    return flash.ljust(FLASH_BYTES, b"\xff"), cases


def run(states: int, seed: int, each: int, folder: Path, *, interpreter: bool = False) -> None:
    draw = random.Random(seed)
    never = {} if interpreter else NEVER
    flash, cases = flash_of({**ALWAYS, **MOSTLY, **never}, each, draw)
    sources = []
    for number, text in enumerate(translate(flash, {})):
        sources.append(folder / f"{number}.c")
        sources[-1].write_text(text)
    program = folder / "instructions"
    command = [find_compiler(), "-O1", "-w", f"-I{resources.path('emulator')}"]
    if interpreter:
        command += [
            "-DINTERPRETER",
            str(resources.path("emulator/robots/translated/interpreter.c")),
        ]
    command += ["-o", str(program), *map(str, [*sources, HARNESS]), "-lsimavr"]
    subprocess.run(command, check=True)
    addresses = "".join(f"{case.address:x}\n" for case in cases)
    done = subprocess.run(
        [str(program), str(states), str(seed)],
        input=addresses,
        capture_output=True,
        text=True,
        check=False,
    )
    named = {f"at 0x{case.address:04X}": f"{case.name} ({case.text})" for case in cases}
    lines = done.stdout.splitlines()
    if done.returncode != 0 and lines:
        pytest.fail(f"{named.get(lines[-1].split(':')[0])} {lines[-1]}")
    assert done.returncode == 0, done.stderr
    counted = {int(at, 16): int(count) for at, count in map(str.split, lines)}
    for case in cases:
        share = counted[case.address] / states
        if case.name in NEVER:
            assert share == 0, case
        else:
            assert share == 1 if case.name in ALWAYS else share > 0.3, (case, share)


def test_each_instruction_leaves_the_state_that_simavr_leaves(tmp_path: Path) -> None:
    run(states=100, seed=1, each=10, folder=tmp_path)


def test_the_guests_interpreter_leaves_it_too(tmp_path: Path) -> None:
    run(states=100, seed=1, each=10, folder=tmp_path, interpreter=True)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2, 12))
def test_each_instruction_does_so_from_a_hundred_thousand_states(seed: int, tmp_path: Path) -> None:
    run(states=10_000, seed=seed, each=10, folder=tmp_path)
