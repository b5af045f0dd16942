"""An image for the ATmega328P as code of this computer, which the engine runs in its place.

The engine reads the image, the translator makes C of it, and a compiler makes a shared object of
that. tcc does so in hundredths of a second, gcc in seconds, for code that runs nearly twice as
fast. So a run begins with tcc's and takes gcc's when it is there (optimiser.py); both do the same,
cycle by cycle. As with guests, results are kept under the hash of everything that went in, and
appear in one step.
"""

import contextlib
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from kilotwin import _emulator
from kilotwin.errors import RunError
from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.programs.cache import (
    Notify,
    building,
    cache_folder,
    is_built,
    keep,
    kept_folder,
)
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import (
    LINK_FLAGS,
    Guest,
    compiler_version,
    find_compiler,
    run_tool,
)
from kilotwin.programs.translate import seam, translator
from kilotwin.programs.variant import Variant

# Options for gcc's code: -O1, since the program in it is optimised already, and what brings most
# of the speed of -O2 without its time: a better choice of what stays in this computer's registers.
_OPTIMISATION = ["-O1", "-fexpensive-optimizations", "-fcaller-saves"]
_FLAGS = ["-w", "-fPIC", "-fvisibility=hidden"]
# Passes of gcc that take a third of its time here and make nothing faster. Clang has none of them.
_IDLE_PASSES = ["tree-dominator-opts", "thread-jumps", "if-conversion", "if-conversion2", "tree-ch"]
_QUICK = "tcc"
# Without tcc a compiler that does not optimise takes a quarter of the time.
_UNOPTIMISED = ["-O0"]
_INCLUDE = "emulator"
_MAP = "emulator/robots/native/guest.map"
_HEADERS = [
    f"{_INCLUDE}/robots/translated/{name}"
    for name in (
        "code.h",
        "stack_macros.h",
        "watched.h",
        "routines/routines.h",
        "passes/counters.h",
        "passes/loops.h",
        "passes/pass.h",
    )
]
# Files beside this one that a translation depends on.
_MAKERS = [
    *("counters.py", "instructions.py", "liveness.py", "loops.py", "routines.py"),
    *("registers.py", "statements.py", "taint.py", "seam.py", "shared.py", "translator.py"),
]
_KEY_CHARACTERS = 32
OPTIMISED = "KILOTWIN_OPTIMISED"
"""The variable by which nothing runs before its faster code is there."""
_FAILURE = "the translation of machine code does not compile; this is a mistake of Kilotwin"


@dataclass(frozen=True)
class Code:
    """The shared object of a translation. `optimised`: where faster code of it will be, if this is
    what a compiler makes at once."""

    file: Path
    optimised: Path | None


def translated(
    image: Path, notify: Notify = lambda _: None, *, at_once: bool = True
) -> Code | None:
    """The translation of a .hex or .elf file, from the cache if it is there; `notify` gets a line
    if not. `at_once`: as a compiler makes it in a moment, unless faster code is there.

    None if there is no C compiler, or if the file is none that a robot or module could run: the
    engine says why when it loads it.
    """
    try:
        compiler = find_compiler()
        flash, eeprom = _emulator.flash_image(str(image))
    except (RunError, _emulator.EngineError):
        return None
    kept = _Kept(_key(compiler_version(compiler), flash, eeprom, None), image.name)
    what = f"translating {image.name} for this computer"
    return kept.code(lambda: translator.translate(flash, eeprom), what, notify, at_once=at_once)


def translated_guest(
    program: Program,
    notify: Notify = lambda _: None,
    *,
    variant: Variant = "plain",
    at_once: bool = True,
) -> Guest:
    """A robot's program, compiled as for the robot and translated, as a guest of the engine.

    `at_once`: as of translated().
    """
    image = build_image(program, notify)
    flash, eeprom = _emulator.flash_image(str(image.elf))
    original = program.runtime == "original"
    met_at = seam.seam_of(image.elf, image.objects("program"), original=original)
    version = compiler_version(find_compiler())
    key = _key(version, flash, eeprom, met_at, variant)

    def translate() -> list[str]:
        functions = seam.compiled_functions(image.elf)
        return translator.translate(flash, eeprom, met_at, functions, variant=variant)

    what = f"translating {program.written} for this computer"
    code = _Kept(key, program.name).code(translate, what, notify, at_once=at_once)
    return Guest(
        program.name,
        code.file,
        key,
        f"{image.compiler}; {version}",
        image.elf,
        # Marks are of the code that ran, and faster code reports nothing.
        code.optimised if variant == "plain" else None,
    )


