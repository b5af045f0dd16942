"""Where files that an experiment names are looked for."""

from pathlib import Path

PARCEL = "parcel"
"""Where a run folder keeps what the run was made of (runs/parcel.py)."""


def places_of(written: str, beside: Path) -> tuple[Path, Path]:
    """Where a file or folder that an experiment names may be: from here, or `beside` the
    experiment; what is a run folder's own is looked for there first."""
    name = Path(written).expanduser()
    here, there = Path.cwd() / name, beside / name
    return (there, here) if name.parts[:1] == (PARCEL,) else (here, there)
