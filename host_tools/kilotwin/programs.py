"""Finds a robot program: a folder with all its .c files, or one .c file."""

from dataclasses import dataclass
from pathlib import Path

from kilotwin import resources


@dataclass(frozen=True)
class Program:
    """`written` is how a run folder names it, so that it is found again from anywhere."""

    written: str
    path: Path
    sources: tuple[Path, ...]

    @property
    def name(self) -> str:
        """What people call it: the folder's or the file's name."""
        return self.path.stem if self.path.is_file() else self.path.name


def find_program(written: str, beside: Path) -> Program:
    """Looks from the current folder, beside the experiment file, and in what Kilotwin brings.

    ValueError says what is missing.
    """
    wanted = Path(written).expanduser()
    places = [Path.cwd() / wanted, beside / wanted]
    found = next((place for place in places if place.exists()), None) or resources.find(written)
    if found is None:
        raise ValueError(f"program '{written}' is not there; name a folder or a .c file")
    path = found.resolve()
    if path.is_dir():
        sources = tuple(sorted(path.glob("*.c")))
        if not sources:
            raise ValueError(f"program '{written}' has no .c file in it; name a folder that has")
    elif path.suffix == ".c":
        sources = (path,)
    else:
        raise ValueError(f"program '{written}' is not C source; name a folder or a .c file")
    return Program(_portable(path), path, sources)


def _portable(path: Path) -> str:
    for root in resources.roots():
        if path.is_relative_to(root.resolve()):
            return path.relative_to(root.resolve()).as_posix()
    return str(path)
