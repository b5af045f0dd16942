"""The tables of a run folder: their columns and units, and the rows made from the engine's samples.

`robots`: a row per robot and sample, of robots and with columns that [record] chooses. `objects`: a
row per [[object]] and sample. `sites`: a row per sample, with columns named after the experiment's
sites (resting_<site>), states (state_<name>) and metrics (metric_<name>); in `robots` such a column
has each robot's own value.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kilotwin.experiment.checks.experiment import swarm_size
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.experiment.states import Counts, States
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.units import TICK_S

if TYPE_CHECKING:
    from kilotwin._emulator import ModuleRecord, Samples

WORD = pa.dictionary(pa.uint8(), pa.string())
"""The type of a column of few different words."""
_UNKNOWN = np.uint32(2**32 - 1)
Column: TypeAlias = NDArray[Any] | pa.Array
"""The values of a column, of numbers or as Arrow has them."""


@dataclass(frozen=True)
class Records:
    """Makes the record batches of one experiment. `about` goes into the schemas' metadata."""

    robots_schema: pa.Schema
    sites_schema: pa.Schema
    objects_schema: pa.Schema
    _states: pa.Array
    _sites: pa.Array
    _table: States
    _chosen: NDArray[np.uint32] | None
    _steps: Mapping[str, float]

    @staticmethod
    def of(experiment: ExperimentSchema, about: Mapping[str, str]) -> "Records":
        """The tables of `experiment`."""
        states = States.of(experiment)
        sites = [site.name for site in experiment.site]
        robots = [
            *_WHEN,
            field("robot", pa.uint32(), "index, uid less 1"),
            *(column for column in _OF_ROBOTS if experiment.record.has_column(column.name)),
            *_metric_fields(experiment, per_robot=True),
        ]
        objects = [
            *_WHEN,
            field("object", pa.uint32(), "index, in the order of the experiment"),
            field("x_m", pa.float32(), "m, of the object's own (0, 0)"),
            field("y_m", pa.float32(), "m"),
            field("heading_rad", pa.float32(), "rad, counter-clockwise from x"),
        ]
        return Records(
            pa.schema(robots, metadata=dict(about)),
            sites_schema(experiment, about),
            pa.schema(objects, metadata=dict(about)),
            pa.array(states.names),
            pa.array(sites, type=pa.string()),
            states,
            experiment.record.robots_of(swarm_size(experiment)),
            _steps(experiment),
        )

    def robots(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> pa.RecordBatch:
        """k samples as k rows of each robot that is recorded, in the order of samples, then of
        robots."""
        k, n = samples["led"].shape
        chosen = np.arange(n, dtype=np.uint32) if self._chosen is None else self._chosen
        tick = np.repeat(samples["tick"], len(chosen))
        columns: list[Column] = [tick, tick * TICK_S, np.tile(chosen, k)]
        of_robots: Mapping[str, NDArray[np.float64]] = measured.of_robots
        part = chosen if self._chosen is not None else slice(None)
        for column in _OF_ROBOTS:
            if column.name in self.robots_schema.names:
                columns.append(self._column(samples, column.name, part))
        if self._chosen is not None:
            of_robots = {name: values[:, chosen] for name, values in of_robots.items()}
        columns += _metric_columns(self.robots_schema, of_robots, len(tick))
        return _batch(columns, self.robots_schema)

    def _column(self, samples: "Samples", name: str, part: "NDArray[np.uint32] | slice") -> Column:
        """The rows of one of _OF_ROBOTS, of a part of the robots."""
        if name == "state":
            states = self._table.of_robots(samples["led"][:, part].ravel())
            return pa.DictionaryArray.from_arrays(_flat(states, pa.uint8()), self._states)
        if name == "site":
            site = samples["site"][:, part].ravel()
            # Site 0 is none; its index is masked.
            index = _flat(np.maximum(site, 1) - 1, pa.uint8(), known=site != 0)
            return pa.DictionaryArray.from_arrays(index, self._sites)
        if name == "led":
            return samples["led"][:, part].ravel()
        if name in EXTRA_OF:
            return self._extra(samples, name, part)
        values = {
            "x_m": samples["x_m"],
            "y_m": samples["y_m"],
            "heading_rad": samples["heading_rad"],
        }[name][:, part].ravel()
        step = self._steps.get(name)
        return values if step is None else np.round(values / np.float32(step)) * np.float32(step)

    def _extra(
        self, samples: "Samples", name: str, part: "NDArray[np.uint32] | slice"
    ) -> NDArray[Any] | pa.Array:
        if name in samples:
            values: NDArray[Any] = samples[name][:, part].ravel()  # type: ignore[literal-required]
            return _flat(values, pa.uint32(), values != _UNKNOWN) if name == "delivered" else values
        # Not known of real robots.
        return pa.nulls(samples["led"][:, part].size, self.robots_schema.field(name).type)

    def objects(self, samples: "Samples") -> pa.RecordBatch:
        """k samples of N objects as k * N rows; samples of the engine."""
        k, n = samples["object_x_m"].shape
        tick = np.repeat(samples["tick"], n)
        columns = [
            tick,
            tick * TICK_S,
            np.tile(np.arange(n, dtype=np.uint32), k),
            samples["object_x_m"].ravel(),
            samples["object_y_m"].ravel(),
            samples["object_heading_rad"].ravel(),
        ]
        return _batch(columns, self.objects_schema)

    def sites(
        self, samples: "Samples", counts: Counts, measured: MetricValues = NO_METRICS
    ) -> pa.RecordBatch:
        """A row per sample."""
        return sites_rows(self.sites_schema, samples, counts, measured)


def sites_schema(experiment: ExperimentSchema, about: Mapping[str, str]) -> pa.Schema:
    """The table `sites` of `experiment`; `about` goes into its metadata."""
    states = States.of(experiment)
    counts = [
        *(f"resting_{site.name}" for site in experiment.site),
        "not_resting",
        *(f"state_{state}" for state in states.names[: states.known]),
    ]
    columns = [
        *_WHEN,
        *(field(name, pa.uint32(), "robots") for name in counts),
        *_metric_fields(experiment, per_robot=False),
    ]
    return pa.schema(columns, metadata=dict(about))


def sites_rows(
    schema: pa.Schema, samples: "Samples", counts: Counts, measured: MetricValues
) -> pa.RecordBatch:
    """A row of the table `sites` per sample."""
    columns = [
        samples["tick"],
        samples["tick"] * TICK_S,
        *counts.resting.T,
        counts.not_resting,
        *counts.in_state.T,
        *_metric_columns(schema, measured.values, len(samples["tick"])),
    ]
    return _batch(columns, schema)


def _batch(columns: Sequence[Column], schema: pa.Schema) -> pa.RecordBatch:
    """Rows of these columns, numbers of which become those of the schema."""
    arrays = [
        column if isinstance(column, pa.Array) else _flat(column, wanted.type)
        for column, wanted in zip(columns, schema, strict=True)
    ]
    return pa.record_batch(arrays, schema=schema)


def _flat(
    values: NDArray[Any], kind: pa.DataType, known: NDArray[np.bool_] | None = None
) -> pa.Array:
    """Numbers as an array of that kind, null where they are not `known`. The memory is shared.

    pa.array() would load numpy.ma, which takes as long as a short run.
    """
    numbers = np.ascontiguousarray(values, dtype=kind.to_pandas_dtype())
    bits = None if known is None else pa.py_buffer(np.packbits(known, bitorder="little"))
    return pa.Array.from_buffers(kind, len(numbers), [bits, pa.py_buffer(numbers)])


def field(name: str, kind: pa.DataType, unit: str) -> pa.Field:
    """A column with its unit."""
    return pa.field(name, kind, metadata={"unit": unit})


_WHEN = [field("tick", pa.int64(), "32.768 ms"), field("time_s", pa.float64(), "s")]
_OF_ROBOTS = [
    field("x_m", pa.float32(), "m"),
    field("y_m", pa.float32(), "m"),
    field("heading_rad", pa.float32(), "rad, counter-clockwise from x"),
    field("led", pa.uint8(), "RGB(r, g, b) byte"),
    field("state", WORD, "what the LED means"),
    field("site", WORD, "site under the robot's centre, null for none"),
    field("left_duty", pa.uint8(), "0 to 255, as the motor is driven"),
    field("right_duty", pa.uint8(), "0 to 255"),
    field("battery", pa.uint16(), "reading of get_voltage(): 720 full, 580 empty"),
    field("sent", pa.uint32(), "messages since the begin"),
    field("received", pa.uint32(), "messages since the begin"),
    field("delivered", pa.uint32(), "of these, those that the program got; null for chips"),
]


def _steps(experiment: ExperimentSchema) -> dict[str, float]:
    """Powers of two to which columns are rounded: so the last bits of a float32 are zero, which
    takes less room compressed than steps of as many digits."""
    precision_m = experiment.record.precision_m
    if precision_m is None:
        return {}
    step_m = 2.0 ** math.floor(math.log2(precision_m))
    radius_m = PROFILES[experiment.swarm.profile].radius_m
    step_rad = 2.0 ** math.floor(math.log2(precision_m / radius_m))
    return {"x_m": step_m, "y_m": step_m, "heading_rad": step_rad}


METRIC = "metric_"
"""With which the names of metrics' columns begin."""


def _metric_fields(experiment: ExperimentSchema, *, per_robot: bool) -> list[pa.Field]:
    return [
        field(f"{METRIC}{name}", pa.float64(), metric.shown_unit)
        for name, metric in experiment.metric.items()
        if metric.per_robot or not per_robot
    ]


def _metric_columns(
    schema: pa.Schema, values: Mapping[str, NDArray[np.float64]], rows: int
) -> list[pa.Array]:
    """A column for each metric of the schema; NaN, or what was not measured, is null."""
    columns = []
    for name in schema.names:
        if name.startswith(METRIC):
            column = values.get(name.removeprefix(METRIC), np.full(rows, np.nan))
            numbers = column.ravel()
            columns.append(_flat(numbers, pa.float64(), known=~np.isnan(numbers)))
    return columns


TRACKING_SCHEMA = pa.schema(
    [
        field("time_s", pa.float64(), "s, when the host had it"),
        field("robot", pa.int32(), "index, uid less 1"),
        field("x_m", pa.float32(), "m, the cell's middle"),
        field("y_m", pa.float32(), "m, the cell's middle"),
        field("module_x", pa.uint8(), "column"),
        field("module_y", pa.uint8(), "row"),
        field("cell", pa.uint8(), "0 top left, 1 top right, 2 bottom left, 3 bottom right"),
        field("state", WORD, "what the robot's LED means, if it told"),
        field("data", pa.binary(7), "what the robot said"),
    ]
)
"""`tracking`: a row per report of a robot, as the host of a grid had it."""

MODULES_SCHEMA = pa.schema(
    [
        field("tick", pa.int64(), "32.768 ms"),
        field("time_s", pa.float64(), "s"),
        field("x", pa.uint8(), "column"),
        field("y", pa.uint8(), "row"),
        field("state", pa.string(), "of its runtime; of one on a board only whether it has power"),
        field("can", pa.string(), "its CAN controller: active, passive, bus_off, dead"),
        field("tec", pa.uint32(), "its transmit error counter"),
        field("rec", pa.uint32(), "its receive error counter"),
        field("frames_refused", pa.uint64(), "wrong length, out of range or order; so far"),
        field("frames_missed", pa.uint64(), "came while its buffers were full; so far"),
    ]
)
"""`modules`: a row per module and sample, row by row of modules from the lower left."""

COUNTERS = ("state", "can", "tec", "rec", "frames_refused", "frames_missed")
"""Columns of a module that are recorded, and told at any moment."""


def chosen_of(samples: "Samples", chosen: NDArray[np.bool_]) -> "Samples":
    """Some of the samples, with all that they have. Columns of objects are empty without any."""
    columns: Any = samples
    return cast(
        "Samples",
        {name: rows[chosen] if len(rows) else rows for name, rows in columns.items()},
    )


def module_rows(tick: int, modules: "list[ModuleRecord]") -> pa.RecordBatch:
    """The rows of one sample."""
    number = len(modules)
    when = [np.full(number, tick), np.full(number, tick * TICK_S)]
    rest = [
        [module[column.name] for module in modules]  # type: ignore[literal-required]
        for column in list(MODULES_SCHEMA)[len(when) :]
    ]
    arrays = [
        pa.array(values, type=column.type)
        for values, column in zip([*when, *rest], MODULES_SCHEMA, strict=True)
    ]
    return pa.record_batch(arrays, schema=MODULES_SCHEMA)


class StationKind(IntEnum):
    """Senders and receivers, as Trail::Kind of the engine."""

    ROBOT = 0
    CELL = 1
    BEACON = 2
    OVERHEAD = 3
    COMMAND = 4
    FLOOR = 5


_STATIONS = [kind.name.lower() for kind in StationKind]

FRAMES_SCHEMA = pa.schema(
    [
        field("begin_s", pa.float64(), "s, since the run began"),
        field("end_s", pa.float64(), "s, when it was received"),
        field("sender_kind", WORD, "robot, cell, beacon, overhead"),
        field("sender", pa.uint32(), "index of a robot; number of a cell, a beacon, a controller"),
        field("receiver_kind", WORD, "robot, cell"),
        field("receiver", pa.uint32(), "index of a robot; number of a cell"),
        field("type", pa.uint8(), "of the message"),
        field("data", pa.binary(9), "of the message"),
    ]
)
"""`frames`: a row per frame and receiver."""


def frame_rows(arrivals: NDArray[np.void]) -> pa.RecordBatch:
    """The rows of frames that the engine gives."""

    def words(name: str) -> pa.Array:
        return pa.DictionaryArray.from_arrays(pa.array(arrivals[name]), pa.array(_STATIONS))

    raw = arrivals["bytes"].tobytes()
    data = [raw[at : at + 9] for at in range(0, len(raw), 10)]
    columns = [
        pa.array(np.ascontiguousarray(arrivals["begin_s"])),
        pa.array(np.ascontiguousarray(arrivals["at_s"])),
        words("from_kind"),
        pa.array(np.ascontiguousarray(arrivals["from"])),
        words("to_kind"),
        pa.array(np.ascontiguousarray(arrivals["to"])),
        pa.array(np.frombuffer(raw, np.uint8)[9::10]),
        pa.array(data, pa.binary(9)),
    ]
    return pa.record_batch(columns, schema=FRAMES_SCHEMA)


CELLS_SCHEMA = pa.schema(
    [
        field("tick", pa.int64(), "32.768 ms"),
        field("time_s", pa.float64(), "s"),
        field("cell", pa.uint32(), "row by row of cells from the lower left"),
        field("colour", pa.uint8(), "bit 0 red, bit 1 green, bit 2 blue"),
        field("brightness", pa.uint8(), "the largest pulse width of the three"),
    ]
)
"""`cells`: a row for each cell at the samples at which it shows something else than before; dark
is not shown at first."""


def cell_rows(tick: int, cells: NDArray[np.intp], shown: NDArray[np.uint8]) -> pa.RecordBatch:
    """The rows of some cells at one sample. `shown`: [cells, 2] colour and brightness."""
    number = len(cells)
    columns = [np.full(number, tick), np.full(number, tick * TICK_S), cells, *shown.T]
    arrays = [
        pa.array(np.ascontiguousarray(values), type=column.type)
        for values, column in zip(columns, CELLS_SCHEMA, strict=True)
    ]
    return pa.record_batch(arrays, schema=CELLS_SCHEMA)


SENT_SCHEMA = pa.schema(
    [
        field("time_s", pa.float64(), "s, when the overhead controller had it"),
        field("asked_s", pa.float64(), "s, when the environment wanted it"),
        field("uid", pa.uint16(), "the robot's; 65535 for all robots"),
        field("type", pa.uint8(), "of the word; of the message for all robots"),
        field("value", pa.uint16(), "the word's, null in a message for all"),
        field("data", pa.binary(9), "a message for all, null in a word"),
    ]
)
"""`sent`: a row per word that an environment has told a robot, and per message for all."""
