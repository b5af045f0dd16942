"""Builds a program into a guest: a shared object with the thin half of the mock API in it.

Robot programs get the mock of the Kilobot API, module programs that of the Kilogrid module API.
Programs written for the Kilogrid also get its helper sources, as far as they do not bring their
own.

Sources stay as they are. A program is compiled once, and what it is linked with once for all
programs (cache.py).
"""

import contextlib
import errno
import os
import re
import shlex
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.programs import linking
from kilotwin.programs.apis import APIS, defined_symbols, missing_symbols, wanted_helpers
from kilotwin.programs.cache import (
    Notify,
    building,
    cache_folder,
    is_built,
    keep,
    kept_objects,
    key_of,
)
from kilotwin.programs.confined_tools import CANNOT_START, confined, scratch_of
from kilotwin.programs.image.flags import avr_words, clock_define
from kilotwin.programs.includes import files_read
from kilotwin.programs.native import look, period

# Besides the robot's dialect, and nothing that would make results differ between compilers.
_FLAGS = [
    "-g",
    "-w",
    "-fPIC",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-fno-delete-null-pointer-checks",  # address 0 is as good as another on an AVR
]
_UNKNOWN_TO_CLANG = ["-funsigned-bitfields"]  # words of the dialect
# So that the engine notices a busy-wait, clang counts the program's basic blocks (and leaves out no
# counters that follow from others: some endless loops have only those), and gcc's assembler the
# turns of its loops, by count_loops.h, which needs the room below the stack.
_CLANG_PROGRAM_FLAGS = [
    "-fsanitize-coverage=trace-pc,no-prune",
    "-Wno-incompatible-function-pointer-types",
    "-Wno-unknown-warning-option",
    "-Wno-return-mismatch",
]
# Only a loop whose number of turns is known where it begins is unrolled: it is no busy-wait. Jumps
# that are counted stay within a section, so that the bytes between are known.
_GCC_PROGRAM_FLAGS = [
    "-mno-red-zone",
    "-fcf-protection=none",
    "-funroll-loops",
    "-fno-reorder-blocks-and-partition",
]
# An older one would warn of it beneath a program's own errors.
_GCC_14_PROGRAM_FLAGS = ["-Wno-return-mismatch"]
# Calls at the begin of each basic block, for coverage; clang's make them already.
_COVERED_FLAGS = ["-O0", "-fsanitize-coverage=trace-pc"]
COVERED_BYTES = 0x40000
"""Addresses from 0 on that are marked: more than the code of any robot's program has here."""
_COVERED_SIDE = [f"-DKT_COVERED={COVERED_BYTES}"]
# Macros that avr-gcc defines for the robot's processor, and those only a PC's compiler defines.
_ROBOT_MACROS = [
    "-DAVR=1",
    "-D__AVR=1",
    "-D__AVR__=1",
    "-D__AVR_ARCH__=5",
    "-D__AVR_ATmega328P__=1",
    "-D__AVR_MEGA__=1",
    # Words of avr-gcc's own: flash is ordinary memory here, and three bytes are four.
    "-D__FLASH=1",
    "-D__flash=",
    "-D__memx=",
    "-D__int24=__INT32_TYPE__",
    "-D__uint24=__UINT32_TYPE__",
    *(f"-U{name}" for name in ("linux", "__linux", "__linux__", "__gnu_linux__")),
    *(f"-U{name}" for name in ("unix", "__unix", "__unix__")),
]
MAIN = "kt_guest_main"
# Functions that compilers call of themselves.
_COMPILERS_OWN = {"memcpy", "memset", "memmove", "memcmp", "__stack_chk_fail"}
# avr-gcc 5 takes a variable that several files define without a value for one variable, and only
# warns of what later compilers refuse.
_PROGRAM_FLAGS = [
    "-fcommon",
    "-Wno-implicit-function-declaration",
    "-Wno-implicit-int",
    "-Wno-int-conversion",
    "-Wno-incompatible-pointer-types",
    "-Wno-return-type",
    f"-Dmain={MAIN}",
]
# An `inline` function that was inlined on the robot may not be here, and then it is missing.
_INLINE_FLAGS = ["-fgnu89-inline"]
# Labs write their helpers that way.
_INLINE_FIRST = {"kilogrid", "module"}
# Flags for a shared object in which nothing runs when it is loaded, as the engine wants it
# (emulator/robots/native/guest_file.h).
LINK_FLAGS = ["-shared", "-nostartfiles", "-Wl,-z,now", "-Wl,-z,defs", "-Wl,-z,noexecstack"]
LINK_FLAGS += ["-Wl,--hash-style=sysv"]
_SHARED_FLAGS = [*LINK_FLAGS, "-Wl,-Bsymbolic"]

