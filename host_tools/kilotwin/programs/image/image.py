"""Builds a robot's or a module's program for the ATmega328P, linked with its runtime.

A robot's is firmware/kilolib/core and avr; a module's is kilogrid_modules/runtime/core and avr,
with the parts that robots have as well. Flags and those parts stand in firmware/avr.mk, and the
steps are those of firmware/image.mk: `make firmware` gives the same bytes, and a test compares.

As with guests, results are kept under the hash of everything that went in, and appear in one step.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import kilotwin
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.files.build_id import BuildId, build_id
from kilotwin.programs import compiler_warnings
from kilotwin.programs.apis import APIS, wanted_helpers
from kilotwin.programs.cache import (
    Notify,
    building,
    cache_folder,
    copy_files,
    is_built,
    kept_folder,
    kept_objects,
    key_of,
)
from kilotwin.programs.image.flags import avr_words
from kilotwin.programs.image.image_size import RAM_BYTES
from kilotwin.programs.image.tools import avr_gcc
from kilotwin.programs.linking import ENGLISH, check_main, explained
from kilotwin.programs.native.guest import compiler_version, read_by, run_tool

_FLAGS = ("AVR_CHIP", "AVR_DIALECT", "AVR_DEBUG")
# Besides those of firmware/avr.mk: `kilotwin port` reads how deep the stack of a function is.
_REPORT_FLAGS = ["-fstack-usage"]
_WARNINGS = "warnings.json"
_RAM_BEGIN = 0x800100  # as avr-gcc numbers it
_BUILD_ID, _BUILD_ID_SCRIPT = "firmware/build_id.c", "firmware/build_id.ld"


@dataclass(frozen=True)
class Image:
    """A linked program. `folder` also holds its objects, with stack usage as .su files."""

    name: str
    folder: Path
    key: str
    compiler: str
    build_id: BuildId

    @property
    def elf(self) -> Path:
        """With symbols and lines."""
        return self.folder / f"{self.name}.elf"

    @property
    def hex(self) -> Path:
        """The bytes to flash, as a .hex file."""
        return self.folder / f"{self.name}.hex"

    @property
    def warnings(self) -> list[str]:
        """Those of the compiler about the program's own files, each with its lines."""
        return list(json.loads((self.folder / _WARNINGS).read_text()))

    def objects(self, part: str) -> list[Path]:
        """Object files of `program`, in the order of its sources, or of `kilolib`."""
        return sorted((self.folder / part).glob("*.o"))


@dataclass(frozen=True)
class Checks:
    """Checks of the compiler in the program's own code: its flags, and the linker's."""

    flags: tuple[str, ...] = ()
    link: tuple[str, ...] = ()


_NO_CHECKS = Checks()
# avr-libc's own words, of its page on vfprintf().
_PRINTF = {"integers": (), "floats": ("-Wl,-u,vfprintf", "-lprintf_flt")}


def _flags() -> list[str]:
    words = [word for name in _FLAGS for word in avr_words(name)]
    return [*words, *_REPORT_FLAGS]


def _link_flags() -> list[str]:
    script = resources.path(_BUILD_ID_SCRIPT)
    return [*avr_words("AVR_CHIP"), *avr_words("AVR_LINK"), f"-Wl,-T,{script}"]


def _build_id_flags(written: BuildId) -> list[str]:
    return [*_flags(), f'-DBUILD_ID="{written}"']


def program_flags(program: Program) -> list[str]:
    """Compiler flags for the program's own sources."""
    beside = [source.parent for source in program.sources]
    return [
        *_flags(),
        *APIS[program.api].includes(program.include_folders, beside=beside),
        *(f"-D{define}" for define in program.defines),
    ]


def build_image(
    program: Program, notify: Notify = lambda _: None, checks: Checks = _NO_CHECKS
) -> Image:
    """The image of `program`, from the cache if it is there; `notify` gets a line if not. With
    `checks` it is no image to flash.

    A program that does not compile is an InputError that carries the compiler's words.
    """
    compiler = avr_gcc()
    version = compiler_version(compiler)
    runtime = _runtime_of(program)
    written = build_id(program.target, program.name, version, kilotwin.__version__)
    key = _key(program, compiler, written, runtime, checks)
    image = Image(program.name, cache_folder() / f"{key}-avr", key, version, written)
    if not is_built(image.folder, notify):
        with building(f"compiling {program.written} for the ATmega328P", image.folder, notify):
            _build(program, compiler, runtime, image, notify, checks=checks)
        if warnings := image.warnings:
            notify(compiler_warnings.shown(warnings))
    return image


def _runtime_of(program: Program) -> list[Path]:
    core = resources.files("firmware/kilolib/core/*.c")
    kilolib = resources.path("firmware/kilolib/avr")
    if program.api != "module":
        return [*core, *sorted(kilolib.glob("*.c"))]
    modules = resources.path("kilogrid_modules")
    frames = [*modules.glob("protocol/*.c"), *resources.made().glob("*.c")]
    own = [*sorted(frames, key=lambda file: file.name), *sorted(modules.glob("runtime/*/*.c"))]
    return [*own, *core, *(kilolib / name for name in avr_words("AVR_SHARED"))]


def _failure(program: Program) -> str:
    return (
        f"{program.written}: does not compile for the {program.target}; mend what the compiler says"
    )


