"""Finds the repository's own data: guest sources, API headers, the robot programs we bring."""

from pathlib import Path

import kilotwin
from kilotwin.errors import KilotwinError

_PACKAGE = Path(__file__).resolve().parents[1]
_SOURCE_TREE = _PACKAGE.parents[1]

_PARTS = ("firmware", "kilogrid_modules", "emulator/robots", "experiments")


def roots() -> list[Path]:
    """Where to look: the source tree (editable install), then the wheel's own copy."""
    tree = [_SOURCE_TREE] if (_SOURCE_TREE / "pyproject.toml").is_file() else []
    return [*tree, _PACKAGE / "share"]


def build_folders() -> list[Path]:
    """Those that programs are built from."""
    return [*(root / part for root in roots() for part in _PARTS), *_made()]


def made() -> Path:
    """The folder of kilogrid_can.c and .h, which the build makes of kilogrid.dbc."""
    return _there(next((folder for folder in _made() if folder.exists()), None), "kilogrid_can.c")


def _made() -> list[Path]:
    """Where it may be: an editable install keeps what is built apart from the sources."""
    return [Path(folder) / "made" for folder in kilotwin.__path__]


def find(relative: str) -> Path | None:
    """The file or folder of that name below one of the roots, or None."""
    return next((root / relative for root in roots() if (root / relative).exists()), None)


def files(pattern: str) -> list[Path]:
    """The files that match `folder/name`, where the name may have wildcards, in order."""
    folder, _, name = pattern.rpartition("/")
    return sorted(path(folder).glob(name))


def path(relative: str) -> Path:
    """Like `find`, for what every installation must have."""
    return _there(find(relative), relative)


def _there(found: Path | None, name: str) -> Path:
    if found is None:
        raise KilotwinError(f"this installation of kilotwin lacks {name}; install it again")
    return found
