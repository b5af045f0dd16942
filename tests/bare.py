"""README's two commands on a bare Debian 12: `make bare`.

    python3 tests/bare.py [--keep]        as root

Makes a minimal Debian 12 root with debootstrap, clones HEAD into it, and executes there the steps
of Containerfile and README's second command, as root with an empty environment. Then both commands
run once more in a clone of a user without sudo, who finds the packages that root has installed.
Prints a table of seconds and megabytes. Ends with 1 where a command fails; what was printed is in
build/bare.log. The root is in build/bare, and is removed when all has passed.

Of this machine only settings of registries are handed in: proxies, certificates, pip's and npm's
configuration, and the mirror that apt uses.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
ROOT = PROJECT / "build/bare"
LOG = PROJECT / "build/bare.log"
USER = "student"
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"

# Variables that say where packages come from, and which certificates are trusted.
_SETTINGS = re.compile(r"(?i)((https?|ftp|all|no)_proxy|(pip|uv|npm_config)_.*|.*(_ca|cert).*)")
_SETTING_FILES = ("/etc/pip.conf", "/etc/npmrc", "/etc/resolv.conf", "/etc/hosts")
_HOME_FILES = (".config/pip/pip.conf", ".pip/pip.conf", ".npmrc", ".config/uv/uv.toml")
# A step by the line that `make` prints when it begins. The page is made beside the engine.
_STEPS = {
    "set-up: Debian packages": "Debian packages",
    "set-up: Python packages": "Python packages",
    "set-up: the emulator's engine": "engine and page",
    "set-up: done": "the run",
    "set-up: the native tests": "native tests are built",
    "== Python tests": "tests",
}
_FOLDERS = {"Debian packages": "", "Python packages": ".venv", "engine and page": "build"}
_ALONE = ("unshare", "--mount", "--pid", "--fork", "--kill-child")


@dataclass
class Row:
    """A line of the table. Bytes are those that came by it; None: not measured."""

    name: str
    seconds: float
    bytes: int | None = None


@dataclass
class Report:
    rows: list[Row] = field(default_factory=list)

    def __str__(self) -> str:
        width = max(len(row.name) for row in self.rows)
        lines = [f"{'':{width}}  seconds      MB"]
        for row in self.rows:
            size = "" if row.bytes is None else f"{row.bytes / 1e6:,.0f}"
            lines.append(f"{row.name:{width}}  {row.seconds:7.0f}  {size:>6}")
        return "\n".join(lines)


class BareRootError(Exception):
    """A command of the root failed."""


def mirror(sources: str) -> str:
    """The first address that apt gets packages of Debian's main part from, of its lists' text."""
    found = re.search(r"^\s*(?:deb\s+(?:\[.*?\]\s+)?|URIs:\s*)(\S+)", sources, re.MULTILINE)
    if found is None:
        raise BareRootError("apt has no source here")
    return found.group(1)


def settings(environment: Mapping[str, str]) -> dict[str, str]:
    """The variables that are handed in."""
    return {name: value for name, value in environment.items() if _SETTINGS.fullmatch(name)}


def instructions(containerfile: str) -> Iterator[tuple[str, str]]:
    """Its instructions, comments left out: ("RUN", "make run"), ..."""
    for line in containerfile.replace("\\\n", " ").splitlines():
        word, _, rest = line.strip().partition(" ")
        if word and not word.startswith("#"):
            yield word, rest.strip()


def commands(readme: str) -> list[str]:
    """README's commands: make run, make test."""
    part = readme.split("## Two commands", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^    (make \w+)", part, re.MULTILINE)


def step_at(line: str) -> str | None:
    """The step that begins with this line of a command's output."""
    return next((step for mark, step in _STEPS.items() if line.startswith(mark)), None)


def steps_of(lines: Iterator[tuple[float, str]], end_s: float) -> list[Row]:
    """How long each step took, of (time, line) of a command's output and when it ended."""
    begun = [(at, step) for at, line in lines if (step := step_at(line))]
    ends = [at for at, _ in begun[1:]] + [end_s]
    total: dict[str, float] = {}
    for (at, name), end in zip(begun, ends, strict=False):
        total[name] = total.get(name, 0) + end - at
    return [Row(f"    {name}", seconds) for name, seconds in total.items()]


def size_of(folder: Path) -> int:
    """What it takes on disk; files that are linked several times count once."""
    if not folder.exists():
        return 0
    done = subprocess.run(
        ["du", "-sx", "--block-size=1", str(folder)], capture_output=True, text=True, check=False
    )
    return int(done.stdout.split()[0])


class BareRoot:
    """A Debian root at a folder, and what is done in it; nothing stays mounted."""

    def __init__(self, folder: Path, log: Path) -> None:
        self.folder, self.report = folder, Report()
        self._log = log.open("w", encoding="utf-8")
        self._handed = settings(os.environ)

    def make(self) -> None:
        began = time.monotonic()
        remove(self.folder)
        lists = [Path("/etc/apt/sources.list"), *Path("/etc/apt/sources.list.d").glob("debian*")]
        sources = "\n".join(file.read_text() for file in lists if file.is_file())
        words = ["debootstrap", "--variant=minbase", "bookworm", str(self.folder), mirror(sources)]
        self._log_command(words)
        if subprocess.run(words, stdout=self._log, stderr=self._log, check=False).returncode:
            raise BareRootError("debootstrap failed")
        self.report.rows.append(Row("a bare root", time.monotonic() - began, size_of(self.folder)))

    def _hand_in(self) -> None:
        """Before each command, since packages bring files of these names."""
        home = Path.home()
        files = [Path(name) for name in _SETTING_FILES]
        files += [Path(value) for value in self._handed.values() if Path(value).is_absolute()]
        files += [
            file
            for file in Path("/etc/apt/apt.conf.d").glob("*")
            if re.search("(?i)proxy|CAInfo", file.read_text(errors="replace"))
        ]
        for file in files:
            if file.is_file():
                self._put(file, file.relative_to("/"))
        for name in _HOME_FILES:
            if (home / name).is_file():
                for to in ("root", "etc/skel"):
                    self._put(home / name, Path(to) / name)

    def _put(self, file: Path, to: Path) -> None:
        (self.folder / to).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, self.folder / to)

    def clone(self, to: str) -> None:
        target = self.folder / to.lstrip("/")
        words = ["git", "clone", "--quiet", "--no-hardlinks", str(PROJECT), str(target)]
        subprocess.run(words, check=True)

    def run(self, command: str, folder: str = "/", user: str = "root", name: str = "") -> None:
        """A command of a person there; its time goes into the report, its output into the log."""
        self._hand_in()
        home = "/root" if user == "root" else f"/home/{user}"
        before = {label: self._size(label, folder) for label in ("", *_FOLDERS)}
        inside = f"cd {shlex.quote(folder)} && {command}"
        words = ["setpriv", f"--reuid={user}", f"--regid={user}", "--init-groups", "env", "-i"]
        words += [f"HOME={home}", f"PATH={PATH}"]
        words += [f"{key}={value}" for key, value in self._handed.items()]
        words += ["/bin/sh", "-c", inside]
        there = shlex.quote(str(self.folder))
        mounts = [f"mount --rbind /{place} {there}/{place}" for place in ("dev", "sys")]
        outer = ["mount --make-rprivate /", *mounts, f"mount -t proc proc {there}/proc"]
        outer.append(f"exec chroot {there} {shlex.join(words)}")
        self._log_command([inside])
        began = time.monotonic()
        process = subprocess.Popen(
            [*_ALONE, "sh", "-ec", "\n".join(outer)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            env={"PATH": PATH},
            text=True,
            errors="replace",
        )
        lines = []
        assert process.stdout is not None
        for line in process.stdout:
            lines.append((time.monotonic(), line))
            self._log.write(line)
            self._log.flush()
            if step_at(line) or " passed, " in line:
                print(f"  {line.rstrip()}", flush=True)
        code, end = process.wait(), time.monotonic()
        self._add(name or command, end - began, steps_of(iter(lines), end), before, folder)
        if code:
            raise BareRootError(
                f"`{command}` of {user} failed: {lines[-1][1].strip() if lines else code}"
            )

    def _add(
        self, name: str, seconds: float, steps: list[Row], before: dict[str, int], folder: str
    ) -> None:
        after = {label: self._size(label, folder) for label in before}
        came = {label: after[label] - before[label] for label in before}
        self.report.rows.append(Row(name, seconds, came[""]))
        came["Debian packages"] -= came["Python packages"] + came["engine and page"]
        for step in steps:
            step.bytes = came.get(step.name.strip())
        self.report.rows += steps

    def _size(self, label: str, folder: str) -> int:
        part = _FOLDERS.get(label, "")
        return size_of(self.folder / folder.lstrip("/") / part if part else self.folder)

    def _log_command(self, words: list[str]) -> None:
        print(f"== {' '.join(words)}", flush=True)
        self._log.write(f"\n== {' '.join(words)}\n")
        self._log.flush()


def remove(folder: Path) -> None:
    """Never beyond its own file system."""
    subprocess.run(["rm", "-rf", "--one-file-system", str(folder)], check=True)


def play(root: BareRoot) -> None:
    """All of it; BareRootError where a command fails."""
    run_command, test_command = commands((PROJECT / "README.md").read_text(encoding="utf-8"))
    root.make()
    place = "/"
    for word, rest in instructions((PROJECT / "Containerfile").read_text(encoding="utf-8")):
        if word == "RUN":
            root.run(rest, place, name=rest if rest == run_command else "git and make")
        elif word == "COPY":
            root.clone(rest.split()[1])
        elif word == "WORKDIR":
            place = rest
    root.report.rows.append(Row("the root after it", 0, size_of(root.folder)))
    root.run(test_command, place)

    home = f"/home/{USER}"
    root.run(f"useradd --create-home {USER}", name="a user")
    root.clone(f"{home}/kilotwin")
    root.run(f"chown -R {USER}:{USER} {home}", name="a user's clone")
    for command in (run_command, test_command):
        root.run(command, f"{home}/kilotwin", USER, f"{command}, by the user")


def main() -> int:
    parser = argparse.ArgumentParser(description="README's two commands on a bare Debian 12.")
    parser.add_argument("--keep", action="store_true", help="leave the root, build/bare")
    keep = parser.parse_args().keep
    if os.getuid() != 0 or shutil.which("debootstrap") is None:
        print("make bare needs root, and debootstrap: sudo make bare", file=sys.stderr)
        return 2
    LOG.parent.mkdir(exist_ok=True)
    root = BareRoot(ROOT, LOG)
    try:
        play(root)
    except BareRootError as failure:
        print(f"\n{root.report}\nmake bare: {failure}\nAll that was printed: {LOG}")
        return 1
    print(f"\n{root.report}")
    if not keep:
        remove(ROOT)
    return 0


if __name__ == "__main__":
    sys.exit(main())
