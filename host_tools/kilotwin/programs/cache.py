"""The cache of what is built: each under the hash of everything that went in.

What is there is whole, so that builds may go on side by side: it appears in one step. Beside each
file or folder lies the hash of its content, a line for each build that made it; what does not fit,
as a disk or a hand has damaged it, is built again.
"""

import contextlib
import hashlib
import os
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from kilotwin.errors import RunError, cause_of
from kilotwin.files.drafts import folder_draft_of

Notify = Callable[[str], None]

_SLOW_S = 0.5


def cache_folder() -> Path:
    """$KILOTWIN_CACHE, else kilotwin in the user's cache folder."""
    own = os.environ.get("KILOTWIN_CACHE")
    if own:
        return Path(own).absolute()
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "kilotwin"


def key_of(words: Iterable[str], files: Iterable[Path]) -> str:
    """The hash of words (versions, flags), and of files by name and content; 32 hex digits."""
    digest = hashlib.sha256("\0".join(words).encode())
    for file in files:
        digest.update(f"\0{file}\0".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:32]


def kept_objects(
    words: Iterable[str],
    files: Iterable[Path],
    compile_into: Callable[[Path], object],
    notify: Notify,
) -> Path:
    """The folder with objects of sources of ours that many programs are linked with.

    From the cache, or made by `compile_into`, which gets a new folder. `words` and `files`: as of
    key_of(), all that goes in. `notify` gets a line of what was damaged.
    """
    folder = cache_folder() / f"{key_of(words, files)}-objects"
    if not is_built(folder, notify):
        with tempfile.TemporaryDirectory(prefix="kilotwin-") as scratch:
            compile_into(Path(scratch))
            with kept_folder(folder) as draft:
                copy_files(Path(scratch), draft)
    return folder


@contextlib.contextmanager
def kept_folder(folder: Path) -> Iterator[Path]:
    """A folder to fill that then is in the cache, unless another process was faster with it."""
    with folder_draft_of(folder) as draft:
        yield draft
        note_whole(folder, draft)


def copy_files(folder: Path, target: Path) -> None:
    """The files of a folder, into another; OSError at the first that cannot be written."""
    for file in sorted(folder.iterdir()):
        shutil.copyfile(file, target / file.name)


@contextlib.contextmanager
def building(what: str, folder: Path, notify: Notify) -> Iterator[None]:
    """Around a build into the cache: `notify` gets a line if it takes time.

    RunError if nothing can be written in `folder`.
    """
    slow = threading.Timer(_SLOW_S, notify, [what])
    slow.start()
    try:
        yield
    except OSError as error:
        raise _cannot_keep(folder, error) from None
    finally:
        slow.cancel()
        slow.join()  # a process of one thread forks its worker, which starts sooner


def is_built(kept: Path, notify: Notify = lambda _: None) -> bool:
    """Whether the file or folder is in the cache, as it was put there. `notify` gets a line of one
    that is damaged, and gone then. RunError if the cache may not be looked into."""
    try:
        if not kept.exists():
            return False
        sums = _sums_of(kept)
        told = sums.read_text().split() if sums.exists() else []
        if _digest(kept) in told:
            return True
        if told:  # one without a hash is of an older version
            notify(f"{kept}: is damaged, and built again")
        if kept.is_dir():
            shutil.rmtree(kept)
        else:
            kept.unlink(missing_ok=True)
    except OSError as error:
        raise _cannot_keep(kept.parent, error) from None
    return False


def note_whole(kept: Path, content: Path) -> None:
    """Writes down the content, a file or folder, that `kept` has from now on."""
    with _sums_of(kept).open("a") as sums:
        sums.write(_digest(content) + "\n")


def _sums_of(kept: Path) -> Path:
    return kept.with_name(f".{kept.name}.sha256")


def _digest(kept: Path) -> str:
    """The hash of a file, or of all files in a folder with their names."""
    if not kept.is_dir():
        return hashlib.sha256(kept.read_bytes()).hexdigest()
    digest = hashlib.sha256()
    for file in sorted(file for file in kept.rglob("*") if file.is_file()):
        digest.update(f"{file.relative_to(kept)}\0{_digest(file)}\0".encode())
    return digest.hexdigest()


def keep(built: Path, target: Path) -> None:
    """Copies into the cache in one step; another process may do so too. OSError leaves nothing."""
    with tempfile.NamedTemporaryFile(
        dir=target.parent, prefix=f".{target.stem}-", delete=False
    ) as draft:
        pass
    try:
        shutil.copyfile(built, draft.name)
        Path(draft.name).chmod(0o755)
        note_whole(target, built)
        Path(draft.name).replace(target)
    finally:
        Path(draft.name).unlink(missing_ok=True)


def _cannot_keep(folder: Path, error: OSError) -> RunError:
    return RunError(
        f"{folder}: cannot keep compiled programs ({cause_of(error)}); "
        "set KILOTWIN_CACHE to a folder that can be written"
    )
