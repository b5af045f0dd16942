"""The two sides of `kilotwin compare A B`: a run, a sweep or a .kilodat, as numbers by metric."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import ExperimentText
from kilotwin.runs.columns import METRIC
from kilotwin.runs.folder import EXPERIMENT, FINISHED, MANIFEST
from kilotwin.runs.reader import Run
from kilotwin.studies.compare.seen_by_cells import (
    at_end_by_cells,
    reports_of_kilodat,
    reports_of_run,
)
from kilotwin.studies.sweep.data_set import ABOUT
from kilotwin.studies.sweep.results import Results

_TIMES = ("tick", "time_s")
_KILODAT = (".kilodat", ".xz")


@dataclass(frozen=True)
class Side:
    """One of the two. `values` are those at the end of each of its trials, by metric.

    `end_s` are the times at which its trials ended; `shortened` says why they are not whole ones.
    """

    name: str
    values: dict[str, NDArray[np.float64]]
    units: dict[str, str]
    end_s: tuple[float, ...]
    shortened: str = ""
    sampling: str = "as it was"

    @property
    def trials(self) -> int:
        """How many it has."""
        return len(self.end_s)


def open_both(
    a: Path, b: Path, where_a: Sequence[str], where_b: Sequence[str]
) -> tuple[Side, Side]:
    """Both sides. Where one is a real table's record, cells see robots for the other one too."""
    by_cells = _is_recorded(a) != _is_recorded(b)
    return _open(a, where_a, b, by_cells=by_cells), _open(b, where_b, a, by_cells=by_cells)


def _is_recorded(path: Path) -> bool:
    """Whether a real table, or one that is served, was seen by its cells."""
    if path.suffix in _KILODAT:
        return True
    return (path / MANIFEST).is_file() and "recorded_from" in Run.open(path).manifest


def _open(path: Path, where: Sequence[str], other: Path, *, by_cells: bool) -> Side:
    if path.suffix in _KILODAT:
        return _of_kilodat(path, other)
    if (path / ABOUT).is_file():
        if by_cells:
            what = "a sweep keeps no reports of robots; name a run folder to compare with a table's"
            raise InputError(f"{path}: {what}")
        return _of_sweep(path, where)
    if where:
        raise InputError(f"--a, --b {where[0]}: they choose trials of a sweep; {path} is none")
    return _of_run(Run.open(path), by_cells=by_cells)


def _of_sweep(folder: Path, where: Sequence[str]) -> Side:
    results = Results.open(folder, where)
    columns = results.metrics
    ends = dict(
        zip(
            results.series["trial"].to_pylist(),
            results.series["time_s"].to_pylist(),
            strict=True,
        )
    )
    values = {column.name: results.at_end(results.rows, column) for column in columns}
    units = {column.name: column.unit for column in columns}
    end_s = tuple(ends[row["trial"]] for row in results.rows)
    name = f"{folder} ({', '.join(where)})" if where else str(folder)
    return Side(name, values, units, end_s)


def _of_run(run: Run, *, by_cells: bool) -> Side:
    status = run.manifest.get("status")
    shortened = "" if status == FINISHED else f"the run is {status}"
    if by_cells and "recorded_from" not in run.manifest:
        experiment = Experiment.load(run.folder / EXPERIMENT)
        if experiment.plan is None:
            raise InputError(f"{run.folder}: has no [grid], so no cells that see robots")
        end_s = _end_of(run.sites(), run.folder)
        table = at_end_by_cells(experiment, reports_of_run(run), end_s)
        return _side(str(run.folder), table, end_s, shortened, "as its cells saw it")
    table = run.sites()
    return _side(str(run.folder), table, _end_of(table, run.folder), shortened)


def _of_kilodat(file: Path, other: Path) -> Side:
    """By the experiment of the other side, which must be of the same table."""
    if not (other / EXPERIMENT).is_file():
        what = "which experiment was it? Compare it with a run folder of that experiment"
        raise InputError(f"{file}: {what}")
    experiment = Experiment.of(ExperimentText.read(other / EXPERIMENT, []))
    if experiment.plan is None:
        raise InputError(f"{other}: has no [grid], and {file} is of one")
    reports = reports_of_kilodat(file)
    end_s = min(float(reports.at_s[-1]), experiment.keys.duration_s)
    shortened = ""
    if end_s < 0.98 * experiment.keys.duration_s:
        shortened = f"it ends at {end_s:,.0f} of {experiment.keys.duration_s:,.0f} s"
    table = at_end_by_cells(experiment, reports, end_s)
    return _side(str(file), table, end_s, shortened, "as its cells saw it")


def _end_of(table: pa.Table, folder: Path) -> float:
    if table.num_rows == 0:
        raise InputError(f"{folder}: no sample was recorded; let the run go on for longer")
    return float(table["time_s"][-1].as_py())


def _side(
    name: str, table: pa.Table, end_s: float, shortened: str, sampling: str = "as it was"
) -> Side:
    """The last row of a table `sites`."""
    last = table.slice(table.num_rows - 1).to_pylist()[0]
    values, units = {}, {}
    for field in table.schema:
        if field.name not in _TIMES:
            shown = field.name.removeprefix(METRIC)
            value = last[field.name]
            values[shown] = np.array([] if value is None else [float(value)])
            units[shown] = (field.metadata or {}).get(b"unit", b"").decode()
    return Side(name, values, units, (end_s,), shortened, sampling)
