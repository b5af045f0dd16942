"""Builds Kilotwin's boot loaders, of robots and of modules, and flash with one and an application.

The steps are those of `make firmware` and `make modules`, with the same bytes; a test compares.
As with programs, the result is kept under the hash of everything that went in.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from kilotwin.files import image_record, resources
from kilotwin.files.build_id import Target
from kilotwin.files.flash_image import read_hex
from kilotwin.files.flash_map import FLASH_BYTES, LOADER_BEGIN
from kilotwin.files.memories import write_memories
from kilotwin.programs.cache import (
    Notify,
    building,
    cache_folder,
    is_built,
    kept_folder,
    key_of,
    note_whole,
)
from kilotwin.programs.image.flags import avr_words
from kilotwin.programs.image.image import make_hex
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.native.guest import compiler_version, read_by, run_tool

NAME = "bootloader.hex"
_FAILURE = "Kilotwin's boot loader cannot be built; install kilotwin again"
_FIRMWARE, _MODULES = "firmware", "kilogrid_modules"
# Sources in the order in which make links them: a folder of the tree, its loader's own folders, and
# the list in firmware/avr.mk of what else that folder gives, which lies below the last one.
_PARTS: dict[Target, tuple[tuple[str, tuple[str, ...], str, str], ...]] = {
    "robot": (
        (_FIRMWARE, ("bootloader/core", "bootloader/avr"), "AVR_LOADER_SHARED", "kilolib/avr/"),
    ),
    "module": (
        (_MODULES, ("bootloader/avr", "bootloader/core"), "AVR_MODULE_LOADER", ""),
        (_FIRMWARE, (), "AVR_MODULE_LOADER_SHARED", ""),
    ),
}
_INCLUDES = {
    _FIRMWARE: ("-Ifirmware/kilolib/include",),
    _MODULES: (
        "-Ikilogrid_modules/runtime/include",
        "-Ifirmware/kilogrid/include",
        "-Ifirmware/kilolib/include",
        "-Ikilogrid_modules/protocol",
        "-iquotekilogrid_modules/runtime/avr",
    ),
}


@dataclass(frozen=True)
class _Source:
    """A file, and the flags that it is compiled with."""

    file: Path
    flags: tuple[str, ...]


def build_boot_loader(target: Target = "robot", notify: Notify = lambda _: None) -> Path:
    """The loader's .hex, from the cache if it is there; `notify` gets a line if it takes time."""
    compiler = avr_gcc()
    sources = _sources(target)
    folder = cache_folder() / f"{_key(compiler, sources)}-loader"
    if not is_built(folder, notify):
        with building("compiling the boot loader", folder, notify):
            _build(compiler, sources, folder)
    return folder / NAME


def with_boot_loader(
    application: Path, target: Target = "robot", notify: Notify = lambda _: None
) -> Path:
    """A .hex of a whole flash: the application in `application`, its image record, the loader.

    InputError if no loader could start the application.
    """
    loader = build_boot_loader(target, notify)
    content = application.read_bytes()
    key = hashlib.sha256(loader.read_bytes() + b"\0" + content).hexdigest()[:32]
    whole = cache_folder() / f"{key}-flash" / application.name
    if not is_built(whole, notify):
        section = read_hex(loader, range(LOADER_BEGIN, FLASH_BYTES)).content
        recorded = image_record.recorded({0: read_hex(application).content})
        with building("laying out the flash", whole.parent, notify):
            whole.parent.mkdir(parents=True, exist_ok=True)
            write_memories(whole, {**recorded, LOADER_BEGIN: section})
            note_whole(whole, whole)
    return whole


def _sources(target: Target) -> list[_Source]:
    found = []
    for tree, folders, more, below in _PARTS[target]:
        files = [file for folder in folders for file in resources.files(f"{tree}/{folder}/*.c")]
        files += [resources.path(f"{tree}/{below}{name}") for name in avr_words(more)]
        found += [_Source(file, (*_flags(), *_include_flags(tree))) for file in files]
    return found


def _flags() -> list[str]:
    names = ("AVR_CHIP", "AVR_DIALECT", "AVR_LOADER")
    return [word for name in names for word in avr_words(name)]


def _include_flags(tree: str) -> list[str]:
    """As _INCLUDES has them, with the folders where they are."""
    words = []
    for word in _INCLUDES[tree]:
        option = "-iquote" if word.startswith("-iquote") else "-I"
        words.append(f"{option}{resources.path(word.removeprefix(option))}")
    if tree == _MODULES:
        words.append(f"-I{resources.made()}")
    return words


def _link_flags() -> list[str]:
    return [*_flags(), *avr_words("AVR_LINK"), *avr_words("AVR_LOADER_LINK")]


def _key(compiler: str, sources: list[_Source]) -> str:
    words = [compiler_version(compiler), *_link_flags()]
    files: list[Path] = []
    for source in sources:
        words += source.flags
        files += read_by(compiler, [source.file], source.flags, _FAILURE)
    return key_of(words, files)


def _build(compiler: str, sources: list[_Source], folder: Path) -> None:
    with kept_folder(folder) as draft:
        objects = []
        for number, source in enumerate(sources):
            objects.append(str(draft / f"{number:03}-{source.file.stem}.o"))
            command = [compiler, *source.flags, "-c", str(source.file), "-o", objects[-1]]
            run_tool(command, _FAILURE)
        elf = draft / "bootloader.elf"
        run_tool([compiler, *_link_flags(), *objects, "-o", str(elf)], _FAILURE)
        make_hex(elf, draft / NAME, _FAILURE)
