"""A sweep's results by column: what varied, what was measured, over time and at the end."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.runs.columns import METRIC
from kilotwin.runs.reader import read_parquet
from kilotwin.studies.sweep.conditions import Row, chosen
from kilotwin.studies.sweep.data_set import METRICS_FAILED, SERIES, TRIALS, about

_NO_KEYS = ("trial", "key", "robots", "not_resting", "rule", "reading", "informed", METRICS_FAILED)
_RESULTS = ("resting_", "share_", "result_hash", METRIC)
_TIMES = ("trial", "tick", "time_s")

Series = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Times in s, and values; NaN for none."""


@dataclass(frozen=True)
class Column:
    """Something that was measured: its column, its name for people, and its unit."""

    column: str
    name: str
    unit: str

    @property
    def label(self) -> str:
        """`hops (ticks)`, for an axis."""
        return f"{self.name} ({self.unit})" if self.unit not in ("", self.name) else self.name


def measured(samples: pa.Table) -> list[Column]:
    """All that samples of a run or of a sweep have measured, metrics first."""
    names = [name for name in samples.column_names if name not in _TIMES]
    return [_column(samples, name) for name in sorted(names, key=lambda n: METRIC not in n)]


def find_column(samples: pa.Table, name: str, option: str, folder: Path) -> Column:
    """A metric by its name, or a column by its own; InputError lists them."""
    for column in (f"{METRIC}{name}", name):
        if column in samples.column_names and column not in _TIMES:
            return _column(samples, column)
    there = ", ".join(column.name for column in measured(samples))
    raise InputError(f"{option} {name}: {folder} has no such metric; it has {there}")


def _column(samples: pa.Table, column: str) -> Column:
    meta = samples.schema.field(column).metadata or {}
    return Column(column, column.removeprefix(METRIC), meta.get(b"unit", b"").decode())


def values_of(samples: pa.Table, column: Column) -> Series:
    """A column over time."""
    values = samples[column.column].cast(pa.float64()).to_numpy(zero_copy_only=False)
    return np.asarray(samples["time_s"]), np.asarray(values, dtype=np.float64)


@dataclass(frozen=True)
class Results:
    """The two tables of a sweep's folder; `rows` are the trials that were chosen."""

    folder: Path
    name: str
    trials: pa.Table
    series: pa.Table
    rows: list[Row]

    @staticmethod
    def open(folder: Path, where: Sequence[str] = ()) -> "Results":
        """InputError if it is no sweep's folder, or has no trial that meets `where`."""
        trials, series = _table(folder, TRIALS), _table(folder, SERIES)
        rows = chosen(folder, trials, where)
        return Results(folder, about(folder, "name"), trials, series, rows)

    @property
    def keys(self) -> list[str]:
        """Keys that the trials were varied in, the seed last."""
        return [
            name
            for name in self.trials.column_names
            if name not in _NO_KEYS and not name.startswith(_RESULTS)
        ]

    @property
    def varied(self) -> list[str]:
        """Those of the keys but the seed in which the chosen trials differ."""
        keys = (key for key in self.keys if key != "seed")
        return [key for key in keys if len({_known(row[key]) for row in self.rows}) > 1]

    @property
    def metrics(self) -> list[Column]:
        """All that was measured, metrics first."""
        return measured(self.series)

    def metric(self, name: str, option: str = "--metric") -> Column:
        """As find_column()."""
        return find_column(self.series, name, option, self.folder)

    def key(self, name: str, option: str) -> str:
        """A key that varied; InputError lists them."""
        if name in self.keys:
            return name
        there = ", ".join(self.varied) or "nothing but the seed"
        raise InputError(f"{option} {name}: the sweep does not vary it; it varies {there}")

    def groups(self, keys: Sequence[str]) -> dict[tuple[Any, ...], list[Row]]:
        """The chosen trials by their values of keys, in order of these values."""
        found: dict[tuple[Any, ...], list[Row]] = {}
        for row in self.rows:
            found.setdefault(tuple(_known(row[key]) for key in keys), []).append(row)
        return dict(sorted(found.items(), key=lambda item: [ordered(v) for v in item[0]]))

    def over_time(self, trial: int, column: Column) -> Series:
        """A trial's values."""
        return values_of(self.series.filter(pc.equal(self.series["trial"], trial)), column)

    def at_end(self, rows: Iterable[Row], column: Column) -> NDArray[np.float64]:
        """The last values of trials; those without one are left out."""
        last = self._last(column)
        values = np.array([last[row["trial"]] for row in rows], dtype=np.float64)
        return values[np.isfinite(values)]

    def _last(self, column: Column) -> dict[int, float]:
        numbers = np.asarray(self.series["trial"])
        values = self.series[column.column].cast(pa.float64()).to_numpy(zero_copy_only=False)
        # The last row of a trial wins.
        return dict(zip(numbers.tolist(), np.asarray(values, np.float64).tolist(), strict=True))

    def pooled(self, keys: Sequence[str]) -> str:
        """Keys that vary within groups by `keys`, in words; "" if none does."""
        others = [key for key in self.varied if key not in keys]
        return f"over all {', '.join(others)}" if others else ""


def ordered(value: Any) -> tuple[int, float, str]:
    """For sorting values of a key: none, numbers, texts."""
    if value is None:
        return (0, 0.0, "")
    if isinstance(value, int | float):
        return (1, float(value), "")
    return (2, 0.0, str(value))


def shown(value: Any) -> str:
    """A key's value in a figure."""
    if value is None:
        return "as it is"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _known(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _table(folder: Path, name: str) -> pa.Table:
    try:
        return read_parquet(folder / name)
    except FileNotFoundError:
        raise InputError(
            f"{folder}: no sweep's folder with finished trials (no {name}); name one that "
            "`kilotwin sweep` made"
        ) from None
    except (pa.ArrowException, OSError) as error:
        raise InputError(
            f"{folder / name}: damaged ({str(error).splitlines()[0]}); the sweep's own command "
            "makes it anew"
        ) from None
