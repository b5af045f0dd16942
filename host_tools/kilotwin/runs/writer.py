"""Writes a run folder while the run goes on.

The folder appears whole, with its manifest, or not at all. Every batch goes to its file at once, so
that what was written stays readable whenever the writer is killed: a stream then ends with its last
whole batch.
"""

import contextlib
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kilotwin import __version__
from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.record import Record
from kilotwin.experiment.states import Counts, States, count
from kilotwin.files.drafts import draft_of
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.runs.columns import (
    CELLS_SCHEMA,
    FRAMES_SCHEMA,
    MODULES_SCHEMA,
    Records,
    cell_rows,
    chosen_of,
    frame_rows,
    module_rows,
)
from kilotwin.runs.event_places import uid_of
from kilotwin.runs.folder import (
    CELLS,
    EVENTS,
    EXPERIMENT,
    FRAMES,
    MODULES,
    OBJECTS,
    PRINT,
    PRINTS,
    Reserve,
    write_manifest,
)
from kilotwin.runs.parcel import Parcel, parcel_of
from kilotwin.runs.prints import PrintLimit, Prints
from kilotwin.units import seconds, ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Event, ModuleRecord, Samples

_ROW_GROUP = 1_000_000
# A run's process starts no threads (docs/security.md).
_ONE_THREAD = pa.ipc.IpcReadOptions(use_threads=False)


class RunWriter:
    """The streams of one run."""

    def __init__(self, folder: Path, experiment: Experiment, manifest: dict[str, Any]) -> None:
        """Makes the folder in one step, then opens the streams. OSError leaves nothing behind."""
        self.folder = folder
        self._states = States.of(experiment.keys)
        self._site_count = len(experiment.keys.site)
        parcel = parcel_of(experiment)
        about = {"kilotwin": __version__, "experiment": parcel.experiment}
        self._records = Records.of(experiment.keys, about)
        self._reserve = _make_folder(folder, parcel, manifest)
        self._due = _Due(experiment.keys.record)
        self._skipped: tuple[Samples, MetricValues] | None = None  # newest sample, without rows
        self._robots = Stream(folder / "robots.arrows", self._records.robots_schema)
        self._sites = Stream(folder / "sites.arrows", self._records.sites_schema)
        more = {}
        if experiment.keys.object and "engine" in manifest:
            more[OBJECTS] = self._records.objects_schema
        if experiment.keys.record.has("modules") and "engine" in manifest:
            more[MODULES] = MODULES_SCHEMA
        if _shows_cells(experiment.keys) and "engine" in manifest:
            more[CELLS] = CELLS_SCHEMA
        if experiment.keys.record.has("frames") and "engine" in manifest:
            more[FRAMES] = FRAMES_SCHEMA
        self._frames_left = experiment.keys.record.most_frames
        self._more = {name: Stream(folder / f"{name}.arrows", more[name]) for name in more}
        self._events = (folder / EVENTS).open("w")
        self.before_event: Callable[[], None] = lambda: None
        """Called before add_event() writes, for what is to be written before."""
        self._prints = Prints(folder / PRINTS)
        self._print_limit = PrintLimit(experiment.keys.record)

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        """Writes samples of the engine, a batch per table; returns their counts, None for none."""
        if not len(samples["tick"]):
            return None
        counts = self.count(samples)
        self._add_robots(samples, measured)
        self._sites.write(self._records.sites(samples, counts, measured))
        if OBJECTS in self._more:
            self._more[OBJECTS].write(self._records.objects(samples))
        return counts

    def _add_robots(self, samples: "Samples", measured: MetricValues) -> None:
        """Rows of robots, of the samples at which they are due."""
        due = self._due.of(samples["tick"])
        if due.any():
            rows, values = (samples, measured) if due.all() else _at(samples, measured, due)
            self._robots.write(self._records.robots(rows, values))
        newest = np.arange(len(due)) == len(due) - 1
        self._skipped = None if due[-1] else _at(samples, measured, newest)

    @property
    def wants_modules(self) -> bool:
        """Whether modules are recorded."""
        return MODULES in self._more

    def add_modules(self, tick: int, modules: "list[ModuleRecord]") -> None:
        """Writes how a grid's modules are at a sample; only if `wants_modules`."""
        self._more[MODULES].write(module_rows(tick, modules))

    @property
    def wants_cells(self) -> bool:
        """Whether what cells show is recorded."""
        return CELLS in self._more

    def add_cells(self, tick: int, cells: NDArray[np.intp], shown: NDArray[np.uint8]) -> None:
        """Writes what some cells show from a sample on; only if `wants_cells`."""
        self._more[CELLS].write(cell_rows(tick, cells, shown))

    @property
    def wants_frames(self) -> bool:
        """Whether frames are recorded that robots received, and there is room for more."""
        return FRAMES in self._more and self._frames_left > 0

    def add_frames(self, arrivals: NDArray[np.void]) -> None:
        """Writes frames of the engine, as many as there is room for."""
        kept = arrivals[: self._frames_left]
        self._frames_left -= len(kept)
        if len(kept):
            self._more[FRAMES].write(frame_rows(kept))

    def count(self, samples: "Samples") -> Counts:
        """How many robots do what, in each of the samples."""
        return count(self._states, samples["led"], samples["site"], self._site_count)

    def add_event(self, event: "Event | dict[str, Any]") -> None:
        """Writes one event."""
        self.before_event()
        self.add_events([event])

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Writes events, which are kept from then on, also if the run is killed. What a robot
        prints goes to its own file too, up to a limit."""
        for event in events:
            if event["kind"] == PRINT and not self._print_limit.admits(event):
                continue
            self._write_event(event)
            if event["kind"] == PRINT and "robot" in event:
                self._prints.add(uid_of(event), event["tick"], event["text"])
        self._events.flush()
        self._prints.write()

    def _write_event(self, event: "Event | dict[str, Any]") -> None:
        time_s = round(seconds(event["tick"]), 3)
        self._events.write(json.dumps({"time_s": time_s, **event}) + "\n")

    def close(self, *, clean: bool) -> None:
        """Ends the streams; after a clean end the tables are written as Parquet too. The last
        moment has rows of robots in any case.

        OSError of a full disk leaves room for a manifest that says so.
        """
        try:
            if self._skipped is not None:
                self._robots.write(self._records.robots(*self._skipped))
                self._skipped = None
            for event in self._print_limit.left_out():
                self._write_event(event)
            for stream in (self._robots, self._sites, *self._more.values()):
                stream.close()
            self._events.close()
            if clean:
                for stream_file in sorted(self.folder.glob("*.arrows")):
                    _keep_as_parquet(stream_file)
        finally:
            self._reserve.release()


def _shows_cells(keys: ExperimentSchema) -> bool:
    """Whether cells show what a lab's own module program says, which no plan knows."""
    if keys.grid is None:
        return False
    from kilotwin.experiment.spec.grid_plan import is_ours

    return not is_ours(keys.grid)


