"""How much a run will write, before it runs.

What counts are rows of `robots`: bytes per row and column were measured with robots that walk all
over a large arena (docs/performance.md has the command); where they stand still it is less.
"""

import math
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from kilotwin.experiment.checks.experiment import swarm_size
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.units import counted, seconds

# Bytes per row in robots.arrows and robots.parquet together, compressed.
_ROBOT = 2.6
_COLUMNS = {
    "x_m": 7.3,
    "y_m": 7.3,
    "heading_rad": 7.4,
    "led": 0.5,
    "state": 0.5,
    "site": 0.2,
    "left_duty": 0.3,
    "right_duty": 0.3,
    "battery": 0.3,
    "sent": 0.4,
    "received": 1.4,
    "delivered": 1.4,
}
_ROUNDED = {"x_m": 5.4, "y_m": 5.4, "heading_rad": 3.6}  # with precision_m = 0.001
_METRIC = 16.0
# Per sample, of `sites` and `objects`; and what every run folder has.
_OF_A_SAMPLE = 60.0
_COUNT = 8.0
_OF_AN_OBJECT = 24.0
_OF_A_RUN = 20_000.0

_UNITS = (("kB", 1e3), ("MB", 1e6), ("GB", 1e9))


@dataclass(frozen=True)
class Size:
    """`rows` of robots.arrows, and bytes of the whole folder without prints and what a grid's host
    writes."""

    robots: int
    samples: int
    rows: int
    estimated_bytes: int

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        return asdict(self)

    def text(self) -> str:
        """One line."""
        rows = counted(self.rows, "row")
        return f"records about {bytes_text(self.estimated_bytes)}: {rows} of robots"

    def without_room(self, folder: Path) -> str | None:
        """A warning, if the disk that `folder` will be on has no room for it."""
        place = next(parent for parent in folder.absolute().parents if parent.exists())
        free = shutil.disk_usage(place).free
        if self.estimated_bytes <= free:
            return None
        return (
            f"{place} has {bytes_text(free)} free, and the run records about "
            f"{bytes_text(self.estimated_bytes)}; let [record] choose less, or give --out elsewhere"
        )


def size_of(keys: ExperimentSchema) -> Size:
    """The estimate for one run of the experiment to its end."""
    record, size = keys.record, swarm_size(keys)
    chosen = record.robots_of(size)
    robots = size if chosen is None else len(chosen)
    every_s = max(record.sample_s, seconds(keys.engine.step_ticks))
    samples = math.ceil(keys.duration_s / every_s) + 1
    rows = robots * (math.ceil((samples - 1) / record.robots_every) + 1)
    per_robot = sum(metric.per_robot for metric in keys.metric.values())
    of_row = _ROBOT + _METRIC * per_robot
    for name, of_column in _COLUMNS.items():
        if record.has_column(name):
            rounded = record.precision_m is not None and name in _ROUNDED
            of_row += _ROUNDED[name] if rounded else of_column
    columns = 2 * len(keys.site) + len(keys.metric)
    of_sample = _OF_A_SAMPLE + _COUNT * columns + _OF_AN_OBJECT * len(keys.object)
    estimated = _OF_A_RUN + rows * of_row + samples * of_sample
    return Size(robots, samples, rows, round(estimated))


def bytes_of(folder: Path) -> int:
    """Bytes of all files in a folder."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def bytes_text(count: float) -> str:
    """`40 kB`, `1.3 GB`."""
    unit, size = next(((u, s) for u, s in _UNITS if count < 1000 * s), _UNITS[-1])
    shown = count / size
    return f"{shown:.2g} {unit}" if shown < 10 else f"{shown:,.0f} {unit}"
