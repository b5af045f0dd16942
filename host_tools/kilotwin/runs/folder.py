"""Name, files and manifest of a run folder, the same for emulated and real runs.

manifest.json     experiment, command line, time, versions, how it ended
experiment.toml   resolved: `kilotwin run` repeats the run from it
robots.arrows     a row per robot and sample      (Arrow IPC stream)
sites.arrows      a row per sample                (Arrow IPC stream)
events.jsonl      a line per thing that happened to a robot
prints/           robot-7.log: what robot 7 printed, if it did; each line with its time
robots.parquet    as the streams, after a clean end only
sites.parquet

On a Kilogrid also, see grid/grid_record.py:
tracking.arrows   a row per report of a robot    (Arrow IPC stream; and tracking.parquet)
can.log           a line per CAN frame, as candump -L writes it
"""

import json
import re
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment

MANIFEST = "manifest.json"
EXPERIMENT = "experiment.toml"
EVENTS = "events.jsonl"
PRINTS = "prints"
TRACKING = "tracking"
CAN_LOG = "can.log"

# Events after which a robot, or a module, takes no part any more.
FAILURES = {"crash", "endless", "stack_overflow"}

# A manifest's status.
RUNNING = "running"
FINISHED = "finished"
INTERRUPTED = "interrupted"
FAILED = "failed"


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
    existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not existing.is_dir():
        raise InputError(f"--out {folder}: {existing} is a file; name a new folder")
    try:
        if folder.is_dir() and any(folder.iterdir()):
            raise InputError(f"--out {folder}: the folder is not empty; name a new one")
        with tempfile.TemporaryDirectory(dir=existing, prefix=".kilotwin-"):
            pass
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(
            f"--out {folder}: cannot write in {existing} ({reason}); name another folder"
        ) from None


def write_manifest(folder: Path, manifest: dict[str, Any]) -> None:
    """Writes or replaces the manifest in one step."""
    draft = folder / f".{MANIFEST}.new"
    draft.write_text(json.dumps(manifest, indent=2) + "\n")
    draft.replace(folder / MANIFEST)


def close_manifest(folder: Path, status: str, exit_code: int, **more: Any) -> None:
    """Writes how the run ended; also in place of a writer that died."""
    manifest = json.loads((folder / MANIFEST).read_text())
    ending = {"status": status, "exit_code": exit_code, "ended_utc": utc_now()}
    write_manifest(folder, {**manifest, **ending, **more})
