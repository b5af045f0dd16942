"""Where faults are planted and judged: a copy of the tree, and a Python that imports a fault."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from .mutations import Mutation
from .targets import GOLDEN_HASH, GOLDEN_RUN, Target

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build/mutants"
"""Where copies and builds go, unless said otherwise. Two sessions need two folders."""
MEMORY_BYTES = 6 << 30
# Commands that tests type, by the module whose main() each is.
SCRIPTS = {"kilotwin": "kilotwin.commands.cli", "dask": "dask.__main__"}
# A test takes at most so many times what it takes without a fault, and so many seconds more.
PATIENCE, GRACE_S = 4, 10
BUILD_S = 900

# Python's `site` reads it at each start, in whatever process: the sources' own packages, and the
# one module that has a fault.
_PTH = "import site; site.addsitedir({packages!r}); import kilotwin_fault\n"
_FINDER = """\
import importlib.abc, importlib.util, pathlib, sys

_FAULT = pathlib.Path(__file__).with_name("fault.txt")


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if _FAULT.exists():
            module, file = _FAULT.read_text().split()
            if name == module:
                return importlib.util.spec_from_file_location(name, file)
        return None


sys.meta_path.insert(0, _Finder())
"""

# Workers of a sweep import it, too.
_SCRIPT = """\
#!{python}
from {package} import main

if __name__ == "__main__":
    main()
