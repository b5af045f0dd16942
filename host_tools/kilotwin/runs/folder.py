"""Name, files and manifest of a run folder, the same for emulated and real runs.

manifest.json     experiment, command line, time, versions, how it ended
experiment.toml   resolved: `kilotwin run` repeats the run from it
parcel/           programs, Python and pictures that it names (runs/parcel.py)
robots.arrows     a row per robot and sample      (Arrow IPC stream)
sites.arrows      a row per sample                (Arrow IPC stream)
events.jsonl      a line per thing that happened to a robot
prints/           robot-7.log: what robot 7 printed, if it did; each line with its time
robots.parquet    as the streams, after a clean end only
sites.parquet

With objects also, if they are emulated:
objects.arrows    a row per object and sample    (Arrow IPC stream; and objects.parquet)

With a virtual environment also, see runs/environment_record.py:
sent.arrows       a row per word for a robot     (Arrow IPC stream; and sent.parquet)

On a Kilogrid also, see grid/grid_record.py:
tracking.arrows   a row per report of a robot    (Arrow IPC stream; and tracking.parquet)
can.log           a line per CAN frame, as candump -L writes it
"""

import contextlib
import json
import os
import re
import shutil
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.experiment.experiment import Experiment
from kilotwin.files.drafts import draft_of
from kilotwin.files.places import PARCEL

MANIFEST = "manifest.json"
EXPERIMENT = "experiment.toml"
EVENTS = "events.jsonl"
PRINTS = "prints"
OBJECTS = "objects"
TRACKING = "tracking"
FILES = "files"  # of the manifest
CAN_LOG = "can.log"
SENT = "sent"
MODULES = "modules"
FRAMES = "frames"
CELLS = "cells"

# Events of a program's prints.
PRINT = "print"

# Events after which a robot, or a module, takes no part any more.
FAILURES = {"crash", "endless", "stack_overflow"}

# Events of robots that fail because the experiment says so; `text` is the kind.
FAULT = "fault"

# Events of programs that look for it (--sanitize).
UNDEFINED = "undefined_behaviour"

# The chain that `kilotwin why` has told last, for the page.
WHY = "why.json"

# A manifest's key of a run that was steered by hand: `first_s`, when for the first time.
TOUCHED = "touched"

# Uids of a lab's robots, by index, in a manifest; without, a robot's is its index and 1.
UIDS = "uids"

# A manifest's status.
RUNNING = "running"
FINISHED = "finished"
INTERRUPTED = "interrupted"
FAILED = "failed"


# More than a manifest takes that names a thousand failed robots; and than any.
_RESERVED_BYTES, _MOST_BYTES = 256 * 1024, 1 << 26


class Reserve:
    """Room on the disk for a last manifest, should the run fill the disk.

    A file without a name: its room is free again when it is released or its process has ended.
    """

    def __init__(self, folder: Path) -> None:
        """OSError where there is no such room."""
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115
        try:
            os.posix_fallocate(self._file.fileno(), 0, _RESERVED_BYTES)
        except OSError:
            self.release()
            raise

    def release(self) -> None:
        """Gives the room back."""
        self._file.close()


def utc_now() -> str:
    """The wall time as manifests write it."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def slug(name: str) -> str:
    """A name as folders have it: `simplified, N = 100` is simplified-n-100."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "run"


def default_folder(experiment: Experiment) -> Path:
    """runs/<name>-seed<seed>-<UTC time>, a name that is not taken."""
    now = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    stem = f"{slug(experiment.keys.name)}-seed{experiment.keys.seed}-{now}"
    folder = Path("runs") / stem
    copy = 1
    while folder.exists():
        copy += 1
        folder = Path("runs") / f"{stem}-{copy}"
    return folder


def check_free(folder: Path) -> None:
    """InputError unless a run folder can be made there. Leaves nothing behind."""
    try:
        str(folder).encode()
    except UnicodeEncodeError:
        raise InputError(f"--out {str(folder)!a}: not UTF-8; name another folder") from None
    existing = folder
    try:
        existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
        if not existing.is_dir():
            raise InputError(f"--out {folder}: {existing} is a file; name a new folder")
        if folder.is_dir() and any(folder.iterdir()):
            raise InputError(f"--out {folder}: the folder is not empty; name a new one")
        with tempfile.TemporaryDirectory(dir=existing, prefix=".kilotwin-"):
            pass
    except OSError as error:
        reason = cause_of(error)
        raise InputError(
            f"--out {folder}: cannot write in {existing} ({reason}); name another folder"
        ) from None


def write_manifest(folder: Path, manifest: dict[str, Any]) -> None:
    """Writes or replaces the manifest in one step."""
    with draft_of(folder / MANIFEST, sync=False) as draft:
        draft.write_text(json.dumps(manifest, indent=2) + "\n")


def add_to_manifest(folder: Path, more: dict[str, Any]) -> None:
    """Writes what is known of a run after it began. RunError if the manifest is none any more: a
    confined program can write there."""
    with (folder / MANIFEST).open("rb") as file:
        text = file.read(_MOST_BYTES)
    try:
        known = dict(json.loads(text))
    except (ValueError, TypeError, RecursionError):
        what = "is damaged; one of the programs wrote into the run folder"
        raise RunError(f"{folder / MANIFEST}: {what}") from None
    write_manifest(folder, {**known, **more})


def close_manifest(folder: Path, status: str, exit_code: int, **more: Any) -> None:
    """Writes how the run ended, and how large its files are then."""
    add_to_manifest(folder, {**_ending(status, exit_code), FILES: sizes_of(folder), **more})


def sizes_of(folder: Path) -> dict[str, int]:
    """Bytes of the files in a run folder, by their paths in it, but for the manifest."""
    return {
        path.relative_to(folder).as_posix(): path.stat().st_size
        for path in sorted(
            [*folder.glob("*"), *(folder / PRINTS).glob("*"), *(folder / PARCEL).rglob("*")]
        )
        if path.is_file() and path.name != MANIFEST
    }


def close_for_writer(
    folder: Path, began: dict[str, Any], status: str, exit_code: int, reason: str
) -> None:
    """The same in place of a writer that died. A manifest that a program has spoiled becomes the
    one that the run `began` with."""
    ending = {**_ending(status, exit_code), "reason": reason}
    try:
        add_to_manifest(folder, ending)
    except (RunError, OSError):
        with contextlib.suppress(OSError):
            if (folder / MANIFEST).is_dir():
                shutil.rmtree(folder / MANIFEST)
            write_manifest(folder, {**began, **ending})


def _ending(status: str, exit_code: int) -> dict[str, Any]:
    return {"status": status, "exit_code": exit_code, "ended_utc": utc_now()}