def _link(command: list[str], program: Program, objects: Sequence[Path]) -> None:
    failure = f"{program.written}: cannot be linked; mend what the linker says"
    try:
        run_tool(command, failure, ENGLISH, confine=True)
    except InputError as error:
        if too_much := _overflow(error.detail):
            raise RunError(
                f"{program.written}: does not fit into the robot: {too_much}; make tables and "
                "arrays smaller, or keep tables in flash (PROGMEM)",
                detail=error.detail,
            ) from None
        raise explained(error, program, "avr-nm", objects) from None


def _overflow(said: str) -> str:
    """The linker's error of a program that is too large, with the sizes; "" of others."""
    if end := re.search(r"address 0x([0-9a-f]+) .* is not within region `data'", said):
        ram = int(end[1], 16) - _RAM_BEGIN
        return f"its variables take {ram:,} bytes of RAM, of {RAM_BYTES:,}"
    if more := re.search(r"region `(\w+)' overflowed by (\d+) bytes", said):
        which = "flash" if more[1] == "text" else "RAM"
        return f"it takes {int(more[2]):,} bytes of {which} more than there are"
    return "it takes more flash and RAM than there are" if "not within region" in said else ""


def _key(
    program: Program,
    compiler: str,
    written: BuildId,
    runtime: Sequence[Path],
    checks: Checks,
) -> str:
    own, kilolib, helped = program_flags(program), _runtime_flags(program), _helper_flags(program)
    words = [str(written), *own, *kilolib, *helped, *_link_flags(), *compiler_warnings.FLAGS]
    words += [*checks.flags, *checks.link, *_PRINTF[program.printf]]
    files = [resources.path(_BUILD_ID_SCRIPT)]
    for sources, flags in (
        (program.sources, own),
        (runtime, kilolib),
        (APIS[program.api].helper_sources(), helped),
        ([resources.path(_BUILD_ID)], _build_id_flags(written)),
    ):
        files += read_by(compiler, sources, flags, _failure(program))
    return key_of(words, files)


def _runtime_flags(program: Program) -> list[str]:
    flags = [*_flags(), *avr_words("AVR_LIBRARY")]
    if program.api != "module":
        include = f"-I{resources.path('firmware/kilolib/include')}"
        return [*flags, include, *program.runtime_defines]
    modules = resources.path("kilogrid_modules")
    protocol = (modules / "protocol", resources.made())
    includes = [*APIS["module"].includes(), *(f"-I{folder}" for folder in protocol)]
    return [*flags, *includes, *program.runtime_defines]


def _helper_flags(program: Program) -> list[str]:
    return [*_flags(), *avr_words("AVR_LIBRARY"), *APIS[program.api].includes()]


def _build(
    program: Program,
    compiler: str,
    runtime: Sequence[Path],
    image: Image,
    notify: Notify,
    *,
    checks: Checks,
) -> None:
    failure = _failure(program)

    said: list[str] = []

    def compile_into(folder: Path, sources: Sequence[Path], flags: list[str]) -> list[Path]:
        objects = [folder / f"{k:03}-{source.stem}.o" for k, source in enumerate(sources)]
        for source, target in zip(sources, objects, strict=True):
            words = [compiler, *flags, "-c", str(source), "-o", str(target)]
            run_tool(words, failure, ENGLISH, confine=True, warned=said.append)
        return objects

    def kept_in(folder: Path, sources: Sequence[Path], flags: list[str]) -> list[Path]:
        """Objects that all programs have alike."""
        if not sources:
            return []
        words = [image.compiler, *flags, *map(str, sources)]
        files = read_by(compiler, sources, flags, failure)
        kept = kept_objects(words, files, lambda draft: compile_into(draft, sources, flags), notify)
        copy_files(kept, folder)
        return sorted(folder.glob("*.o"))

    with kept_folder(image.folder) as draft:
        for part in ("program", "kilolib", "helpers", "build_id"):
            (draft / part).mkdir()
        flags = [*program_flags(program), *compiler_warnings.FLAGS, *checks.flags]
        own = compile_into(draft / "program", program.sources, flags)
        warnings = compiler_warnings.own_warnings(program, "".join(said))
        (draft / _WARNINGS).write_text(json.dumps(warnings))
        check_main(program, "avr-nm", own)
        sources = APIS[program.api].helper_sources()
        helpers = kept_in(draft / "helpers", sources, _helper_flags(program))
        kilolib = kept_in(draft / "kilolib", runtime, _runtime_flags(program))
        sources = [resources.path(_BUILD_ID)]
        told = compile_into(draft / "build_id", sources, _build_id_flags(image.build_id))
        libraries = []
        for name, members in (
            ("helpers", wanted_helpers("avr-nm", own, helpers)),
            ("kilolib", kilolib),
        ):
            if members:
                libraries.append(str(draft / f"lib{name}.a"))
                run_tool(["avr-ar", "rcs", libraries[-1], *map(str, members)], failure)
        elf = draft / f"{image.name}.elf"
        linked = [*map(str, [*own, *told]), *libraries, *_PRINTF[program.printf], "-lm"]
        _link([compiler, *_link_flags(), *checks.link, *linked, "-o", str(elf)], program, own)
        make_hex(elf, draft / f"{image.name}.hex", failure)


def make_hex(elf: Path, target: Path, failure: str) -> None:
    """Writes the .hex of a linked program; `failure` is the error's text."""
    left_out = [word for name in avr_words("AVR_NOT_FLASHED") for word in ("-R", name)]
    run_tool(["avr-objcopy", "-O", "ihex", *left_out, str(elf), str(target)], failure)
