"""The boot loader that goes into a robot beside its program."""

from dataclasses import dataclass, field
from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.files.flash_map import LOADER_BEGIN, Segments
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.boot_loader import build_boot_loader
from kilotwin.table.flash.image import has_loader, loader_of

KEEP, NONE = "keep", "none"
"""In place of a file: the one that is in the chip, or none at all."""


@dataclass(frozen=True)
class Loader:
    """Content of the boot section; `from_chip`: the one that is there already, written anew."""

    name: str
    segments: Segments = field(default_factory=dict)
    from_chip: bool = False
    ours: bool = False
    """Whether it starts what an image record describes (image_record.py)."""


def choose(written: str | None, application: Segments, notify: Notify = lambda _: None) -> Loader:
    """The loader that is wanted: `--loader`'s word or file, else ours, built if it has to be.

    InputError if the file is no loader, or the application brings one as well.
    """
    if has_loader(application):
        if written is not None:
            raise InputError(
                f"--loader {written}: the program's file brings a boot loader of its own; leave "
                "--loader out, or name a program alone"
            )
        return Loader("the file's own")
    if written == NONE:
        return Loader("none")
    if written == KEEP:
        return Loader("the one in the chip", from_chip=True)
    if written is not None:
        return Loader(written, loader_of(Path(written)))
    return Loader("Kilotwin's", loader_of(build_boot_loader(notify=notify)), ours=True)


def loader_in(flash: bytes) -> Segments:
    """Content of a chip's boot section; nothing if that is erased."""
    section = flash[LOADER_BEGIN:]
    return {LOADER_BEGIN: section} if section.strip(b"\xff") else {}
