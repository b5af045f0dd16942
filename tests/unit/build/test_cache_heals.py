"""What is damaged in the cache is built again, with a line."""

from collections.abc import Callable
from pathlib import Path

import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.programs.image.image import Image, build_image
from kilotwin.programs.native.guest import Guest, build

pytestmark = pytest.mark.usefixtures("cache")


def empty(file: Path) -> None:
    file.write_bytes(b"")


def flip_a_byte(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    file.write_bytes(content)


@pytest.mark.parametrize("damage", [empty, flip_a_byte])
def test_a_damaged_guest_is_built_again(damage: Callable[[Path], None], folder: Path) -> None:
    said: list[str] = []
    program = find_program("blink.c", folder)
    kept: Guest = build(program)
    damage(kept.file)
    assert build(program, said.append) == kept
    assert said[0] == f"{kept.file}: is damaged, and built again"
    said.clear()
    assert build(program, said.append).file.stat().st_size > 1000
    assert said == []


@pytest.mark.parametrize("damage", [empty, flip_a_byte, Path.unlink])
def test_a_damaged_image_is_built_again(damage: Callable[[Path], None], folder: Path) -> None:
    said: list[str] = []
    program = find_program("blink.c", folder)
    kept: Image = build_image(program)
    damage(kept.elf)
    assert build_image(program, said.append).elf.stat().st_size > 1000
    assert said[0] == f"{kept.folder}: is damaged, and built again"


@pytest.mark.parametrize("make", [build, build_image])
@pytest.mark.parametrize("damage", [empty, Path.unlink])
def test_a_damaged_object_of_ours_is_compiled_again(
    make: Callable[..., object], damage: Callable[[Path], None], folder: Path, cache: Path
) -> None:
    make(find_program("blink.c", folder, (), ("N=1",)))
    for file in cache.glob("*-objects/*"):
        damage(file)
    said: list[str] = []
    make(find_program("blink.c", folder, (), ("N=2",)), said.append)
    damaged = [line for line in said if line.endswith(": is damaged, and built again")]
    assert damaged
    assert all("-objects: " in line for line in damaged)
