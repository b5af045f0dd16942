"""Files of a new repository for a lab, `kilotwin new`."""

import shutil
from pathlib import Path

from kilotwin.errors import InputError, KilotwinError, cause_of
from kilotwin.files.origins import WHEELS, Origin

_FOLDER = Path(__file__).resolve().parents[1] / "templates"
_SUFFIX = ".in"
_HIDDEN = "dot_"  # so that no tool takes a template for its own

KINDS = {
    "robots": {"PROGRAM": "spread.c", "BUDGET": "--flash 8000"},
    "grid": {"PROGRAM": "robot.c", "BUDGET": "--flash 10000"},
}
"""Words of each kind's files, beside those of all."""
PACKAGES = ("gcc", "gcc-avr", "avr-libc", "binutils-avr", "tcc")
"""Debian packages that programs are built with."""
PACKAGES_TO_COMPILE = ("g++", "libeigen3-dev", "librandom123-dev", "libsimavr-dev")
"""Debian packages that pip compiles Kilotwin with, beside CMake and ninja, which it brings."""


def write(kind: str, folder: Path, origin: Origin) -> list[Path]:
    """Makes the folder, with all files in it; returns them. InputError if it holds something."""
    words = {
        **KINDS[kind],
        "NAME": folder.name,
        "KILOTWIN": origin.requirement,
        "PYTHON": origin.python,
        "PACKAGES": " ".join(PACKAGES + PACKAGES_TO_COMPILE * origin.compiled),
    }
    sources = {
        _target(file.relative_to(_FOLDER / part)): file
        for part in ("common", kind)
        for file in sorted((_FOLDER / part).rglob(f"*{_SUFFIX}"))
    }
    if not sources:
        raise KilotwinError(f"this installation of kilotwin lacks {_FOLDER}; install it again")
    try:
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: the folder is not empty; name a new one")
        for target, source in sources.items():
            text = source.read_text(encoding="utf-8")
            for word, value in words.items():
                text = text.replace(f"@{word}@", value)
            (folder / target).parent.mkdir(parents=True, exist_ok=True)
            (folder / target).write_text(text, encoding="utf-8")
        if origin.wheel is None:
            return sorted(sources)
        (folder / WHEELS).mkdir()
        copy = Path(WHEELS, origin.wheel.name)
        shutil.copyfile(origin.wheel, folder / copy)
    except OSError as error:
        raise InputError(f"{folder}: {cause_of(error)}; name another folder") from None
    return sorted([*sources, copy])


def _target(written: Path) -> Path:
    parts = [
        part.replace(_HIDDEN, ".", 1) if part.startswith(_HIDDEN) else part
        for part in written.parts
    ]
    return Path(*parts[:-1], parts[-1].removesuffix(_SUFFIX))
