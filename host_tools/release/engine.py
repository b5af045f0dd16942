"""Installs Kilotwin into the environment that runs this, with its engine; for `make setup`.

    engine.py FILE...      the files that the engine is built from

The engine is compiled into an editable wheel, which is kept: when the same files come again, for
the same compiler, libraries and place in the file system, it is taken. Kept are the newest few, in
$KILOTWIN_WHEELS or in build/wheels; a CI job that restores this folder builds nothing.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KEPT = 4
# Variables that change what a compiler makes.
_VARIABLES = ("CC", "CXX", "CFLAGS", "CXXFLAGS", "LDFLAGS", "CMAKE_ARGS", "CMAKE_BUILD_TYPE")


def main(files: list[str]) -> None:
    """Ends with the build's or uv's code if it fails."""
    os.chdir(ROOT)
    wheels = Path(os.environ.get("KILOTWIN_WHEELS") or ROOT / "build/wheels")
    folder = wheels / key_of(ROOT, map(Path, files))
    wheel = next(folder.glob("*.whl"), None)
    if wheel is None:
        print("set-up: the emulator's engine (about a minute)", file=sys.stderr, flush=True)
        wheel = keep(built(), folder)
        prune(wheels)
    else:
        print(f"set-up: the emulator's engine, as it was built before ({folder})", file=sys.stderr)
        os.utime(folder)
    install = [str(Path(sys.executable).with_name("uv")), "pip", "install", "--quiet"]
    own = ["--python", sys.executable, "--no-index", "--no-deps", "--reinstall", str(wheel)]
    sys.exit(subprocess.run([*install, *own], check=False).returncode)


def key_of(root: Path, files: Iterable[Path]) -> str:
    """A hash of all that decides what the wheel becomes: the files, names of packages, tools."""
    digest = hashlib.sha256()
    for file in sorted({*files, Path("requirements/run.lock")}):
        digest.update(f"\0{file}\0".encode() + (root / file).read_bytes())
    packages = sorted(file.parent for file in (root / "host_tools").rglob("__init__.py"))
    compiler = os.environ.get("CXX") or "c++"
    tools = [
        output(compiler, "--version"),
        output("dpkg-query", "-W", "libsimavr-dev", "libelf-dev", "libeigen3-dev"),
        f"{platform.python_version()} {platform.machine()}",
    ]
    variables = [f"{name}={os.environ.get(name, '')}" for name in _VARIABLES]
    digest.update("\0".join([str(root), *map(str, packages), *tools, *variables]).encode())
    return digest.hexdigest()[:32]


def output(*command: str) -> str:
    """The output of a tool; nothing where there is no such tool."""
    if shutil.which(command[0]) is None:
        return ""
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def built() -> Path:
    """The editable wheel, new; all that the build says goes to stdout, as it comes."""
    folder = Path(tempfile.mkdtemp(prefix="kilotwin-"))
    code = f"from scikit_build_core.build import build_editable; build_editable({str(folder)!r})"
    done = subprocess.run([sys.executable, "-c", code], stderr=subprocess.STDOUT, check=False)
    if done.returncode:
        sys.exit(done.returncode)
    (wheel,) = folder.glob("*.whl")
    return wheel


def keep(wheel: Path, folder: Path) -> Path:
    """Moves it there in one step; another `make setup` may do so too."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=".draft-", dir=folder.parent))
    draft.chmod(0o755)
    kept = draft / wheel.name
    shutil.move(wheel, kept)
    wheel.parent.rmdir()
    try:
        draft.rename(folder)
    except OSError:  # it is there by now
        shutil.rmtree(draft)
    return folder / wheel.name


def prune(wheels: Path) -> None:
    """Leaves the newest ones."""
    folders = [folder for folder in wheels.iterdir() if not folder.name.startswith(".")]
    for folder in sorted(folders, key=lambda folder: folder.stat().st_mtime)[:-KEPT]:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main(sys.argv[1:])