# A tool's wall time; what it computes is limited by emulator/base/confinement.h.
_LONGEST_S = 600.0
_MOST_ERRORS = 1 << 16  # bytes
# Messages of compilers at those limits.
_OUT_OF_LIMITS = re.compile(
    r"terminated program|virtual memory exhausted|out of memory|Cannot allocate memory"
    r"|limit exceeded|File too large"
)
_KILLED = re.compile(r"Killed signal terminated|CPU time limit exceeded")

# A change of a program's preprocessed text; gets the folders of headers that are not the program's.
_Change = Callable[[str, Sequence[str]], str]


# Files of the thin half that only the guests of one kind have.
_SIDE_OF = dict.fromkeys(
    ["kilobot.c", "message_tx.c", "sensor_functions.c", "settled_period.c", "tx_period.c"],
    "kilobot",
) | dict.fromkeys(["module.c", "module_debug.c", "module_send.c"], "module")
# Files of the robot's runtime that run on the guest's side, in robots' and in modules' guests.
_CORE = ("calibration.c", "message_crc.c", "random_soft.c")


@dataclass(frozen=True)
class Guest:
    """A built program. `key` is the hash of all that went into it; `symbols` has its debug
    information, None where there is none. `optimised`: where faster code that does the same will
    be, if this is what a compiler makes at once (translate/translation.py)."""

    name: str
    file: Path
    key: str
    compiler: str
    symbols: Path | None = None
    optimised: Path | None = None


def build(
    program: Program,
    notify: Notify = lambda _: None,
    flags: Sequence[str] = (),
    *,
    covered: bool = False,
) -> Guest:
    """The guest of `program`, from the cache if it is there; `notify` gets a line if not.

    `flags` are further ones of the compiler, for the program's own sources. `covered`: it marks
    what runs (programs/coverage/native_lines.py), each statement by itself.

    A program that does not compile is an InputError that carries the compiler's words.
    """
    compiler = find_compiler()
    version = compiler_version(compiler)
    flags = [*flags, *(_COVERED_FLAGS if covered else ())]
    more_of_side = _COVERED_SIDE if covered else ()
    builder = Builder(program, compiler, version, flags, more_of_side, notify=notify)
    key = builder.key()
    file = cache_folder() / key / f"{program.name}.so"
    if not is_built(file, notify):
        with building(f"compiling {program.written}", file.parent, notify):
            file.parent.mkdir(parents=True, exist_ok=True)
            builder.build(file)
            look.note_missing_returns(program, builder, file)
    if missing := look.missing_returns(file):
        notify(missing)
    return Guest(program.name, file, key, version, file)


def find_compiler() -> str:
    """$KILOTWIN_CC, else gcc, else clang."""
    wanted = os.environ.get("KILOTWIN_CC")
    for name in [wanted] if wanted else ["gcc", "clang"]:
        found = shutil.which(name)
        if found:
            return found
    if wanted:
        raise InputError(f"KILOTWIN_CC={wanted}: there is no such compiler; unset it or install it")
    raise RunError("no C compiler is here to build robot programs; type: apt-get install gcc")


def compiler_version(compiler: str) -> str:
    """The first line of its --version."""
    return run_tool([compiler, "--version"], "the compiler does not start").splitlines()[0]


def _major(version: str) -> int:
    """12 of "gcc (Debian 12.2.0-14) 12.2.0"; 0 of a compiler that does not print it."""
    number = re.search(r"(\d+)\.\d+(\.\d+)?$", version)
    return int(number[1]) if number else 0


