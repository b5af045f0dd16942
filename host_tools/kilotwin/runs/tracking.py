"""Reports of robots through cells, as positions and states: a robot is where its cell is."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.section import LAST_UID
from kilotwin.experiment.spec.aggregation import runs_aggregation
from kilotwin.experiment.spec.grid_layout import Cells, Layout
from kilotwin.experiment.states import States
from kilotwin.runs.columns import TRACKING_SCHEMA, WORD
from kilotwin.table.grid.poller import Reports

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

_NOBODY = -1


class Tracking:
    """The table of reports, and where every robot was last received."""

    def __init__(
        self,
        experiment: Experiment,
        layout: Layout,
        site_maps: Sequence[tuple[float, Cells]],
    ) -> None:
        keys, robots = experiment.keys, experiment.size
        self._layout = layout
        self._states = States.of(keys)
        self._names = pa.array(self._states.names)
        # A lab's own programs send their number in the first byte, and anything in the others.
        self._ours = runs_aggregation(keys)
        self._index = np.arange(_NOBODY, LAST_UID, dtype=np.intp)
        if experiment.lab:
            self._index[:] = _NOBODY
            self._index[[uid for uid, _ in experiment.lab]] = np.arange(robots)
        self._maps = site_maps
        self._across, self._up = layout.centres()
        self._x = np.full(robots, np.nan, dtype=np.float32)
        self._y = np.full(robots, np.nan, dtype=np.float32)
        self._led = np.zeros(robots, dtype=np.uint8)
        self._site = np.zeros(robots, dtype=np.uint8)
        self.strangers = 0
        """Reports of robots that are not in the experiment."""

    def add(self, reports: Reports) -> pa.RecordBatch:
        """Takes reports in; gives them as rows."""
        robot, led = self._read(reports.data)
        row = 2 * reports.y.astype(np.intp) + (reports.cell < 2)
        column = 2 * reports.x.astype(np.intp) + reports.cell % 2
        x = self._across[column].astype(np.float32)
        y = self._up[row].astype(np.float32)
        known = (robot >= 0) & (robot < len(self._x))
        self.strangers += int(np.count_nonzero(~known))
        index = robot[known]
        self._x[index], self._y[index] = x[known], y[known]
        self._site[index] = self._map_at(float(reports.at_s[-1]))[row, column][known]
        if led is not None:
            self._led[index] = led[known]
        state = pa.nulls(len(robot), WORD)
        if led is not None:
            state = pa.DictionaryArray.from_arrays(self._states.of_robots(led), self._names)
        columns = [
            reports.at_s,
            robot.astype(np.int32),
            x,
            y,
            reports.x,
            reports.y,
            reports.cell,
            state,
            pa.array([data.tobytes() for data in reports.data], type=pa.binary(7)),
        ]
        return pa.record_batch(columns, schema=TRACKING_SCHEMA)

    def sample(self, tick: int) -> "Samples":
        """Samples as the engine makes them, of where robots were last received; NaN before that."""
        return {
            "tick": np.array([tick], dtype=np.int64),
            "x_m": self._x[None].copy(),
            "y_m": self._y[None].copy(),
            "heading_rad": np.full((1, len(self._x)), np.nan, dtype=np.float32),
            "led": self._led[None].copy(),
            "site": self._site[None].copy(),
        }

    def _read(self, data: NDArray[np.uint8]) -> tuple[NDArray[np.intp], NDArray[np.uint8] | None]:
        """Robots' indices, and their LEDs if the reports have them."""
        if self._ours:
            uid = data[:, 0] + data[:, 1].astype(np.intp) * 256
            return self._index[uid], data[:, 2]
        return self._index[data[:, 0] & 0x7F], None

    def _map_at(self, time_s: float) -> Cells:
        return map_at(self._maps, time_s)


def map_at(maps: Sequence[tuple[float, Cells]], time_s: float) -> Cells:
    """Each cell's site at a time."""
    return next(cells for from_s, cells in reversed(maps) if from_s <= max(time_s, 0.0))


def sites_of_cells(
    samples: "Samples", layout: Layout, maps: Sequence[tuple[float, Cells]], tick_s: float
) -> None:
    """On a grid a robot is on the site of the cell below its middle: puts that into `samples`."""
    row, column = layout.below(samples["x_m"], samples["y_m"])
    for index, tick in enumerate(samples["tick"]):
        cells = map_at(maps, float(tick) * tick_s)
        samples["site"][index] = cells[row[index], column[index]]
