"""Where pip gets Kilotwin from, for repositories that install it: no index has it yet."""

import json
import re
import zipfile
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from urllib.parse import unquote, urlsplit

from kilotwin.errors import InputError

WHEELS = "wheels"
"""The folder of a repository that carries the wheel."""
_EXTRAS = "[coverage,plot,test]"
_WAYS = "a wheel, a folder with one, the URL of one, or a git address (git+https://..., or ....git)"
# Git's own short form of ssh://, as in git@host:group/kilotwin.git.
_SHORT_SSH = re.compile(r"([\w.-]+@[\w.-]+):(?!/)(.+)")
_PYTHON = re.compile(r"-cp3(\d+)-")
_PACKAGE = "kilotwin/__init__.py"  # not in what a clone installs, which leads to the clone


@dataclass(frozen=True)
class Origin:
    """The place that pip installs Kilotwin from.

    `wheel`: a file that the repository carries, in its folder WHEELS. `python`: the version of
    Python that it is for. `compiled`: pip compiles it, which takes
    libraries.
    """

    requirement: str
    python: str
    wheel: Path | None = None
    compiled: bool = False


def find(where: str) -> Origin:
    """The origin that a text names: a file, a folder, a URL or a git address. InputError: none."""
    short = _SHORT_SSH.fullmatch(where)
    url = f"ssh://{short[1]}/{short[2]}" if short else where
    address = urlsplit(url.removeprefix("git+"))
    if not address.netloc:
        return _carried(Path(unquote(address.path) if address.scheme == "file" else where))
    # A token may stand where a user does.
    if address.password or (address.username and not address.scheme.endswith("ssh")):
        raise InputError(
            f"--from: the address of {address.hostname} has a user or a password in it, which the "
            "repository would keep; leave it out, and give pip's netrc file both"
        )
    if url.startswith("git+") or address.scheme == "ssh" or address.path.endswith(".git"):
        git = url if url.startswith("git+") else f"git+{url}"
        return Origin(f"kilotwin{_EXTRAS} @ {git}", _python(""), compiled=True)
    name = unquote(address.path.rpartition("/")[2])
    if not _is_named(name, (".whl", ".tar.gz")):
        raise InputError(f"--from {where}: not the URL of a kilotwin-....whl; name {_WAYS}")
    compiled = name.endswith(".tar.gz")
    return Origin(f"kilotwin{_EXTRAS} @ {url}", _python(name), compiled=compiled)


def own() -> str | None:
    """Where this Kilotwin was installed from, as find() takes it; None if only this machine has it.

    pip keeps that (PEP 610).
    """
    try:
        installed = metadata.distribution("kilotwin")
    except metadata.PackageNotFoundError:
        return None
    if not Path(str(installed.locate_file(_PACKAGE))).is_file():
        return None
    kept = json.loads(installed.read_text("direct_url.json") or "{}")
    address = urlsplit(kept.get("url", ""))
    if address.scheme == "file":
        file = unquote(address.path)
        return file if Path(file).is_file() else None
    if "vcs_info" in kept:
        return f"git+{kept['url']}@{kept['vcs_info']['commit_id']}"
    return str(kept["url"]) if kept else None


def _carried(place: Path) -> Origin:
    """The wheel at that place, for a repository to carry."""
    place = place.expanduser()
    if place.is_dir():
        found = sorted(file for file in place.iterdir() if _is_named(file.name, (".whl",)))
        if len(found) != 1:
            there = ", ".join(file.name for file in found) or "no kilotwin-....whl"
            raise InputError(f"--from {place}: the folder has {there}; name one wheel")
        (place,) = found
    if not _is_named(place.name, (".whl",)):
        raise InputError(f"--from {place}: not a wheel, kilotwin-....whl; name {_WAYS}")
    if not place.is_file():
        raise InputError(f"--from {place}: there is no such file; name {_WAYS}")
    if not zipfile.is_zipfile(place) or _PACKAGE not in zipfile.ZipFile(place).namelist():
        raise InputError(f"--from {place}: it does not hold all of Kilotwin; type: make wheel")
    return Origin(f"./{WHEELS}/{place.name}{_EXTRAS}", _python(place.name), wheel=place)


def _is_named(name: str, suffixes: tuple[str, ...]) -> bool:
    return name.startswith("kilotwin-") and name.endswith(suffixes)


def _python(name: str) -> str:
    """The version of Python that a wheel's name says; 3.11, the oldest, if it says none."""
    found = _PYTHON.search(name)
    return f"3.{found[1] if found else 11}"
