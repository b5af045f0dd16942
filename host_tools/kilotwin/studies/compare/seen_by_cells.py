"""Metrics of a run as a table's cells saw it: robots are where they were last received."""

from pathlib import Path

import numpy as np
import pyarrow as pa

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import States, count
from kilotwin.metrics.functions import LocalFunctions
from kilotwin.metrics.meter import Meter
from kilotwin.runs.columns import Records
from kilotwin.runs.reader import Run
from kilotwin.runs.tracking import Tracking
from kilotwin.table.grid import kilodat
from kilotwin.table.grid.poller import Reports
from kilotwin.units import ticks


def reports_of_run(run: Run) -> Reports:
    """Reports that the host of an emulated table fetched; InputError if there are none."""
    table = run.tracking()
    if table.num_rows == 0:
        raise InputError(f"{run.folder}: robots reported nothing; see grid.report_s")
    data = np.frombuffer(b"".join(table["data"].to_pylist()), np.uint8).reshape(-1, 7)
    return Reports(
        np.asarray(table["time_s"]),
        np.asarray(table["module_x"]),
        np.asarray(table["module_y"]),
        np.asarray(table["cell"]),
        data,
    )


def reports_of_kilodat(file: Path) -> Reports:
    """Reports that a real table's host wrote down; InputError if there are none."""
    rows = kilodat.read(file)
    if not rows:
        raise InputError(f"{file}: holds no report")
    data = np.frombuffer(b"".join(row.data.ljust(7, b"\0") for row in rows), np.uint8)
    return Reports(
        np.array([row.time_s for row in rows]),
        np.array([row.x for row in rows], np.uint8),
        np.array([row.y for row in rows], np.uint8),
        np.array([row.cell for row in rows], np.uint8),
        data.reshape(-1, 7),
    )


def at_end_by_cells(experiment: Experiment, reports: Reports, end_s: float) -> pa.Table:
    """The table `sites` that the host would have written, sampled as the experiment says."""
    assert experiment.plan is not None
    keys = experiment.keys
    tracking = Tracking(experiment, experiment.plan.layout, experiment.plan.site_maps)
    meter = Meter(experiment, LocalFunctions(experiment) if experiment.functions else None)
    records, states = Records.of(keys, {}), States.of(keys)
    times = [*np.arange(0.0, end_s, keys.record.sample_s), end_s]
    ends = np.searchsorted(reports.at_s, times, side="right")
    batches, before = [], 0
    for time_s, end in zip(times, ends, strict=True):
        if end > before:
            part = slice(before, int(end))
            tracking.add(
                Reports(
                    *(getattr(reports, name)[part] for name in ("at_s", "x", "y", "cell", "data"))
                )
            )
            before = int(end)
        sample = tracking.sample(ticks(time_s))
        counts = count(states, sample["led"], sample["site"], len(keys.site))
        measured = meter.measure(sample, None, last=time_s == end_s)
        batches.append(records.sites(sample, counts, measured))
    return pa.Table.from_batches(batches, records.sites_schema)
