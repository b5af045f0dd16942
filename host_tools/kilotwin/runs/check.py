"""Whether a run folder is whole, and what is in it if not; mends what can be mended."""

import json
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa

from kilotwin import __version__
from kilotwin.errors import InputError, KilotwinError, cause_of
from kilotwin.runs.folder import EVENTS, FAILED, FILES, FINISHED, RUNNING, add_to_manifest
from kilotwin.runs.reader import Run, read_parquet
from kilotwin.runs.writer import to_parquet
from kilotwin.units import counted

_FRESH_S = 60.0
_END_OF_STREAM = b"\xff\xff\xff\xff\0\0\0\0"

WHOLE = "whole"
TRUNCATED = "truncated"
SPOILED = "spoiled"
DAMAGED = "damaged"


@dataclass
class FolderVerdict:
    """Outcome of a look: `state` is the worst of what was found.

    `findings` are sentences; `tables` rows by name; `mended` what was done about them.
    """

    folder: Path
    state: str = WHOLE
    findings: list[str] = field(default_factory=list)
    tables: dict[str, int] = field(default_factory=dict)
    made_by: dict[str, str] = field(default_factory=dict)
    mended: list[str] = field(default_factory=list)

    def found(self, state: str, sentence: str) -> None:
        """Takes a finding."""
        order = (WHOLE, SPOILED, TRUNCATED, DAMAGED)
        self.state = max(self.state, state, key=order.index)
        self.findings.append(sentence)

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        return {
            "run": str(self.folder),
            "state": self.state,
            "findings": self.findings,
            "rows": self.tables,
            "made_by": self.made_by,
            "mended": self.mended,
        }

    def text(self) -> str:
        """For people."""
        rows = ", ".join(f"{name} {count:,}" for name, count in self.tables.items())
        by = ", ".join(f"{name} {version}" for name, version in self.made_by.items())
        lines = [f"{self.folder}: {self.state}", f"  rows: {rows}", f"  made by: {by}"]
        lines += [f"  {finding}" for finding in self.findings]
        return "\n".join([*lines, *(f"  mended: {what}" for what in self.mended)])


def check(folder: Path, *, repair: bool = False) -> FolderVerdict:
    """Looks at everything in a run folder; InputError if it is none.

    `repair`: tables that lack their Parquet get it from what whole batches there are, a torn last
    line of events is cut off, and a manifest that says "running" says "failed". InputError for a
    run that may go on still.
    """
    run = Run.open(folder)
    if repair and run.manifest.get("status") == RUNNING and _is_fresh(folder):
        raise InputError(
            f"{folder}: was written less than {_FRESH_S:.0f} s ago, so it may run still; end it, "
            "or type this again later"
        )
    verdict = FolderVerdict(folder)
    _look_at_manifest(run, verdict)
    for stream in sorted(folder.glob("*.arrows")):
        _look_at_table(run, stream, verdict, repair=repair)
    for name in ("robots", "sites"):
        if name not in verdict.tables:
            verdict.found(DAMAGED, f"{name}.arrows is not there")
    _look_at_events(run, verdict, repair=repair)
    _look_at_sizes(run, verdict)
    if repair and run.manifest.get("status") == RUNNING:
        add_to_manifest(folder, {"status": FAILED, "reason": "it was killed; found by check-run"})
        verdict.mended.append("manifest.json says failed")
    return verdict


def _is_fresh(folder: Path) -> bool:
    return any(time.time() - file.stat().st_mtime < _FRESH_S for file in folder.glob("*.arrows"))


def _look_at_manifest(run: Run, verdict: FolderVerdict) -> None:
    manifest = run.manifest
    engine = manifest.get("engine", {})
    verdict.made_by = {"kilotwin": str(manifest.get("kilotwin", "unknown"))}
    if isinstance(engine, dict):
        verdict.made_by.update({f"engine {key}": str(value) for key, value in engine.items()})
    if manifest.get("kilotwin") != __version__:
        verdict.findings.append(f"another Kilotwin made it; this is {__version__}")
    status = manifest.get("status")
    if status == RUNNING:
        verdict.found(TRUNCATED, "it runs still, or was killed")
    elif status != FINISHED:
        why = manifest.get("reason")
        verdict.found(TRUNCATED, f"it ended as {status}" + (f": {why}" if why else ""))
    if spoiled := manifest.get("spoiled"):
        verdict.found(SPOILED, str(spoiled))


