"""An image for the ATmega328P as code of this computer, which the engine runs in its place.

The engine reads the image, the translator makes C of it, and the compiler that builds guests makes
a shared object of that. As with guests, results are kept under the hash of everything that went in,
and appear in one step.
"""

import hashlib
import os
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.programs.cache import Notify, building, cache_folder, is_built, keep
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import (
    LINK_FLAGS,
    Guest,
    compiler_version,
    find_compiler,
    run_tool,
)
from kilotwin.programs.translate import seam, translator

# Options for translations: -O1, since the program in it is optimised already, and what brings most
# of the speed of -O2 without its time: a better choice of what stays in this computer's registers.
_OPTIMISATION = ["-O1", "-fexpensive-optimizations", "-fcaller-saves"]
_FLAGS = [*_OPTIMISATION, "-w", "-fPIC", "-fvisibility=hidden"]
# Passes of gcc that take a third of its time here and make nothing faster. Clang has none of them.
_IDLE_PASSES = ["tree-dominator-opts", "thread-jumps", "if-conversion", "if-conversion2", "tree-ch"]
_INCLUDE = "emulator"
_HEADERS = [
    f"{_INCLUDE}/robots/translated/{name}"
    for name in ("code.h", "passes/counters.h", "passes/loops.h", "passes/pass.h")
]
# Files beside this one that a translation depends on.
_MAKERS = [
    *("counters.py", "instructions.py", "liveness.py", "loops.py"),
    *("registers.py", "statements.py", "taint.py", "seam.py", "translator.py"),
]
_KEY_CHARACTERS = 32


def translated(image: Path, notify: Notify = lambda _: None) -> Path | None:
    """The translation of a .hex or .elf file, from the cache if it is there; `notify` gets a line
    if not.

    None if there is no C compiler, or if the file is none that a robot or module could run: the
    engine says why when it loads it.
    """
    try:
        compiler = find_compiler()
        flash, eeprom = _emulator.flash_image(str(image))
    except (RunError, _emulator.EngineError):
        return None
    version = compiler_version(compiler)
    key = _key(version, flash, eeprom, None)
    file = _file(key, image.name)
    if not is_built(file, notify):
        with building(f"translating {image.name} for this computer", file.parent, notify):
            _build(compiler, _flags(version), translator.translate(flash, eeprom), file)
    return file


def translated_guest(
    program: Program, notify: Notify = lambda _: None, *, covered: bool = False
) -> Guest:
    """A robot's program, compiled as for the robot and translated, as a guest of the engine.

    `covered`: it marks what runs (programs/coverage/marks.py), and does all else as without.
    """
    image = build_image(program, notify)
    compiler = find_compiler()
    flash, eeprom = _emulator.flash_image(str(image.elf))
    met_at = seam.seam_of(image.elf, image.objects("program"))
    version = compiler_version(compiler)
    key = _key(version, flash, eeprom, met_at, covered=covered)
    file = _file(key, program.name)
    if not is_built(file, notify):
        with building(f"translating {program.written} for this computer", file.parent, notify):
            functions = seam.compiled_functions(image.elf)
            texts = translator.translate(flash, eeprom, met_at, functions, covered=covered)
            _build(compiler, _flags(version), texts, file)
    return Guest(program.name, file, key, f"{image.compiler}; {version}", image.elf)


def _file(key: str, name: str) -> Path:
    return cache_folder() / f"{key}-translation" / f"{name}.so"


def _key(
    version: str,
    flash: bytes,
    eeprom: dict[int, int],
    met_at: seam.Seam | None,
    *,
    covered: bool = False,
) -> str:
    words = [version, *_flags(version), *LINK_FLAGS, repr(met_at)]
    words += ["covered"] if covered else []
    digest = hashlib.sha256("\0".join(words).encode())
    makers = [Path(__file__).with_name(name) for name in _MAKERS]
    for file in [*map(resources.path, _HEADERS), *makers]:
        digest.update(file.read_bytes())
    digest.update(flash)
    digest.update(repr(sorted(eeprom.items())).encode())
    return digest.hexdigest()[:_KEY_CHARACTERS]


def _flags(version: str) -> list[str]:
    idle = () if "clang" in version else _IDLE_PASSES
    return [*_FLAGS, *(f"-fno-{name}" for name in idle)]


def _build(compiler: str, flags: list[str], texts: list[str], target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    include = f"-I{resources.path(_INCLUDE)}"
    failure = "the translation of machine code does not compile; this is a mistake of Kilotwin"
    with tempfile.TemporaryDirectory(prefix="kilotwin-") as scratch:

        def compile_one(number: int, text: str) -> str:
            source = Path(scratch) / f"{number}.c"
            source.write_text(text)
            made = str(source.with_suffix(".o"))
            run_tool([compiler, *flags, include, "-c", str(source), "-o", made], failure)
            return made

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            objects = list(pool.map(compile_one, range(len(texts)), texts))
        linked = Path(scratch) / "linked.so"
        run_tool([compiler, *LINK_FLAGS, "-o", str(linked), *objects], failure)
        keep(linked, target)
