"""Builds Kilotwin's boot loader for robots, and flash content with it and an application.

The steps are those of firmware/Makefile: `make firmware` gives the same bytes, and a test compares.
As with programs, the result is kept under the hash of everything that went in.
"""

import contextlib
import hashlib
import shutil
import tempfile
from pathlib import Path

from kilotwin.build.avr import avr_gcc
from kilotwin.build.avr_flags import avr_words
from kilotwin.build.guest import (
    Notify,
    building,
    cache_folder,
    compiler_version,
    prerequisites,
    run_tool,
)
from kilotwin.files import image_record, resources
from kilotwin.files.flash_image import read_hex
from kilotwin.files.flash_map import FLASH_BYTES, LOADER_BEGIN
from kilotwin.files.memories import write_memories

NAME = "bootloader.hex"
_SHARED = "firmware/kilolib/avr"
_FAILURE = "Kilotwin's boot loader cannot be built; install kilotwin again"


def build_boot_loader(notify: Notify = lambda _: None) -> Path:
    """The loader's .hex, from the cache if it is there; `notify` gets a line if it takes time."""
    compiler = avr_gcc()
    sources = _sources()
    folder = cache_folder() / f"{_key(compiler, sources)}-loader"
    if not folder.exists():
        with building("compiling the boot loader", folder, notify):
            _build(compiler, sources, folder)
    return folder / NAME


def with_boot_loader(application: Path, notify: Notify = lambda _: None) -> Path:
    """A .hex of a whole flash: the application in `application`, its image record, the loader.

    InputError if no loader could start the application.
    """
    loader = build_boot_loader(notify)
    content = application.read_bytes()
    key = hashlib.sha256(loader.read_bytes() + b"\0" + content).hexdigest()[:32]
    whole = cache_folder() / f"{key}-flash" / application.name
    if not whole.exists():
        section = read_hex(loader, range(LOADER_BEGIN, FLASH_BYTES)).content
        recorded = image_record.recorded({0: read_hex(application).content})
        with building("laying out the flash", whole.parent, notify):
            whole.parent.mkdir(parents=True, exist_ok=True)
            write_memories(whole, {**recorded, LOADER_BEGIN: section})
    return whole


def _sources() -> list[Path]:
    shared = resources.path(_SHARED)
    return [
        *resources.files("firmware/bootloader/core/*.c"),
        *resources.files("firmware/bootloader/avr/*.c"),
        *(shared / name for name in avr_words("AVR_LOADER_SHARED")),
    ]


def _flags() -> list[str]:
    names = ("AVR_CHIP", "AVR_DIALECT", "AVR_LOADER")
    return [word for name in names for word in avr_words(name)]


def _compile_flags() -> list[str]:
    return [*_flags(), f"-I{resources.path('firmware/kilolib/include')}"]


def _link_flags() -> list[str]:
    return [*_flags(), *avr_words("AVR_LINK"), *avr_words("AVR_LOADER_LINK")]


def _key(compiler: str, sources: list[Path]) -> str:
    words = [compiler_version(compiler), *_compile_flags(), *_link_flags()]
    digest = hashlib.sha256("\0".join(words).encode())
    rules = run_tool([compiler, *_compile_flags(), "-MM", *map(str, sources)], _FAILURE)
    for name in dict.fromkeys(prerequisites(rules)):
        digest.update(f"\0{name}\0".encode())
        digest.update(Path(name).read_bytes())
    return digest.hexdigest()[:32]


def _build(compiler: str, sources: list[Path], folder: Path) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
    try:
        objects = []
        for number, source in enumerate(sources):
            objects.append(str(draft / f"{number:03}-{source.stem}.o"))
            run_tool([compiler, *_compile_flags(), "-c", str(source), "-o", objects[-1]], _FAILURE)
        elf = str(draft / "bootloader.elf")
        run_tool([compiler, *_link_flags(), *objects, "-o", elf], _FAILURE)
        left_out = [word for name in avr_words("AVR_NOT_FLASHED") for word in ("-R", name)]
        command = ["avr-objcopy", "-O", "ihex", *left_out, elf, str(draft / NAME)]
        run_tool(command, _FAILURE)
        # Another process may have been faster; its result is the same.
        with contextlib.suppress(FileExistsError, OSError):
            draft.replace(folder)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
