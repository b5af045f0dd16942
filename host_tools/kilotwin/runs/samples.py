"""The samples of a run folder, finished or growing, read a few at a time."""

import threading
from collections import OrderedDict
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kilotwin.experiment.colours import LED_VALUES
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.experiment.states import States
from kilotwin.runs.columns import METRIC
from kilotwin.runs.folder import OBJECTS
from kilotwin.runs.packing import for_page, pack
from kilotwin.runs.reader import Run
from kilotwin.runs.stream_index import Batch, StreamIndex
from kilotwin.units import TICK_S

_POSE = ("x_m", "y_m", "heading_rad")
_KEPT_BATCHES = 16

MOST_ROWS = 2_000_000
"""Rows of one answer, at most."""
_MOST_COUNTED = 20_000_000


class Rows:
    """A stream with the same number of rows in each sample: `robots.arrows`, say."""

    def __init__(self, file: Path, numbered: str) -> None:
        """`numbered`: the column that says which robot or object a row is of."""
        self._index = StreamIndex(file)
        self._numbered = numbered
        self._decoded: OrderedDict[int, pa.RecordBatch] = OrderedDict()
        self._row_ticks: list[NDArray[np.int64]] = []  # of each batch
        self.ids: NDArray[np.uint32] = np.zeros(0, dtype=np.uint32)
        """Which robots each sample has, in order; none before the first sample."""

    @property
    def samples(self) -> int:
        """Whole samples there are."""
        return self._index.rows // len(self.ids) if len(self.ids) else 0

    def refresh(self) -> None:
        """Takes in what was written since."""
        self._index.refresh()
        if not len(self.ids) and self._index.batches:
            first = self._index.read(self._index.batches[0], ["tick", self._numbered])
            tick = np.asarray(first["tick"])
            self.ids = np.asarray(first[self._numbered])[tick == tick[0]]

    def has(self, column: str) -> bool:
        """Whether the run recorded it."""
        return column in self._index.names

    @property
    def columns(self) -> list[str]:
        """Those that the run recorded; none before its first sample."""
        return self._index.names

    def ticks(self) -> NDArray[np.int64]:
        """[samples]: when each was taken. Reads a column of all that is new."""
        for batch in self._index.batches[len(self._row_ticks) :]:
            rows = np.asarray(self._index.read(batch, ["tick"])["tick"])
            self._row_ticks.append(rows[:: len(self.ids)])
        return np.concatenate([*self._row_ticks, np.zeros(0, dtype=np.int64)])

    def read(self, wanted: Sequence[int], columns: list[str]) -> dict[str, NDArray[Any]]:
        """[len(wanted), rows of a sample] for each column; the samples, ascending, are there.

        Of `state` the words' numbers.
        """
        size = len(self.ids)
        made: dict[str, list[NDArray[Any]]] = {column: [] for column in columns}
        for number, samples in groupby(wanted, lambda sample: self._index.at_row(sample * size)):
            batch = self._index.batches[number]
            inside = [sample - batch.row // size for sample in samples]
            decoded = self._batch(number, batch, columns)
            for column in columns:
                made[column].append(_values(decoded[column]).reshape(-1, size)[inside])
        return {
            column: np.concatenate(parts) if parts else np.zeros((0, size))
            for column, parts in made.items()
        }

    def of_one(self, place: int, column: str) -> NDArray[Any]:
        """[samples]: a column of the robot in that place of each sample."""
        size = len(self.ids)
        parts = [
            _values(self._index.read(batch, [column])[column])[place::size]
            for batch in self._index.batches
        ]
        return np.concatenate(parts) if parts else np.zeros(0)

    def _batch(self, number: int, batch: Batch, columns: list[str]) -> pa.RecordBatch:
        kept = self._decoded.get(number)
        if kept is None or any(column not in kept.schema.names for column in columns):
            kept = self._index.read(batch, columns)
            self._decoded[number] = kept
            while len(self._decoded) > _KEPT_BATCHES:
                self._decoded.popitem(last=False)
        self._decoded.move_to_end(number)
        return kept


class RunSamples:
    """Poses and LEDs of a run's robots, poses of its objects, and its curves."""

    def __init__(
        self,
        folder: Path,
        *,
        objects: bool,
        led_of_state: Sequence[int] = (),
        curves_of_leds: bool = False,
    ) -> None:
        """`led_of_state`: what stands for LEDs where the run recorded states alone;
        `curves_of_leds`: the run has no states that `sites` counts."""
        self._curves_of_leds = curves_of_leds
        self._led_counts: dict[int, NDArray[np.intp]] = {}  # robots by LED, of samples
        self._led_of_state = np.array(led_of_state, dtype=np.uint8)
        self.robots = Rows(folder / "robots.arrows", "robot")
        self.objects = Rows(folder / f"{OBJECTS}.arrows", "object") if objects else None
        self._sites = StreamIndex(folder / "sites.arrows")
        self._ticks: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._site_ticks: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._read_of_sites: dict[str, tuple[int, NDArray[Any]]] = {}  # batches, their values
        # A server answers in threads.
        self._lock = threading.Lock()

    @staticmethod
    def of(run: Run) -> "RunSamples":
        """The samples that a run has by now."""
        states = States.of(run.experiment)
        samples = RunSamples(
            run.folder,
            objects=bool(run.experiment.object),
            led_of_state=[int(np.argmax(states.of_led == k)) for k in range(len(states.names))],
            curves_of_leds=states.known == 0,
        )
        samples.refresh()
        return samples

    @property
    def samples(self) -> int:
        """Samples that can be read."""
        return len(self._ticks)

    def refresh(self) -> int:
        """Takes in what was written since; the number of samples."""
        with self._lock:
            try:
                self.robots.refresh()
                self._sites.refresh()
                if self.objects is not None:
                    self.objects.refresh()
            except FileNotFoundError:
                return 0  # the run begins
            self._take_ticks()
            return self.samples

    def _take_ticks(self) -> None:
        """A row of `sites` is a sample of the robots, unless robots were recorded less often."""
        number = self.robots.samples
        if len(self._ticks) == number:
            return
        self._site_ticks = self._of_sites(["tick"])["tick"].astype(np.int64)
        ends = [0, number - 1] if number > 1 else [0]
        seen = self.robots.read(ends, ["tick"])["tick"][:, 0]
        same = len(self._site_ticks) >= number and np.array_equal(seen, self._site_ticks[ends])
        self._ticks = self._site_ticks[:number] if same else self.robots.ticks()

    def times_s(self) -> NDArray[np.float64]:
        """[samples]: when each was taken, s."""
        return self._ticks.astype(np.float64) * TICK_S

    def times(self, first: int) -> bytes:
        """When the samples from number `first` on were taken, s."""
        return pack({"first": first}, {"time_s": self.times_s()[first:]})

    def chunk(self, first: int, count: int, stride: int) -> bytes:
        """Samples first, first + stride, ..., packed; headings are in 2^16 parts of a turn, of
        robots' metrics NaN where none was measured."""
        with self._lock:
            most = max(1, MOST_ROWS // max(1, len(self.robots.ids)))
            wanted = range(first, self.samples, stride)[: min(count, most)]
            arrays = self._read(wanted)
            metrics = [name for name in self.robots.columns if name.startswith(METRIC)]
            measured = self.robots.read(wanted, metrics) if metrics else {}
            arrays |= {name: values.astype(np.float32) for name, values in measured.items()}
        return pack({"first": first, "stride": stride, "samples": len(wanted)}, arrays)

    def read(self, wanted: Sequence[int]) -> dict[str, NDArray[Any]]:
        """[len(wanted), robots]: `x_m`, `y_m`, `heading_rad` in 2^16 parts of a turn, `led`, as
        far as they were recorded, and the columns of `record.also`; `object_x_m` and its like are
        [len(wanted), objects]."""
        with self._lock:
            return self._read(wanted)

    def _read(self, wanted: Sequence[int]) -> dict[str, NDArray[Any]]:
        arrays = self._of_robots(wanted)
        if self.objects is not None and self.objects.samples:
            # Objects are recorded as often as curves are.
            ticks = self._ticks[list(wanted)]
            places = np.searchsorted(self._site_ticks[: self.objects.samples], ticks)
            places = np.minimum(places, self.objects.samples - 1)
            poses = for_page(self.objects.read(places.tolist(), list(_POSE)))
            arrays |= {f"object_{name}": values for name, values in poses.items()}
        return arrays

    def _of_robots(self, wanted: Sequence[int]) -> dict[str, NDArray[Any]]:
        present = [name for name in (*_POSE, *EXTRA_OF) if self.robots.has(name)]
        shown = self._shown()
        read = self.robots.read(wanted, present + ([shown] if shown else []))
        if shown:
            read["led"] = self._leds(read[shown], shown)
        read.pop("state", None)
        # Extras of real robots are null.
        known = {
            name: values
            for name, values in read.items()
            if name not in EXTRA_OF or np.issubdtype(values.dtype, np.integer)
        }
        return for_page(known)

    def _shown(self) -> str | None:
        """The column that says what robots' LEDs show."""
        for column in ("led", "state"):
            if self.robots.has(column):
                return column
        return None

    def _leds(self, values: NDArray[Any], column: str) -> NDArray[Any]:
        return values if column == "led" else self._led_of_state[values.astype(np.intp)]

    def series(self, most: int) -> bytes:
        """The columns of `sites`, every k-th row so that there are no more than `most` rows; and
        where no state has a name, how many robots show each LED, as `led_12`."""
        with self._lock:
            rows = self._sites.rows
            stride = max(1, -(-rows // most))
            read = {
                name: values[::stride] for name, values in self._of_sites(self._sites.names).items()
            }
            ticks = read.pop("tick", np.zeros(0)).astype(np.int64)
            arrays = {
                name: values.astype(np.float64 if name == "time_s" else np.float32)
                for name, values in read.items()
            }
            return pack({"rows": rows, "stride": stride}, {**arrays, **self._curves(ticks)})

    def _curves(self, ticks: NDArray[np.int64]) -> dict[str, NDArray[np.float32]]:
        """How many robots show each LED that any shows, in the last sample by each of `ticks`; of
        many robots some samples stand for those after them."""
        if not self._curves_of_leds or not self.samples or not len(ticks):
            return {}
        numbers = np.maximum(np.searchsorted(self._ticks, ticks, side="right") - 1, 0)
        step = max(1, -(-len(numbers) * len(self.robots.ids) // _MOST_COUNTED))
        self._count_leds(sorted({int(number) for number in numbers[::step]}))
        rows = [self._led_counts[int(number)] for number in numbers[::step]]
        counts = np.repeat(np.array(rows), step, axis=0)[: len(ticks)]
        return {
            f"led_{led}": counts[:, led].astype(np.float32)
            for led in np.flatnonzero(counts.any(axis=0))
        }

    def _count_leds(self, wanted: list[int]) -> None:
        """Counts in those samples, unless it has."""
        new = [number for number in wanted if number not in self._led_counts]
        most = max(1, MOST_ROWS // max(1, len(self.robots.ids)))
        for at in range(0, len(new), most):
            part = new[at : at + most]
            led = self._of_robots(part).get("led")
            for row, number in enumerate(part):
                shown = np.zeros(0, np.uint8) if led is None else led[row] & (LED_VALUES - 1)
                self._led_counts[number] = np.bincount(shown, minlength=LED_VALUES)

    def history(self, place: int) -> list[tuple[float, int]]:
        """(time in s, LED byte) from each change of the LED on, of the robot in that place."""
        with self._lock:
            shown = self._shown()
            if shown is None:
                return []
            led = self._leds(self.robots.of_one(place, shown), shown)
            ticks = self._ticks[: len(led)]
        if not len(ticks):
            return []
        changes = np.flatnonzero(np.diff(led[: len(ticks)].astype(np.int16), prepend=-1))
        return [(round(float(ticks[at] * TICK_S), 3), int(led[at])) for at in changes]

    def metrics(self, place: int, most: int) -> dict[str, list[tuple[float, float]]]:
        """(time in s, value) of each metric that was recorded of the robot in that place, where it
        was measured; every k-th so that there are no more than `most`."""
        made = {}
        with self._lock:
            for name in self.robots.columns:
                if name.startswith(METRIC):
                    values = self.robots.of_one(place, name).astype(np.float64)
                    known = np.flatnonzero(np.isfinite(values[: len(self._ticks)]))
                    known = known[:: max(1, -(-len(known) // most))]
                    times = self._ticks[known] * TICK_S
                    made[name] = [
                        (round(float(at), 3), float(value))
                        for at, value in zip(times, values[known], strict=True)
                    ]
        return made

    def _of_sites(self, names: list[str]) -> dict[str, NDArray[Any]]:
        """Whole columns of `sites`; of a run that goes on only what is new is read."""
        if not names:
            return {}
        known = {name: self._read_of_sites.get(name, (0, np.zeros(0))) for name in names}
        begin = min(batches for batches, _ in known.values())
        news = [self._sites.read(batch, names) for batch in self._sites.batches[begin:]]
        for name, (batches, values) in known.items():
            parts = [_values(batch[name]) for batch in news[batches - begin :]]
            number = batches + len(parts)
            self._read_of_sites[name] = (number, np.concatenate([values, *parts]))
        return {name: self._read_of_sites[name][1] for name in names}


def _values(column: pa.Array) -> NDArray[Any]:
    if isinstance(column, pa.DictionaryArray):
        column = column.indices
    return np.asarray(column.to_numpy(zero_copy_only=False))
