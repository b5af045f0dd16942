"""The emulator's folders are floors: each includes itself and those below it, never one above."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from .tree import C_SUFFIXES, ROOT, includes, owners_of, plant, sources

# From the ground up. The folders of emulator/robots and emulator/avr are floors of their own. Two
# folders are one floor with a folder in them: physics with contact/, which builds on arena and
# motion, and the world builds on contact/; translated with passes/, which it includes and whose
# tracer interprets its code.
FLOORS = (
    "emulator/base",
    "emulator/robots",
    "emulator/robots/native",
    "emulator/robots/translated",
    "emulator/modules",
    "emulator/physics",
    "emulator/infrared",
    "emulator/grid",
    "emulator/avr/chip",
    "emulator/avr/boards",
    "emulator/avr",
    "emulator/simulation",
    "emulator/python",
)


def floor_of(path: str) -> int | None:
    """The number of the floor of a file, the innermost one; None outside the emulator's floors."""
    holders = [floor for floor in FLOORS if path.startswith(f"{floor}/")]
    return FLOORS.index(max(holders, key=len)) if holders else None


def upward_includes(root: Path) -> Iterator[str]:
    """Includes of the emulator that lead to a higher floor, and files that are on none."""
    files = [path.as_posix() for path in sources(root, C_SUFFIXES)]
    for file in files:
        if not file.startswith("emulator/"):
            continue
        floor = floor_of(file)
        if floor is None:
            yield f"{file}: lies on no floor"
            continue
        for name, quoted in includes(root / file):
            for owner in owners_of(files, Path(file), name, quoted) if quoted else ():
                above = floor_of(owner)
                if above is not None and above > floor:
                    yield f"{file}: includes {owner}, but {FLOORS[above]} is above {FLOORS[floor]}"


def circles(root: Path) -> Iterator[str]:
    """Files that include one another in a circle."""
    files = [path.as_posix() for path in sources(root, C_SUFFIXES)]
    files = [file for file in files if file.startswith("emulator/")]
    below = {
        file: {
            owner
            for name, quoted in includes(root / file)
            if quoted
            for owner in owners_of(files, Path(file), name, quoted)
        }
        for file in files
    }
    above = {file: {other for other in files if file in below[other]} for file in files}
    left = set(files)
    # A folder that includes none of those left, or is included by none of them, is in no circle.
    while free := {f for f in left if not below[f] & left or not above[f] & left}:
        left -= free
    yield from (f"{file}: part of a circle of includes" for file in sorted(left))


def test_the_emulator_includes_downwards_only() -> None:
    assert list(upward_includes(ROOT)) == []


def test_no_file_of_the_emulator_includes_itself_by_way_of_others() -> None:
    assert list(circles(ROOT)) == []


def test_every_floor_is_seen() -> None:
    seen = {floor_of(path.as_posix()) for path in sources(ROOT, C_SUFFIXES)}
    assert set(range(len(FLOORS))) <= seen


GOOD = {
    "emulator/base/clock.h": "#include <cstdint>\n",
    "emulator/physics/contact/island.h": '#include "base/clock.h"\n',
    "emulator/physics/bodies.h": '#include "physics/contact/island.h"\n#include "base/clock.h"\n',
    "emulator/avr/chip/core.h": '#include "base/clock.h"\n',
    "emulator/avr/boards/robot.h": '#include "avr/chip/core.h"\n#include "other.h"\n',
    "emulator/avr/boards/other.h": "",
    "emulator/avr/twins.h": '#include "avr/boards/robot.h"\n',
    "emulator/grid/cells.h": '#include "base/clock.h"\n',
    "emulator/python/module.cpp": '#include "avr/boards/robot.h"\n#include "physics/bodies.h"\n',
    "firmware/kilolib/include/kilolib.h": "",
}


def test_a_good_tree_passes(tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    assert list(upward_includes(tmp_path)) == []
    assert list(circles(tmp_path)) == []


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("emulator/base/clock.h", '#include "physics/bodies.h"\n'),
        ("emulator/base/clock.h", '#include "../python/module.cpp"\n'),
        ("emulator/physics/contact/island.h", '#  include "grid/cells.h" // why\n'),
        ("emulator/avr/chip/core.h", '#include "avr/boards/robot.h"\n'),
        ("emulator/avr/boards/other.h", '#include "avr/twins.h"\n'),
        ("emulator/engine/world.h", ""),
    ],
)
def test_a_planted_upward_include_is_caught(name: str, text: str, tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    plant(tmp_path, {name: text})
    found = list(upward_includes(tmp_path))
    assert len(found) == 1, found
    assert found[0].startswith(name)


def test_a_planted_circle_is_caught(tmp_path: Path) -> None:
    plant(tmp_path, GOOD)
    plant(tmp_path, {"emulator/avr/boards/other.h": '#include "robot.h"\n'})
    assert [line.split(":")[0] for line in circles(tmp_path)] == [
        "emulator/avr/boards/other.h",
        "emulator/avr/boards/robot.h",
    ]
