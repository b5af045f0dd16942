"""What programs are written against, and what is compiled with them: headers and helpers."""

import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from kilotwin import resources

# kilolib, the Kilogrid's flavour of it, or the module API.
Api = Literal["kilobot", "kilogrid", "module"]


@dataclass(frozen=True)
class ApiParts:
    """Folders and files of one API, as paths below the project's root."""

    headers: tuple[str, ...]
    """Where its headers are, in order."""
    helpers: tuple[str, ...] = ()
    """Sources, or patterns of them, that a program may use without bringing them."""
    own_headers_first: bool = False
    """The program's include folders come before `headers`: it may bring its own helpers."""

    def includes(self, own: Iterable[Path] = ()) -> list[str]:
        """`-I` options: of the API, and of the program's `own` folders."""
        headers = [f"-I{resources.path(folder)}" for folder in self.headers]
        folders = [f"-I{folder}" for folder in own]
        return [*folders, *headers] if self.own_headers_first else [*headers, *folders]

    def helper_sources(self) -> list[Path]:
        """The files of `helpers`."""
        return [file for pattern in self.helpers for file in resources.files(pattern)]


APIS: dict[Api, ApiParts] = {
    "kilobot": ApiParts(("firmware/kilolib/include",)),
    "kilogrid": ApiParts(
        ("firmware/kilogrid/include", "firmware/kilolib/include"),
        ("firmware/kilogrid/*.c",),
        own_headers_first=True,
    ),
    "module": ApiParts(
        (
            "kilogrid_modules/runtime/include",
            "firmware/kilogrid/include",
            "firmware/kilolib/include",
        ),
        ("firmware/kilogrid/kilo_rand_lib.c",),
        own_headers_first=True,
    ),
}


def wanted_helpers(nm: str, objects: Sequence[Path], helpers: Sequence[Path]) -> list[Path]:
    """The compiled `helpers` of which the program's `objects` define nothing themselves.

    An archive alone does not say so: a variable without a value, which avr-gcc makes common, would
    pull ours in beside the program's own.
    """
    own = _defined(nm, objects) if helpers else set()
    return [helper for helper in helpers if not own & _defined(nm, [helper])]


def _defined(nm: str, objects: Sequence[Path]) -> set[str]:
    done = subprocess.run(
        [nm, "-g", "--defined-only", "-P", *objects], capture_output=True, text=True, check=True
    )
    # With several files a line that ends in a colon names each.
    return {line.split()[0] for line in done.stdout.splitlines() if " " in line}
