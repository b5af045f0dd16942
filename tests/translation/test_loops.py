"""Loops of which a translation leaves out turns end as if each turn were executed: same registers,
flags and cycles, also where the cycles end in their midst."""

import subprocess
from pathlib import Path

import pytest

from kilotwin import _emulator
from kilotwin.files import resources
from kilotwin.programs.native.guest import find_compiler
from kilotwin.programs.translate import translator

HERE = Path(__file__).parent
STATES = 5_000
SHORTCUTS = {"COUNT_DOWN": 3, "NORMALISE": 4, "DIVIDE_BY_COUNT": 5, "DIVIDE_TO_MARK": 2}


def program(texts: list[str], folder: Path) -> Path:
    folder.mkdir()
    sources = [folder / f"{number}.c" for number in range(len(texts))]
    for source, text in zip(sources, texts, strict=True):
        source.write_text(text)
    made = folder / "loops"
    include = f"-I{resources.path('emulator')}"
    command = [find_compiler(), "-O1", "-w", include, "-o", str(made), str(HERE / "loops.c")]
    subprocess.run([*command, *map(str, sources)], check=True)
    return made


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str]:
    """Flash, and the addresses of the loops, a line each."""
    elf = tmp_path_factory.mktemp("loops") / "loops.elf"
    source = str(HERE / "loops.S")
    command = ["avr-gcc", "-mmcu=atmega328p", "-nostdlib", source, "-o", str(elf)]
    subprocess.run(command, check=True)
    names = subprocess.run(["avr-nm", str(elf)], check=True, capture_output=True, text=True)
    lines = [line.split() for line in names.stdout.splitlines()]
    loops = ("count", "from", "mark", "highest", "down")
    wanted = [line[0] for line in lines if line[-1].startswith(loops) and line[1] == "T"]
    assert len(wanted) == sum(SHORTCUTS.values())
    return _emulator.flash_image(str(elf))[0], "\n".join(wanted)


def test_turns_that_are_left_out_do_what_they_would_do(
    image: tuple[bytes, str], tmp_path: Path
) -> None:
    flash, addresses = image
    short = translator.translate(flash, {})
    for name, times in SHORTCUTS.items():
        assert "".join(short).count(f"{name}(") == times
    each = translator.translate(flash, {}, variant="covered")
    ends = [
        subprocess.run(
            [str(program(texts, tmp_path / name)), str(STATES), "1"],
            input=addresses,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
        for name, texts in (("short", short), ("each", each))
    ]
    assert len(ends[0]) == STATES * sum(SHORTCUTS.values())
    assert ends[0] == ends[1]
