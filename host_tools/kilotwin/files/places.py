"""Where files that an experiment names are looked for."""

from collections.abc import Sequence
from pathlib import Path

PARCEL = "parcel"
"""Where a run folder keeps what the run was made of (runs/parcel.py) ..."""
OURS = "kilotwin"
"""... and of that what comes with Kilotwin."""


def places_of(written: str, beside: Path) -> tuple[Path, Path]:
    """Where a file or folder that an experiment names may be: from here, or `beside` the
    experiment; what is a run folder's own is looked for there first."""
    name = Path(written).expanduser()
    here, there = Path.cwd() / name, beside / name
    return (there, here) if name.parts[:1] == (PARCEL,) else (here, there)


def names_ours(program: Sequence[str] | None, name: str) -> bool:
    """Whether `program`, a list of files or folders, is the one that comes with Kilotwin as `name`,
    or a run folder's copy of it."""
    return program in ([name], [f"{PARCEL}/{OURS}/{name}"])
