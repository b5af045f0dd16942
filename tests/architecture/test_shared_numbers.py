"""Numbers and flags that several parts share stand in one file, which the others read."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OWNERS = {
    r"262[_']?144": "host_tools/kilotwin/units.py",  # a test compares it with timer.h
    r"0\.032768": None,
    r"34[_']?970": None,  # an infrared frame: firmware/kilolib/core/infrared_frame.h
    r"F_CPU=\d": "firmware/avr.mk",
    r"-mmcu=\w+": "firmware/avr.mk",
    r"-fshort-enums": "firmware/avr.mk",
    r"-fpack-struct": "firmware/avr.mk",
    r"-Wl,--relax": "firmware/avr.mk",
    r"= 0\.05;|= 0\.05\b.*[cC]ell|MODULE_M = 0\.1": None,  # kilogrid_modules/protocol/dimensions.h
    r"(?i)bit_?rate\w* (= )?250[_']?000\b": "kilogrid_modules/protocol/dimensions.h",
}
SUFFIXES = {".py", ".pyi", ".c", ".h", ".cpp", ".mk"}
COMMENT = {"py": r"#.*|^\s*\"\"\".*", "mk": r"#.*", "c": r"//.*"}


def sources() -> list[Path]:
    folders = ("firmware", "kilogrid_modules", "emulator", "host_tools")
    found = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()]
    kept = [path for path in found if path.suffix in SUFFIXES or path.name == "Makefile"]
    return sorted([*kept, ROOT / "Makefile"])


def without_comments(path: Path) -> str:
    kind = "py" if path.suffix in {".py", ".pyi"} else "c"
    kind = "mk" if path.suffix == ".mk" or path.name == "Makefile" else kind
    return re.sub(COMMENT[kind], "", path.read_text(), flags=re.MULTILINE)


@pytest.mark.parametrize("pattern", OWNERS)
def test_a_shared_number_stands_with_its_owner_only(pattern: str) -> None:
    holders = {
        path.relative_to(ROOT).as_posix()
        for path in sources()
        if re.search(pattern, without_comments(path))
    }
    owner = OWNERS[pattern]
    assert holders == ({owner} if owner else set())
