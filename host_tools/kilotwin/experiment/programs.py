"""Finds a program: a folder with all its .c files, one .c file, or several.

Robot programs come in two flavours of the Kilobot API: kilolib's, and the Kilogrid's, which has
other names and more helpers (`firmware/kilogrid`).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from kilotwin.files import resources
from kilotwin.files.places import places_of

if TYPE_CHECKING:
    from kilotwin.files.build_id import Target

# Marks of Kilogrid programs: the grid's name of the message, or one of its headers.
_KILOGRID_WORDS = re.compile(
    rb"\bIR_message_t\b|^[ \t]*#[ \t]*include[ \t]*[<\"](kilogrid|kilob_\w+)\.h[>\"]", re.MULTILINE
)


Api = Literal["kilobot", "kilogrid", "module"]
"""API that a program is written for: kilolib, the Kilogrid's flavour of it, or the module API."""
Runtime = Literal["original", "kilotwin"]
"""Runtime of a program: with the published library's traits, or ours (docs/hex_files.md)."""
Printf = Literal["integers", "floats"]
"""The `printf()` that an image is linked with: avr-libc's usual one, which prints `?` for a float,
or its larger one, which prints its digits."""
HEX_SUFFIXES = (".hex", ".ihex", ".ihx")
"""How names of Intel HEX files end, in small letters."""
_IMAGES = (*HEX_SUFFIXES, ".elf")

# A macro with its parameters, if it has some, and what it stands for.
_NAME = r"[A-Za-z_]\w*"
_MACRO = re.compile(
    rf"{_NAME}(\( *((({_NAME} *, *)*({_NAME}|\.\.\.))? *)\))?(=.*)?", re.ASCII | re.DOTALL
)

# Kilombo's Makefile defines this for the robot, and nothing for its simulator. Where a program asks
# for it, what it has for the robot is meant.
_FOR_THE_ROBOT = "KILOBOT"
_ASKS_FOR_IT = re.compile(rb"^[ \t]*#[ \t]*(?:if|ifdef|ifndef|elif)\b.*\bKILOBOT\b", re.MULTILINE)

# How main() of a program for each target ends.
_STARTS: "dict[Target, re.Pattern[bytes]]" = {
    "robot": re.compile(rb"\bkilo_start\s*\("),
    "module": re.compile(rb"\bmodule_start\s*\("),
}


class ProgramError(ValueError):
    """A program that cannot be used; `key` is the one to mend, of `[[robots]]`."""

    def __init__(self, what: str, key: str = "program") -> None:
        super().__init__(what)
        self.key = key


@dataclass(frozen=True)
class Program:
    """`parts` is how a run folder names its files, so that they are found again from anywhere."""

    parts: tuple[str, ...]
    path: Path  # of the folder, or of the first file
    sources: tuple[Path, ...]
    includes: tuple[str, ...] = ()  # as `parts`
    include_folders: tuple[Path, ...] = ()
    defines: tuple[str, ...] = ()
    api: Api = "kilobot"
    runtime: Runtime = "kilotwin"
    printf: Printf = "integers"

    @property
    def name(self) -> str:
        """Its usual name: the folder's or the first file's."""
        return self.path.stem if self.path.is_file() else self.path.name

    @property
    def written(self) -> str:
        """For messages."""
        return " ".join(self.parts)

    @property
    def target(self) -> "Target":
        """The target that it is to be built for."""
        return "module" if self.api == "module" else "robot"

    @property
    def runtime_defines(self) -> list[str]:
        """Compiler flags for the runtime's sources, not the program's."""
        library = "MODULE" if self.target == "module" else "KILOLIB"
        return [f"-D{library}_ORIGINAL=1"] if self.runtime == "original" else []

    @property
    def looks_like(self) -> "Target | None":
        """The target of its sources, if they have either kilo_start() or module_start()."""
        texts = [source.read_bytes() for source in self.sources]
        found = [target for target, start in _STARTS.items() if any(map(start.search, texts))]
        return found[0] if len(found) == 1 else None