def _look_at_table(run: Run, stream: Path, verdict: FolderVerdict, *, repair: bool) -> None:
    rows, torn = _whole_rows(stream)
    verdict.tables[stream.stem] = rows
    finished = run.manifest.get("status") == FINISHED
    if torn:
        state = DAMAGED if finished else TRUNCATED
        verdict.found(state, f"{stream.name} is cut off behind {rows:,} rows ({torn})")
    parquet = stream.with_suffix(".parquet")
    try:
        kept = read_parquet(parquet).num_rows
    except FileNotFoundError:
        kept = None
        if finished:
            verdict.found(DAMAGED, f"{parquet.name} is not there")
    except (pa.ArrowException, OSError) as error:
        kept = None
        verdict.found(DAMAGED, f"{parquet.name} is damaged ({str(error).splitlines()[0]})")
    if kept is not None and kept != rows:
        verdict.found(DAMAGED, f"{parquet.name} has {kept:,} rows, {stream.name} {rows:,}")
    if repair and rows and (kept is None or kept < rows):
        _mend_table(stream, parquet, verdict)


def _mend_table(stream: Path, parquet: Path, verdict: FolderVerdict) -> None:
    try:
        to_parquet(stream, parquet, torn=True)
        verdict.mended.append(f"{parquet.name} has the {verdict.tables[stream.stem]:,} whole rows")
    except OSError as error:
        raise KilotwinError(f"{parquet}: cannot be written ({cause_of(error)})") from None


def _whole_rows(stream: Path) -> tuple[int, str]:
    """Rows of all whole batches, and why there are no more; "" if the stream ends as it should."""
    rows = 0
    try:
        with pa.OSFile(str(stream)) as file, pa.ipc.open_stream(file) as reader:
            for batch in reader:
                rows += batch.num_rows
            # Arrow takes a file that ends between two batches for a whole one.
            file.seek(max(file.size() - len(_END_OF_STREAM), 0))
            return rows, "" if file.read() == _END_OF_STREAM else "no end"
    except (pa.ArrowException, OSError) as error:
        return rows, str(error).splitlines()[0]


def _look_at_events(run: Run, verdict: FolderVerdict, *, repair: bool) -> None:
    file = run.folder / EVENTS
    if not file.exists():
        verdict.found(DAMAGED, f"{EVENTS} is not there")
        return
    lines = file.read_bytes().splitlines(keepends=True)
    good = [line for line in lines if _is_event(line)]
    if len(good) == len(lines):
        return
    bad = len(lines) - len(good)
    torn = bad == 1 and not _is_event(lines[-1])
    found = f"{EVENTS} has {counted(bad, 'line')} without an event"
    verdict.found(TRUNCATED if torn else DAMAGED, found)
    if repair and torn:
        file.write_bytes(b"".join(good))
        verdict.mended.append(f"the torn last line of {EVENTS} is cut off")


def _look_at_sizes(run: Run, verdict: FolderVerdict) -> None:
    """Whether files that say of themselves nothing of their ends are as the run left them."""
    sizes = run.manifest.get(FILES)
    if not isinstance(sizes, dict):
        return
    for name, size in sizes.items():
        file = run.folder / name
        if file.suffix in (".arrows", ".parquet") or name == EVENTS:
            continue  # these are read whole
        if not file.is_file():
            verdict.found(DAMAGED, f"{name} is not there")
        elif file.stat().st_size < size:
            verdict.found(DAMAGED, f"{name} is cut off: {file.stat().st_size:,} of {size:,} bytes")


def _is_event(line: bytes) -> bool:
    try:
        return line.endswith(b"\n") and isinstance(json.loads(line), dict)
    except (ValueError, RecursionError):
        return False
