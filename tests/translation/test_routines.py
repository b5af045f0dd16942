"""Routines that the engine computes end as their machine code does: same registers, flags, bytes
below the stack pointer and cycles, also where cycles end in their midst."""

import subprocess
from pathlib import Path

import pytest

from kilotwin import _emulator
from kilotwin.files import resources
from kilotwin.programs.native.guest import find_compiler
from kilotwin.programs.translate import translator
from kilotwin.programs.translate.instructions import decode
from kilotwin.programs.translate.routines import ROUTINES

HERE = Path(__file__).parent
STATES = 4_000
SYMBOLS = (
    *("__addsf3", "__subsf3", "__addsf3x", "__mulsf3", "__divsf3", "__cmpsf2", "__gesf2"),
    *("__fp_powser", "__fp_powsodd", "__floatsisf", "__floatunsisf"),
    *("__udivmodhi4", "__divmodhi4", "__udivmodsi4", "__divmodsi4", "do_rand"),
)
Z = 30  # the pointer's lower register


def series_before(flash: bytes, routine: int) -> int:
    """The address of the series that is given to a routine where a jump leads to it."""
    for at in range(0, 0x2000, 2):
        low, high = decode(flash, at), decode(flash, at + 2)
        if (low.name, low.d, high.name, high.d) == ("ldi", Z, "ldi", Z + 1):
            jump = decode(flash, high.end)
            if jump.name in ("jmp", "rjmp") and jump.target == routine:
                return low.k | high.k << 8
    raise AssertionError


@pytest.mark.parametrize("relax", ["-mrelax", "-mno-relax"])
def test_routines_that_are_computed_end_as_they_are_executed(tmp_path: Path, relax: str) -> None:
    elf = tmp_path / "calls.elf"
    source = str(HERE / "calls_routines.c")
    command = ["avr-gcc", "-mmcu=atmega328p", "-Os", relax, source, "-o", str(elf), "-lm"]
    subprocess.run(command, check=True)
    names = subprocess.run(["avr-nm", str(elf)], check=True, capture_output=True, text=True)
    lines = [line.split() for line in names.stdout.splitlines()]
    places = {line[-1]: int(line[0], 16) for line in lines}
    flash = _emulator.flash_image(str(elf))[0]
    texts = translator.translate(flash, {})
    known = [name for group in ROUTINES.values() for name in group.values()]
    assert len(known) == len(SYMBOLS)
    for name in known:
        assert "".join(texts).count(f"\nROUTINE({name},") == 1, name
    for number, text in enumerate(texts):
        (tmp_path / f"{number}.c").write_text(text)
    made = tmp_path / "routines"
    engine = resources.path("emulator")
    parts = [engine / "robots/translated/routines" / f"{name}.c" for name in ("floats", "numbers")]
    sources = [HERE / "routines.c", *parts, *sorted(tmp_path.glob("*.c"))]
    command = [find_compiler(), "-O1", "-w", f"-I{engine}", "-o", str(made)]
    subprocess.run([*command, *map(str, sources)], check=True)
    series = series_before(flash, places["__fp_powsodd"])
    given = [
        f"{places[name]:x} {name} {series if name.startswith('__fp_pow') else 0:x}"
        for name in SYMBOLS
    ]
    ends = [
        subprocess.run(
            [str(made), str(STATES), "1", computed],
            input="\n".join(given),
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
        for computed in ("0", "1")
    ]
    assert len(ends[0]) == STATES * len(SYMBOLS)
    assert ends[0] == ends[1]