def find_program(
    written: str | Sequence[str],
    beside: Path,
    includes: Sequence[str] = (),
    defines: Sequence[str] = (),
    api: Api | None = None,
) -> Program:
    """Looks from the current folder, beside the experiment file, and in what Kilotwin brings.

    For headers it looks beside the experiment file first. Without `api` it is a robot's program, in
    the Kilogrid's flavour if one of its .c files names IR_message_t or includes kilogrid.h or a
    kilob_*.h.

    ProgramError if something is missing.
    """
    parts = [written] if isinstance(written, str) else written
    paths = [_find(part, beside, "program", "a folder or a .c file") for part in parts]
    if len(paths) == 1 and paths[0].is_dir():
        sources = tuple(sorted(paths[0].glob("*.c")))
        if not sources:
            raise ProgramError(f"program '{parts[0]}' has no .c file in it; name a folder that has")
    else:
        for part, path in zip(parts, paths, strict=True):
            if path.is_dir():
                raise ProgramError(
                    f"program '{part}' is a folder; beside other files name .c files"
                )
            if not path.name.endswith(".c"):
                instead = "name a folder or a .c file"
                if path.suffix in (".hex", ".elf"):
                    instead = f"write hex = '{part}' in place of program"
                raise ProgramError(f"program '{part}' is not C source; {instead}")
        sources = tuple(paths)
    folders = [_find(name, beside, "include", "a folder") for name in includes]
    for define in defines:
        _check_define(define)
    api = api or _robot_api(sources)
    return Program(
        tuple(map(portable, paths)),
        paths[0],
        sources,
        tuple(map(portable, folders)),
        tuple(folders),
        (*defines, *_own_defines(api, sources, folders, defines)),
        api,
    )


def find_image(written: str, beside: Path) -> Program:
    """A .hex or .elf file, looked for where programs are; what is in it the engine checks."""
    path = _find(written, beside, "hex", "a .hex or .elf file")
    if path.is_dir() or key_of(path) != "hex":
        raise ProgramError(f"hex '{written}' is no .hex or .elf file; name one", "hex")
    return Program((portable(path),), path, ())


def key_of(file: Path) -> str | None:
    """The key of `[[robots]]` that names such a file; None if it is no program by its name."""
    if file.suffix == ".c":
        return "program"
    return "hex" if file.suffix.lower() in _IMAGES else None


def _own_defines(
    api: Api, sources: Sequence[Path], folders: Sequence[Path], defines: Sequence[str]
) -> Sequence[str]:
    """Macros that the field's Makefiles define for the robot, where a program asks for them. The
    Kilogrid's flavour has them in its headers."""
    named = {define.partition("=")[0] for define in defines}
    if api != "kilobot" or _FOR_THE_ROBOT in named:
        return ()
    around = dict.fromkeys([*(source.parent for source in sources), *folders])
    files = [*sources, *(header for folder in around for header in sorted(folder.glob("*.h")))]
    asks = any(_ASKS_FOR_IT.search(file.read_bytes()) for file in files if file.is_file())
    return (_FOR_THE_ROBOT,) if asks else ()


def _robot_api(sources: Sequence[Path]) -> Api:
    if any(_KILOGRID_WORDS.search(source.read_bytes()) for source in sources):
        return "kilogrid"
    return "kilobot"


def _find(written: str, beside: Path, key: str, wanted: str) -> Path:
    places = places_of(written, beside)
    if key == "include":
        places = places[::-1]
    found = next((place for place in places if place.exists()), None) or resources.find(written)
    if found is None:
        raise ProgramError(f"{key} '{written}' is not there; name {wanted}", key)
    return found.resolve()


def _check_define(define: str) -> None:
    if not _MACRO.fullmatch(define):
        what = f"'{define}' defines no macro; write NAME, NAME=value or NAME(a,b)=value"
        raise ProgramError(what, "define")


def portable(path: Path) -> str:
    """How a run folder names a file, so that it is found again from anywhere."""
    for root in resources.roots():
        if path.is_relative_to(root.resolve()):
            return path.relative_to(root.resolve()).as_posix()
    return str(path)