class Builder:
    """Paths and flags of one build."""

    def __init__(
        self,
        program: Program,
        compiler: str,
        version: str,
        more: Sequence[str] = (),
        more_of_side: Sequence[str] = (),
        *,
        notify: Notify = lambda _: None,
    ) -> None:
        self._program = program
        self._notify = notify
        self._compiler = compiler
        self._version = version
        self._guest = resources.path("emulator/robots/native")
        api = APIS[program.api]
        kind = "module" if program.api == "module" else "kilobot"
        self._side = [
            file
            for file in resources.files("emulator/robots/native/side/*.c")
            if _SIDE_OF.get(file.name, kind) == kind
        ]
        core = resources.path("firmware/kilolib/core")
        self._side += [core / name for name in _CORE]
        self._helpers = api.helper_sources()
        self._headers = [str(self._guest), *(word[2:] for word in api.includes())]
        libc = [self._guest / "include"]
        headers = api.includes(libc=libc)
        beside = [source.parent for source in program.sources]
        self._extra = extra = shlex.split(os.environ.get("KILOTWIN_CFLAGS", ""))
        unknown = _UNKNOWN_TO_CLANG if "clang" in version else ()
        dialect = [word for word in avr_words("AVR_DIALECT") if word not in unknown]
        flags = [*dialect, clock_define(), *_FLAGS]
        defines = [f"-D{define}" for define in program.defines]
        counted = [*_PROGRAM_FLAGS, *_ROBOT_MACROS]
        counted += ["-include", str(self._guest / "avr_assembly.h")]
        if "clang" in version:
            counted += _CLANG_PROGRAM_FLAGS
        else:
            counted += [*_GCC_PROGRAM_FLAGS, "-include", str(self._guest / "count_loops.h")]
            counted += _GCC_14_PROGRAM_FLAGS if _major(version) >= 14 else []
        self._program_flags = [
            *flags,
            *api.includes(program.include_folders, libc, beside),
            *counted,
            *defines,
            *more,
            *extra,
        ]
        # Ours, by our own headers, whatever the program brings.
        self._helper_flags = [*flags, *headers, *counted, *extra]
        # gcc would make our calloc() call itself.
        self._side_flags = [
            *flags,
            *headers,
            "-fno-common",
            "-fno-builtin",
            f"-I{self._guest}",
            *("-include", str(self._guest / "side/core_names.h")),
            *program.runtime_defines,
            *more_of_side,
            *extra,
        ]

    def said_of(self, warning: str, *how: str) -> str:
        """The compiler's words on the program's own sources with one warning; `how`: flags in place
        of those for an object. What does not compile says nothing."""
        kept = [word for word in self._program_flags if word not in ("-w", f"-Wno-{warning}")]
        said: list[str] = []
        for source in self._program.sources:
            command = [self._compiler, *kept, f"-W{warning}", *how, str(source)]
            with contextlib.suppress(InputError):
                run_tool(command, "", linking.ENGLISH, confine=True, warned=said.append)
        return "".join(said)

    def key(self) -> str:
        """The hash of compiler, flags, and every file that is read, or may be."""
        words = [
            self._version,
            *self._program_flags,
            *self._helper_flags,
            *self._side_flags,
            *_SHARED_FLAGS,
            *period.FLAGS,
        ]
        files = [
            *self._read_by(self._program.sources, self._program_flags),
            *self._ours(),
            self._guest / "merge.ld",
            self._guest / "guest.map",
        ]
        return key_of(words, files)

    def build(self, target: Path) -> None:
        """Compiles, merges all state into one section, links, and shows the result at once."""
        ways: list[list[str]] = [[], _INLINE_FLAGS]
        if self._program.api in _INLINE_FIRST:
            ways.reverse()
        try:
            self._build(target, ways[0])
        except InputError:
            from kilotwin.programs.native.robot_assembly import without_assembly
            from kilotwin.programs.native.robot_widths import with_robots_widths

            others: list[tuple[list[str], list[_Change]]] = [
                (ways[1], []),
                (ways[0], [with_robots_widths]),
            ]
            if self._has_assembly(without_assembly):
                others += [(ways[0], [without_assembly]), (ways[1], [without_assembly])]
                others += [(ways[0], [with_robots_widths, without_assembly])]
            for flags, changes in others:
                with contextlib.suppress(InputError):
                    return self._build(target, flags, changes)
            raise

    def _has_assembly(self, without_assembly: _Change) -> bool:
        with contextlib.suppress(InputError):
            return any(
                text != without_assembly(text, self._headers)
                for text in map(self._preprocessed, self._program.sources)
            )
        return False

    def _build(self, target: Path, more_flags: list[str], changes: Sequence[_Change] = ()) -> None:
        with tempfile.TemporaryDirectory(prefix="kilotwin-") as scratch:
            work = Path(scratch)
            flags = [*self._program_flags, *more_flags]
            sources = self._program.sources
            if changes:
                sources = self._changed(sources, changes, work / "changed")
            objects = self._compile(sources, flags, work / "program")
            linking.check_main(self._program, "nm", objects, MAIN)
            linking.check_absent(self._program, "nm", objects)
            helpers = wanted_helpers("nm", objects, self._kept(self._helpers, self._helper_flags))
            side = self._kept(self._side, self._side_flags)
            library, merged = work / "libside.a", work / "merged.o"
            # From an archive only what is missing comes along: malloc's heap is state that few
            # need, and a program may bring its own helpers.
            self._tool(["ar", "rc", library, *helpers, *side])
            # -d gives common variables their place here, in the state.
            merge = ["-r", "-nostdlib", "-Wl,-d", "-u", "kt_table"]
            names_period = period.PERIOD in missing_symbols("nm", objects)
            if (
                names_period
                and not helpers
                and self._settles_period(sources, flags, objects, side, work / "period")
            ):
                merge += ["-u", "kt_settled_period"]
            merge += ["-T", str(self._guest / "merge.ld")]
            self._tool([self._compiler, *merge, "-o", merged, *objects, library])
            version_script = f"-Wl,--version-script={self._guest / 'guest.map'}"
            linked = work / "linked.so"
            try:
                link = [self._compiler, *_SHARED_FLAGS, version_script]
                self._tool([*link, "-o", linked, merged, "-lm"], linking.ENGLISH)
            except InputError as error:
                raise linking.explained(error, self._program, "nm", objects) from None
            keep(linked, target)

    def _settles_period(
        self,
        sources: Sequence[Path],
        flags: list[str],
        objects: Sequence[Path],
        side: Sequence[Path],
        folder: Path,
    ) -> bool:
        """Whether the program cannot change kilo_tx_period after its set-up."""
        try:
            plain = self._compile(sources, [*flags, *period.FLAGS], folder)
            code = self._tool(["objdump", "-drw", "--no-show-raw-insn", *plain], linking.ENGLISH)
            data = self._tool(["objdump", "-rw", *plain], linking.ENGLISH)
        except InputError:
            return False
        known = missing_symbols("nm", objects) | defined_symbols("nm", side) | _COMPILERS_OWN
        functions = period.functions_of(self._tool(["nm", "-P", *plain]))
        return period.is_settled(code, data, functions, missing_symbols("nm", plain) - known)

    def _changed(
        self, sources: Sequence[Path], changes: Sequence[_Change], folder: Path
    ) -> tuple[Path, ...]:
        folder.mkdir()
        changed = []
        for number, source in enumerate(sources):
            text = self._preprocessed(source)
            for change in changes:
                text = change(text, self._headers)
            changed.append(folder / f"{number}-{source.stem}.i")
            changed[-1].write_text(text)
        return tuple(changed)

    def _preprocessed(self, source: Path) -> str:
        return self._tool([self._compiler, *self._program_flags, "-E", source])

    def _kept(self, sources: Sequence[Path], flags: list[str]) -> list[Path]:
        """Objects of sources of ours, which are the same for all programs."""
        if not sources:
            return []
        words = [self._version, *flags, *map(str, sources)]
        folder = kept_objects(
            words,
            self._ours(),
            lambda draft: self._compile(sources, flags, draft),
            self._notify,
        )
        return sorted(folder.glob("*.o"))

    def _compile(self, sources: Sequence[Path], flags: list[str], folder: Path) -> list[Path]:
        # Few runs compile, and the rest start sooner without its threads' queues and logs.
        from concurrent.futures import ThreadPoolExecutor

        folder.mkdir(exist_ok=True)

        def compile_one(number: int, source: Path) -> Path:
            target = folder / f"{number:03}-{source.stem}.o"
            self._tool([self._compiler, *flags, "-c", source, "-o", target])
            return target

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(compile_one, range(len(sources)), sources))

    def _ours(self) -> list[Path]:
        """The thin half, the helpers, and every header that they may read.

        That is more than they do read: the compiler takes 100 ms to say which.
        """
        if self._extra:  # may name others
            helpers = self._read_by(self._helpers, self._helper_flags) if self._helpers else []
            return [*helpers, *self._read_by(self._side, self._side_flags)]
        beside = [source.parent for source in (*self._helpers, *self._side)]
        core = [resources.path(f"kilogrid_modules/runtime/{part}") for part in ("core", "include")]
        folders = dict.fromkeys([*map(Path, self._headers), *beside, *core])
        headers = dict.fromkeys(file for folder in folders for file in sorted(folder.rglob("*.h")))
        return [*self._helpers, *self._side, *headers]

    def _read_by(self, sources: Sequence[Path], flags: list[str]) -> list[Path]:
        failure, plain = self._failure(), not self._extra
        return read_by(self._compiler, sources, flags, failure, plain=plain)

    def _failure(self) -> str:
        return f"{self._program.written}: does not compile; mend what the compiler says"

    def _tool(
        self, command: Sequence[str | Path], environment: Mapping[str, str] | None = None
    ) -> str:
        return run_tool(
            [str(word) for word in command],
            self._failure(),
            environment,
            confine=command[0] == self._compiler,
        )


