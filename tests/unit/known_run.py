"""A run folder with samples that a test knows."""

import contextlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.folder import RUNNING
from kilotwin.runs.writer import RunWriter

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

ROBOTS = 10

Begin = Callable[..., RunWriter]


def samples(ticks: Iterable[int], *, extras: bool = False) -> "Samples":
    """Samples as the engine makes them, at random places; with `extras` as for all of `also`."""
    when = np.array(list(ticks), dtype=np.int64)
    draw = np.random.default_rng(when)
    shape = (len(when), ROBOTS)
    made: Samples = {
        "tick": when,
        "x_m": draw.uniform(-1, 1, shape).astype(np.float32),
        "y_m": draw.uniform(-1, 1, shape).astype(np.float32),
        "heading_rad": draw.uniform(-7, 7, shape).astype(np.float32),
        "led": draw.integers(0, 64, shape).astype(np.uint8),
        "site": draw.integers(0, 3, shape).astype(np.uint8),
    }
    if extras:
        made["left_duty"] = draw.integers(0, 256, shape).astype(np.uint8)
        made["right_duty"] = draw.integers(0, 256, shape).astype(np.uint8)
        made["battery"] = draw.integers(580, 721, shape).astype(np.uint16)
        made["sent"] = np.cumsum(draw.integers(0, 40, shape), axis=0, dtype=np.uint32)
        made["received"] = np.cumsum(draw.integers(0, 400, shape), axis=0, dtype=np.uint32)
        made["delivered"] = made["received"] - draw.integers(0, 2, shape).astype(np.uint32)
    return made


@contextlib.contextmanager
def beginning(load: Callable[..., Experiment], small: str, folder: Path) -> Iterator[Begin]:
    """`begin("run", "key=value", ...)`: the writer of a run in `folder` that has begun."""
    with contextlib.ExitStack() as stack:

        def begin(name: str = "run", *settings: str, text: str = small) -> RunWriter:
            experiment: Experiment = load(text, *settings)
            manifest = {"status": RUNNING, "engine": "test"}
            writer = RunWriter(folder / name, experiment, manifest)
            stack.callback(_close, writer)
            return writer

        yield begin


def _close(writer: RunWriter) -> None:
    with contextlib.suppress(pa.ArrowInvalid):  # a test closed it
        writer.close(clean=False)