def optimise(target: Path) -> None:
    """Makes the faster code of a translation whose C is in the cache, as Code.optimised names it:
    by the compiler of guests, one file after the other."""
    _build(sources_of(target), target, _OPTIMISATION, jobs=1)


@dataclass(frozen=True)
class _Kept:
    """A translation's place in the cache."""

    key: str
    name: str

    def code(
        self,
        translate: Callable[[], Sequence[str]],
        what: str,
        notify: Notify,
        *,
        at_once: bool,
    ) -> Code:
        """The code, from the cache or made; `translate` gives the C, `what` the line for that."""
        optimised = cache_folder() / f"{self.key}-translation" / f"{self.name}.so"
        if is_built(optimised, notify):
            return Code(optimised, None)
        at_once = at_once and not os.environ.get(OPTIMISED)
        quick = optimised.parent / "quick" / optimised.name
        if at_once and is_built(quick, notify):
            return Code(quick, optimised)
        with building(what, optimised.parent, notify):
            quick.parent.mkdir(parents=True, exist_ok=True)
            sources = sources_of(optimised)
            if not is_built(sources, notify):
                with kept_folder(sources) as draft:
                    for number, text in enumerate(translate()):
                        (draft / f"{number}.c").write_text(text)
            if not at_once:
                _build(sources, optimised, _OPTIMISATION)
                return Code(optimised, None)
            _build_at_once(sources, quick)
        return Code(quick, optimised)


def sources_of(target: Path) -> Path:
    """The C of a translation."""
    return target.parent / "source"


def _key(
    version: str,
    flash: bytes,
    eeprom: dict[int, int],
    met_at: seam.Seam | None,
    variant: Variant = "plain",
) -> str:
    words = [version, *_OPTIMISATION, *_flags_of(version), *LINK_FLAGS, repr(met_at), variant]
    digest = hashlib.sha256("\0".join(words).encode())
    makers = [Path(__file__).with_name(name) for name in _MAKERS]
    for file in [*map(resources.path, [_MAP, *_HEADERS]), *makers]:
        digest.update(file.read_bytes())
    digest.update(flash)
    digest.update(repr(sorted(eeprom.items())).encode())
    return digest.hexdigest()[:_KEY_CHARACTERS]


def _flags_of(version: str) -> list[str]:
    idle = () if "clang" in version else _IDLE_PASSES
    return [*_FLAGS, *(f"-fno-{name}" for name in idle)]


def _build_at_once(sources: Path, target: Path) -> None:
    tcc = shutil.which(_QUICK)
    if tcc is None:
        _build(sources, target, _UNOPTIMISED)
        return
    with _linked(target) as scratch:
        files = map(str, sorted(sources.glob("*.c")))
        made = str(scratch / "all.o")
        run_tool([tcc, "-w", "-r", _include(), *files, "-o", made], _FAILURE, confine=True)


def _build(
    sources: Path, target: Path, optimisation: Sequence[str], jobs: int | None = None
) -> None:
    compiler = find_compiler()
    flags = [*optimisation, *_flags_of(compiler_version(compiler)), _include()]
    with _linked(target) as scratch:

        def compile_one(source: Path) -> None:
            made = str(scratch / f"{source.stem}.o")
            command = [compiler, *flags, "-c", str(source), "-o", made]
            run_tool(command, _FAILURE, confine=True)

        files = sorted(sources.glob("*.c"))
        if jobs == 1:
            for source in files:
                compile_one(source)
            return
        # Few runs compile, and the rest start sooner without its threads' queues and logs.
        from concurrent.futures import ThreadPoolExecutor

        with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
            list(pool.map(compile_one, files))


@contextlib.contextmanager
def _linked(target: Path) -> Iterator[Path]:
    """A folder for objects, which are linked and kept when it is left."""
    with tempfile.TemporaryDirectory(prefix="kilotwin-") as made:
        scratch = Path(made)
        yield scratch
        linked, objects = str(scratch / "linked.so"), map(str, sorted(scratch.glob("*.o")))
        shown = f"-Wl,--version-script={resources.path(_MAP)}"
        run_tool([find_compiler(), *LINK_FLAGS, shown, "-o", linked, *objects], _FAILURE)
        keep(Path(linked), target)


def _include() -> str:
    return f"-I{resources.path(_INCLUDE)}"