def read_by(
    compiler: str,
    sources: Sequence[Path],
    flags: Sequence[str],
    failure: str,
    *,
    plain: bool = True,
) -> list[Path]:
    """The sources and every header of ours or the program's that they include, or may.

    `plain`: the flags name headers and their folders by -I, -iquote and -include alone. `failure`:
    as of run_tool().
    """
    told = files_read(sources, flags) if plain else None
    if told is not None:
        return told
    rules = run_tool([compiler, *flags, "-MM", *map(str, sources)], failure, confine=True)
    return list(dict.fromkeys(Path(name) for name in prerequisites(rules)))


def prerequisites(make_rules: str) -> list[str]:
    """The names after each colon of make rules as `cc -M` writes them.

    Spaces, # and $ are escaped.
    """
    names: list[str] = []
    for rule in make_rules.replace("\\\n", " ").splitlines():
        _, _, right = rule.partition(": ")
        words = re.findall(r"(?:\\.|\S)+", right)
        names += [re.sub(r"\\([ #])", r"\1", word).replace("$$", "$") for word in words]
    return names


def run_tool(
    command: list[str],
    failure: str,
    environment: Mapping[str, str] | None = None,
    *,
    confine: bool = False,
    warned: Callable[[str], object] = lambda _: None,
) -> str:
    """Output of a tool; `warned` gets what else it says. Its error becomes an InputError that
    begins with `failure`.

    `environment` comes on top of ours. `confine`: it is a compiler, which reads the program's
    folders, our headers and the system's, no other file.
    """
    own = {"TMPDIR": scratch_of(command)} if confine else {}
    done = _done(
        confined(command) if confine else command,
        {**os.environ, **own, **(environment or {})},
        Path(command[0]).name,
    )
    if done.returncode == 0:
        warned(done.stderr)
        return done.stdout
    if os.strerror(errno.ENOSPC) in done.stderr:
        raise RunError(
            f"{tempfile.gettempdir()}: no space left on device to compile in; make room, or set "
            "TMPDIR to another folder"
        )
    if confine and done.returncode == CANNOT_START:
        raise RunError(
            "the compiler cannot be confined; see it yourself, or add --trust",
            detail=done.stderr.rstrip(),
        )
    if confine and _KILLED.search(done.stderr):
        why = "it takes more time, or more memory, than a compiler gets (docs/security.md)"
        raise RunError(f"{failure}; {why}", detail=done.stderr.rstrip())
    if confine and _OUT_OF_LIMITS.search(done.stderr):
        failure += "; it takes more memory, time or room than a compiler gets (docs/security.md)"
    if confine and os.strerror(errno.EACCES) in done.stderr:
        failure += "; it may read the program's folders, those of `include`, and the system's"
    elif confine:
        failure += linking.missing_header(done.stderr)
    raise InputError(failure, detail=done.stderr.rstrip())


