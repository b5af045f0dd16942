"""Builds a robot's or a module's program for the ATmega328P, linked with its runtime.

A robot's is firmware/kilolib/core and avr; a module's is kilogrid_modules/runtime/core and avr,
with the parts that robots have as well. Flags and those parts stand in firmware/avr.mk.

As with guests, results are kept under the hash of everything that went in, and appear in one step.
"""

import contextlib
import hashlib
import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kilotwin.build.apis import APIS, wanted_helpers
from kilotwin.build.avr_flags import avr_words
from kilotwin.build.guest import (
    Notify,
    building,
    cache_folder,
    compiler_version,
    prerequisites,
    run_tool,
)
from kilotwin.build.linking import ENGLISH, check_main, explained
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import Program
from kilotwin.files import resources

# Besides those of firmware/avr.mk: what `kilotwin port` reads of an image.
_REPORT_FLAGS = ["-gdwarf-2", "-fstack-usage"]
_MODULE_RUNTIME = ["runtime/core", "runtime/avr", "protocol"]


@dataclass(frozen=True)
class Image:
    """A program for the robot. `folder` also holds its objects, with stack usage as .su files."""

    name: str
    folder: Path
    key: str
    compiler: str

    @property
    def elf(self) -> Path:
        """With symbols and lines."""
        return self.folder / f"{self.name}.elf"

    @property
    def hex(self) -> Path:
        """The bytes to flash, as a .hex file."""
        return self.folder / f"{self.name}.hex"

    def objects(self, part: str) -> list[Path]:
        """Of `program`, in the order of its sources, or of `kilolib`."""
        return sorted((self.folder / part).glob("*.o"))


def avr_gcc() -> str:
    """The path of avr-gcc; RunError with the command that installs it if it is not there."""
    found = shutil.which("avr-gcc")
    if found is None:
        raise RunError("avr-gcc is not here; type: apt-get install gcc-avr avr-libc binutils-avr")
    return found


def _flags() -> list[str]:
    return [*avr_words("AVR_CHIP"), *avr_words("AVR_DIALECT"), *_REPORT_FLAGS]


def _link_flags() -> list[str]:
    return [*avr_words("AVR_CHIP"), *avr_words("AVR_LINK")]


def program_flags(program: Program) -> list[str]:
    """Compiler flags for the program's own sources."""
    beside = [source.parent for source in program.sources]
    return [
        *_flags(),
        *APIS[program.api].includes(program.include_folders, beside=beside),
        *(f"-D{define}" for define in program.defines),
    ]


def build_image(program: Program, notify: Notify = lambda _: None) -> Image:
    """The image of `program`, from the cache if it is there; `notify` gets a line if not.

    A program that does not compile is an InputError that carries the compiler's words.
    """
    compiler = avr_gcc()
    version = compiler_version(compiler)
    runtime = _runtime_of(program)
    key = _key(program, compiler, version, runtime)
    image = Image(program.name, cache_folder() / f"{key}-avr", key, version)
    if not image.folder.exists():
        with building(f"compiling {program.written} for the ATmega328P", image.folder, notify):
            _build(program, compiler, runtime, image)
    return image


def _runtime_of(program: Program) -> list[Path]:
    core = resources.files("firmware/kilolib/core/*.c")
    kilolib = resources.path("firmware/kilolib/avr")
    if program.api != "module":
        return [*core, *sorted(kilolib.glob("*.c"))]
    modules = resources.path("kilogrid_modules")
    own = [file for folder in _MODULE_RUNTIME for file in modules.glob(f"{folder}/*.c")]
    return [*sorted(own), *core, *(kilolib / name for name in avr_words("AVR_SHARED"))]


def _failure(program: Program) -> str:
    return f"{program.written}: does not compile for the robot; mend what the compiler says"


def _link(command: list[str], program: Program, objects: Sequence[Path]) -> None:
    failure = f"{program.written}: cannot be linked; mend what the linker says"
    try:
        run_tool(command, failure, ENGLISH)
    except InputError as error:
        if re.search(r"not within region|overflowed by", error.detail):
            raise RunError(
                f"{program.written}: does not fit into the robot's flash and RAM; make tables and "
                "arrays smaller, or keep tables in flash (PROGMEM)",
                detail=error.detail,
            ) from None
        raise explained(error, program, "avr-nm", objects) from None


def _key(program: Program, compiler: str, version: str, runtime: Sequence[Path]) -> str:
    own, kilolib, helped = program_flags(program), _runtime_flags(program), _helper_flags(program)
    words = [version, *own, *kilolib, *helped, *_link_flags()]
    digest = hashlib.sha256("\0".join(words).encode())
    helpers = APIS[program.api].helper_sources()
    for sources, flags in ((program.sources, own), (runtime, kilolib), (helpers, helped)):
        if not sources:
            continue
        rules = run_tool([compiler, *flags, "-w", "-MM", *map(str, sources)], _failure(program))
        for name in dict.fromkeys(prerequisites(rules)):
            digest.update(f"\0{name}\0".encode())
            digest.update(Path(name).read_bytes())
    return digest.hexdigest()[:32]


def _runtime_flags(program: Program) -> list[str]:
    flags = [*_flags(), "-ffunction-sections"]
    if program.api != "module":
        return [*flags, f"-I{resources.path('firmware/kilolib/include')}"]
    modules = resources.path("kilogrid_modules")
    return [*flags, *APIS["module"].includes(), f"-I{modules / 'protocol'}"]


def _helper_flags(program: Program) -> list[str]:
    return [*_flags(), "-ffunction-sections", *APIS[program.api].includes()]


def _build(program: Program, compiler: str, runtime: Sequence[Path], image: Image) -> None:
    image.folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(dir=image.folder.parent, prefix=f".{image.folder.name}-"))
    failure = _failure(program)
    try:
        parts = (
            ("program", program.sources, [*program_flags(program), "-w"]),
            ("kilolib", runtime, _runtime_flags(program)),
            ("helpers", APIS[program.api].helper_sources(), _helper_flags(program)),
        )
        objects: dict[str, list[str]] = {}
        for part, sources, flags in parts:
            (draft / part).mkdir()
            objects[part] = []
            for number, source in enumerate(sources):
                target = str(draft / part / f"{number:03}-{source.stem}.o")
                run_tool([compiler, *flags, "-c", str(source), "-o", target], failure)
                objects[part].append(target)
        own = list(map(Path, objects["program"]))
        check_main(program, "avr-nm", own)
        library, elf = str(draft / "libkilolib.a"), str(draft / f"{image.name}.elf")
        helpers = wanted_helpers("avr-nm", own, list(map(Path, objects["helpers"])))
        run_tool(["avr-ar", "rcs", library, *map(str, helpers), *objects["kilolib"]], failure)
        link = [compiler, *_link_flags(), *objects["program"], library, "-lm", "-o", elf]
        _link(link, program, own)
        target = str(draft / f"{image.name}.hex")
        run_tool(["avr-objcopy", "-O", "ihex", "-R", ".eeprom", elf, target], failure)
        # Another process may have been faster; its result is the same.
        with contextlib.suppress(FileExistsError, OSError):
            draft.replace(image.folder)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
