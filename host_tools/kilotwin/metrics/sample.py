"""One moment of a run, as metrics have it: the engine's numbers, and what functions are given."""

import base64
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.states import States
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples


@dataclass(frozen=True)
class Sample:
    """The argument of a metric's function; N robots. The arrays cannot be written to."""

    time_s: float
    positions_m: NDArray[np.float64]
    """[N, 2]; NaN for robots of a real table that were not seen yet."""
    headings_rad: NDArray[np.float64]
    """[N], counter-clockwise from x."""
    leds: NDArray[np.uint8]
    """[N], as RGB(r, g, b) makes them."""
    states: NDArray[np.str_]
    """[N]: names by [states], "RGB(r,g,b)" for a colour without one."""
    sites: NDArray[np.str_]
    """[N]: the site below each robot's middle, "" for none."""
    objects: NDArray[np.float64]
    """[objects, 3]: x_m, y_m, heading_rad of each [[object]]."""
    cells: NDArray[np.uint8] | None
    """[2 * rows, 2 * columns, 2], lower left first, colour and brightness; None without a grid that
    is emulated."""


@dataclass(frozen=True)
class Row:
    """One sample of the engine's; all that a function in another process needs."""

    tick: int
    x_m: NDArray[np.float32]
    y_m: NDArray[np.float32]
    heading_rad: NDArray[np.float32]
    led: NDArray[np.uint8]
    site: NDArray[np.uint8]
    objects: NDArray[np.float32]
    cells: NDArray[np.uint8] | None = None

    def packed(self) -> dict[str, Any]:
        """For JSON."""
        return {
            field.name: _packed(getattr(self, field.name))
            for field in fields(self)
            if getattr(self, field.name) is not None
        }

    @staticmethod
    def unpacked(message: dict[str, Any]) -> "Row":
        """ValueError, TypeError or KeyError of what is none."""
        tick = message["tick"]
        if not isinstance(tick, int):
            raise ValueError("no tick")
        arrays = {
            field.name: _unpacked(message[field.name])
            for field in fields(Row)
            if field.name in message and field.name != "tick"
        }
        return Row(tick, **arrays)


def _packed(value: Any) -> Any:
    if isinstance(value, int):
        return value
    data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
    return [value.dtype.str, list(value.shape), data]


def _unpacked(value: Any) -> NDArray[Any]:
    kind, shape, data = value
    if kind not in ("<f4", "|u1"):
        raise ValueError(f"no array of {kind}")
    return np.frombuffer(base64.b64decode(data), dtype=kind).reshape(shape)


def row_of(samples: "Samples", k: int, cells: NDArray[np.uint8] | None) -> Row:
    """The moment `k` in samples of the engine; `cells` as they are then, if that is known."""
    return Row(
        int(samples["tick"][k]),
        samples["x_m"][k],
        samples["y_m"][k],
        samples["heading_rad"][k],
        samples["led"][k],
        samples["site"][k],
        _objects(samples, k),
        cells,
    )


def _objects(samples: "Samples", k: int) -> NDArray[np.float32]:
    if "object_x_m" not in samples or not len(samples["object_x_m"]):
        return np.empty((0, 3), dtype=np.float32)
    columns = (
        samples["object_x_m"][k],
        samples["object_y_m"][k],
        samples["object_heading_rad"][k],
    )
    return np.stack(columns, axis=1)


class SampleMaker:
    """Names states and sites of an experiment."""

    def __init__(self, experiment: ExperimentSchema) -> None:
        self._table = States.of(experiment)
        self._states = np.array(self._table.names)
        self._sites = np.array(["", *(site.name for site in experiment.site)])

    def sample(self, row: Row) -> Sample:
        """As functions have it."""
        made = Sample(
            time_s=seconds(row.tick),
            positions_m=np.stack([row.x_m, row.y_m], axis=1).astype(np.float64),
            headings_rad=row.heading_rad.astype(np.float64),
            leds=row.led.copy(),
            states=self._states[self._table.of_robots(row.led)],
            sites=self._sites[row.site],
            objects=row.objects.astype(np.float64),
            cells=None if row.cells is None else row.cells.copy(),
        )
        for value in vars(made).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        return made