def _done(
    command: list[str], environment: Mapping[str, str], name: str
) -> "subprocess.CompletedProcess[str]":
    """A tool that has ended; RunError if it does not within _LONGEST_S, with all that it started.

    A header may be a pipe that nobody writes. What it prints goes to files in memory, which its
    limits bound: one source can have a billion errors, of which the first and the last are kept.
    """
    with (
        os.fdopen(os.memfd_create("out"), "w+b") as out,
        os.fdopen(os.memfd_create("said"), "w+b") as said,
        subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=said,
            process_group=0,
        ) as process,
    ):
        try:
            process.wait(_LONGEST_S)
        except subprocess.TimeoutExpired:
            raise RunError(
                f"{name} did not end within {_LONGEST_S:.0f} s; look for a header that is a pipe"
            ) from None
        finally:
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGKILL)
        out.seek(0)
        errors = _ends_of(said)
        printed = (text.decode(errors="replace") for text in (out.read(), errors))
    return subprocess.CompletedProcess(command, process.returncode, *printed)


def _ends_of(file: IO[bytes]) -> bytes:
    """A text that is short, or the first and the last of its lines."""
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    if size <= _MOST_ERRORS:
        return file.read()
    first = file.read(_MOST_ERRORS // 2)
    file.seek(size - _MOST_ERRORS // 2)
    return first.rpartition(b"\n")[0] + b"\n...\n" + file.read().partition(b"\n")[2]