class _Due:
    """Says at which samples robots are written down."""

    def __init__(self, record: Record) -> None:
        self._sample_ticks = max(1, ticks(record.sample_s))
        self._every = record.robots_every  # samples
        self._next = 0  # the next one's number

    def of(self, tick: NDArray[np.int64]) -> NDArray[np.bool_]:
        """A mask of samples at these ticks, which are later than all before."""
        due = np.zeros(len(tick), np.bool_)
        for place, number in enumerate(tick // self._sample_ticks):
            due[place] = number >= self._next or self._every == 1
            if due[place]:
                self._next = (number // self._every + 1) * self._every
        return due


def _at(
    samples: "Samples", measured: MetricValues, chosen: NDArray[np.bool_]
) -> "tuple[Samples, MetricValues]":
    """The chosen ones of some samples, with what robots' rows need."""
    of_robots = {name: values[chosen] for name, values in measured.of_robots.items()}
    return chosen_of(samples, chosen), MetricValues(of_robots=of_robots)


def _make_folder(folder: Path, parcel: Parcel, manifest: dict[str, Any]) -> Reserve:
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = folder.parent / f".kilotwin-{os.getpid()}"
    draft.mkdir()
    with contextlib.ExitStack() as undo:
        undo.callback(shutil.rmtree, draft)
        reserve = Reserve(draft)
        undo.callback(reserve.release)
        write_manifest(draft, manifest)
        (draft / EXPERIMENT).write_text(parcel.experiment)
        parcel.copy_to(draft)
        draft.replace(folder)
        undo.pop_all()
    return reserve


class Stream:
    """An Arrow IPC stream on an unbuffered file: a written batch is the kernel's, come what may."""

    def __init__(self, file: Path, schema: pa.Schema) -> None:
        self._file = pa.OSFile(str(file), "wb")
        options = pa.ipc.IpcWriteOptions(compression="zstd", use_threads=False)
        self._writer = pa.ipc.new_stream(self._file, schema, options=options)

    def write(self, batch: pa.RecordBatch) -> None:
        """Adds rows."""
        self._writer.write_batch(batch)

    def close(self) -> None:
        """Ends the stream."""
        self._writer.close()
        self._file.close()


def _keep_as_parquet(stream: Path) -> None:
    try:
        to_parquet(stream, stream.with_suffix(".parquet"))
    except pa.ArrowInvalid:
        what = "is damaged; one of the programs wrote into the run folder"
        raise RunError(f"{stream}: {what}") from None


def to_parquet(stream: Path, target: Path, *, torn: bool = False) -> None:
    """Copies a stream, some million rows at a time, and shows the result when it is done.

    `torn`: up to its last whole batch; otherwise it must be whole.
    """
    import pyarrow.parquet as pq

    with (
        draft_of(target, sync=False) as draft,
        pa.ipc.open_stream(stream, options=_ONE_THREAD) as reader,
        pq.ParquetWriter(draft, reader.schema, **_encoding(reader.schema)) as writer,
    ):
        waiting: list[pa.RecordBatch] = []
        for batch in _batches(reader, torn):
            waiting.append(batch)
            if sum(part.num_rows for part in waiting) >= _ROW_GROUP:
                writer.write_table(pa.Table.from_batches(waiting))
                waiting = []
        if waiting:
            writer.write_table(pa.Table.from_batches(waiting))


def _encoding(schema: pa.Schema) -> dict[str, Any]:
    """The encoding that takes the least room: floats byte by byte, whole numbers as differences,
    words by their numbers: 0.57 of what Parquet takes by default."""
    encodings = {
        pa.float32(): "BYTE_STREAM_SPLIT",
        pa.float64(): "BYTE_STREAM_SPLIT",
        pa.int64(): "DELTA_BINARY_PACKED",
        pa.uint32(): "DELTA_BINARY_PACKED",
    }
    chosen = {field.name: encodings[field.type] for field in schema if field.type in encodings}
    rest = [field.name for field in schema if field.name not in chosen]
    return {"compression": "zstd", "column_encoding": chosen, "use_dictionary": rest or False}


def _batches(reader: pa.RecordBatchReader, torn: bool) -> Iterator[pa.RecordBatch]:
    with contextlib.suppress(StopIteration):
        while True:
            try:
                batch = reader.read_next_batch()
            except (pa.ArrowException, OSError):
                if torn:
                    return
                raise
            yield batch
