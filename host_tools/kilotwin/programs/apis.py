"""APIs that programs are written against, and sources compiled with them: headers, helpers."""

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kilotwin.experiment.programs import Api
from kilotwin.files import resources


@dataclass(frozen=True)
class ApiParts:
    """Folders and files of one API, as paths below the project's root."""

    headers: tuple[str, ...]
    """Where its headers are, in order."""
    start: str
    """The calls that a program's main() must make."""
    helpers: tuple[str, ...] = ()
    """Sources, or patterns of them, that a program may use without bringing them."""
    own_headers_first: bool = False
    """All that a program brings comes before `headers`: it may bring its own helpers."""

    def includes(
        self, own: Sequence[Path] = (), libc: Sequence[Path] = (), beside: Sequence[Path] = ()
    ) -> list[str]:
        """`-I` options: of the API, of the program's `own` folders, and of those of its sources.

        Its own headers, a debug.h for instance, come first. But a kilolib.h may be made for some
        simulator. What lies `beside` the sources is meant by "time.h", and not by <time.h>.
        """
        headers = [resources.path(folder) for folder in self.headers]
        if self.own_headers_first:
            order = [*beside, *own, *headers, *libc]
        else:
            others = [folder for folder in own if (folder / "kilolib.h").exists()]
            first = [folder for folder in own if folder not in others]
            order = [*first, *headers, *others, *libc, *beside]
        return [f"-I{folder}" for folder in dict.fromkeys(order)]

    def helper_sources(self) -> list[Path]:
        """The files of `helpers`."""
        return [file for pattern in self.helpers for file in resources.files(pattern)]


_ROBOTS_START = "kilo_init() and kilo_start(setup, loop)"

APIS: dict[Api, ApiParts] = {
    "kilobot": ApiParts(("firmware/kilolib/include",), _ROBOTS_START),
    "kilogrid": ApiParts(
        ("firmware/kilogrid/include", "firmware/kilolib/include"),
        _ROBOTS_START,
        ("firmware/kilogrid/*.c",),
        own_headers_first=True,
    ),
    "module": ApiParts(
        (
            "kilogrid_modules/runtime/include",
            "firmware/kilogrid/include",
            "firmware/kilolib/include",
        ),
        "module_init() and module_start(setup, loop)",
        ("firmware/kilogrid/kilo_rand_lib.c",),
        own_headers_first=True,
    ),
}


def wanted_helpers(nm: str, objects: Sequence[Path], helpers: Sequence[Path]) -> list[Path]:
    """The compiled `helpers` of which the program's `objects` define nothing themselves.

    An archive alone does not show it: a variable without a value, which avr-gcc makes common, would
    pull ours in beside the program's own.
    """
    own = defined_symbols(nm, objects) if helpers else set()
    return [helper for helper in helpers if not own & defined_symbols(nm, [helper])]


def defined_symbols(nm: str, objects: Sequence[Path]) -> set[str]:
    """Symbols that compiled `objects` define for others."""
    return _symbols([nm, "-g", "--defined-only"], objects)


def missing_symbols(nm: str, objects: Sequence[Path]) -> set[str]:
    """Symbols that compiled `objects` want from others."""
    return _symbols([nm, "-u"], objects)


def _symbols(nm: Sequence[str], objects: Sequence[Path]) -> set[str]:
    done = subprocess.run([*nm, "-P", *objects], capture_output=True, text=True, check=True)
    # With several files a line that ends in a colon names each.
    return {line.split()[0] for line in done.stdout.splitlines() if " " in line}