"""

_COMPARE = """\
import subprocess, sys
out = subprocess.run([sys.argv[1]], capture_output=True, text=True, check=True).stdout
sys.exit(out.split()[0] != sys.argv[2])
"""


@dataclass(frozen=True)
class Verdict:
    """The end of a fault: "killed", "survived", or "invalid" (it does not compile)."""

    what: str
    by: str  # which test killed it
    seconds: float


class Workshop:
    """Copies are made at the first use; a second session finds them."""

    def __init__(self, folder: Path = FOLDER) -> None:
        self._folder = folder
        self._tree = folder / "tree"
        # Where `make native` has it, and built as there: a compiler cache has nearly all of it.
        self._native = self._tree / "build/native"
        self._python = folder / "python"
        self._usual_s: dict[tuple[str, str], float] = {}
        self._known: set[Target] = set()  # whose tests have passed without a fault
        self._copied = self._has_python = False

    def judge(self, target: Target, fault: Mutation) -> Verdict:
        """Plants a fault, runs its tests until one fails, and takes it out again."""
        judge = self._judge_native if target.programs else self._judge_python
        began = time.monotonic()
        what, by = judge(target, fault)
        return Verdict(what, by, time.monotonic() - began)

    def _judge_native(self, target: Target, fault: Mutation) -> tuple[str, str]:
        self._copy_tree()
        # Without a fault only once: one build brings back the last file and plants in the next.
        if target not in self._known and not self._builds(target):
            raise SystemExit(f"{target.programs}: see {self._folder / 'build.log'}")
        commands = self._native_commands(target)
        for name, command in commands.items():
            self._note_usual(name, command)
        self._known.add(target)
        file = self._tree / target.file
        source = file.read_text()
        file.write_text(fault.of(source))
        try:
            if not self._builds(target):
                return "invalid", ""
            return self._first_failure(commands)
        finally:
            file.write_text(source)

    def _native_commands(self, target: Target) -> dict[str, list[str]]:
        commands = {}
        for name in target.programs:
            program = str(next(self._native.glob(f"**/{name}")))
            if name == GOLDEN_RUN:
                commands[name] = [sys.executable, "-c", _COMPARE, program, GOLDEN_HASH]
                continue
            for argument in target.arguments:
                shown = argument.split("*")[-1].removesuffix(".cpp") or name
                commands[shown] = [program, argument, "-aa=1"] if argument else [program]
        return commands

    def _judge_python(self, target: Target, fault: Mutation) -> tuple[str, str]:
        self._make_python()
        pytest = [str(self._python / "bin/python"), "-m", "pytest", "-q", "-x", "-m", "not long"]
        pytest += ["-p", "no:cacheprovider"]
        commands = {name: [*pytest, name] for name in target.arguments}
        fault_txt = next(self._python.glob("lib/python3.*/site-packages")) / "fault.txt"
        fault_txt.unlink(missing_ok=True)
        for name, command in commands.items():
            self._note_usual(name, command)
        mutant = self._folder / "mutant.py"
        mutant.write_text(fault.of((ROOT / target.file).read_text()))
        module = target.file.removeprefix("host_tools/").removesuffix(".py").replace("/", ".")
        fault_txt.write_text(f"{module} {mutant}")
        try:
            compile(mutant.read_text(), str(mutant), "exec")
            return self._first_failure(commands)
        except SyntaxError:
            return "invalid", ""
        finally:
            fault_txt.unlink()

    def _first_failure(self, commands: dict[str, list[str]]) -> tuple[str, str]:
        for name, command in commands.items():
            usual_s = self._usual_s[name, command[0]]
            if not passes(command, PATIENCE * usual_s + GRACE_S):
                return "killed", name
        return "survived", ""

    def _note_usual(self, name: str, command: list[str]) -> None:
        if (name, command[0]) in self._usual_s:
            return
        began = time.monotonic()
        if not passes(command, 600):
            raise SystemExit(f"without a fault this fails: {' '.join(command)}")
        self._usual_s[name, command[0]] = time.monotonic() - began

    def _copy_tree(self) -> None:
        """Brings the copy up to date; what did not change keeps its time, to be built once."""
        if self._copied:
            return
        self._tree.mkdir(parents=True, exist_ok=True)
        names = subprocess.check_output(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT)
        for name in names.decode().split("\n"):
            source, copy = ROOT / name, self._tree / name
            if not name or not source.is_file():
                continue
            content = source.read_bytes()
            if not copy.is_file() or copy.read_bytes() != content:
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.write_bytes(content)
                shutil.copymode(source, copy)
        configure = ["cmake", "-S", self._tree, "-B", self._native, "-G", "Ninja"]
        configure += [f"-DPython_EXECUTABLE={sys.executable}", "-DKILOTWIN_TESTS=ON"]
        # One file at a time: a fault is planted into one.
        configure += ["-DKILOTWIN_PYTHON=OFF", "-DKILOTWIN_UNITY=OFF"]
        subprocess.run(list(map(str, configure)), check=True, stdout=subprocess.DEVNULL)
        self._copied = True

    def _builds(self, target: Target) -> bool:
        command = ["cmake", "--build", str(self._native), "--target", *target.programs]
        with (self._folder / "build.log").open("w") as log:
            try:
                done = subprocess.run(command, stdout=log, stderr=log, timeout=BUILD_S, check=False)
            except subprocess.TimeoutExpired:  # as by a constant that is computed without end
                return False
        return done.returncode == 0

    def _make_python(self) -> None:
        """An environment of its own over the packages of this one."""
        if self._has_python:
            return
        shutil.rmtree(self._python, ignore_errors=True)
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", self._python], check=True)
        packages = next(self._python.glob("lib/python3.*/site-packages"))
        ours = Path(sys.prefix) / packages.relative_to(self._python)
        (packages / "a.pth").write_text(_PTH.format(packages=str(ours)))
        (packages / "kilotwin_fault.py").write_text(_FINDER)
        for name, package in SCRIPTS.items():
            script = self._python / "bin" / name
            script.write_text(_SCRIPT.format(python=self._python / "bin/python", package=package))
            script.chmod(0o755)
        self._has_python = True


def passes(command: list[str], limit_s: float) -> bool:
    """Whether a test passes in time and memory; with all that it started it ends."""
    process = subprocess.Popen(
        ["prlimit", f"--data={MEMORY_BYTES}", *command],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        return process.wait(limit_s) == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
