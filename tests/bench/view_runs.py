"""Run folders for the benchmark of the viewer, made without an engine: robots walk straight on."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import ExperimentText
from kilotwin.runs.folder import FINISHED, write_manifest
from kilotwin.runs.writer import RunWriter
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

_PER_M2 = 100.0
_SAMPLE_TICKS = 31
_SPEED_M = 0.01  # a sample
_STEP_M = 2.0**-12  # as `record.precision_m` rounds
_ROWS_A_BATCH = 100_000


def write_run(folder: Path, robots: int, samples: int) -> None:
    """A run that ended: `samples` of each of `robots`, a second apart, LEDs in eight colours.

    10^8 rows take some 20 s and 1 GB.
    """
    side = math.sqrt(robots / _PER_M2)
    text = f"""
name = "{robots} robots"
duration_s = {math.ceil(seconds(samples * _SAMPLE_TICKS))}
[arena]
shape = "rectangle"
width_m = {side}
height_m = {side}
[swarm]
profile = "kilobot"
cpu = "native"
program = "none.c"
size = {robots}
[record]
sample_s = 1.0
"""
    program = folder.parent / "none.c"
    program.write_text("")
    file = folder.parent / "view.toml"
    file.write_text(text)
    experiment = Experiment.of(ExperimentText.read(file, []))
    manifest = {"status": "running", "engine": "none"}
    writer = RunWriter(folder, experiment, manifest)
    draw = np.random.default_rng(1)
    places = draw.uniform(-side / 2, side / 2, (2, robots))
    heading = draw.uniform(-math.pi, math.pi, robots)
    at_once = max(1, _ROWS_A_BATCH // robots)
    for first in range(0, samples, at_once):
        number = np.arange(first, min(first + at_once, samples))
        writer.add(_samples(number, places, heading, side))
    writer.close(clean=False)
    manifest = json.loads((folder / "manifest.json").read_text())
    write_manifest(folder, {**manifest, "status": FINISHED})


def _samples(number: np.ndarray, places: np.ndarray, heading: np.ndarray, side: float) -> "Samples":
    """Samples as the engine makes them; who leaves the table comes in on its other side."""
    way = _SPEED_M * number[:, None]
    shape = (len(number), len(heading))
    x, y = (
        (start + way * part + side / 2) % side - side / 2
        for start, part in zip(places, (np.cos(heading), np.sin(heading)), strict=True)
    )
    led = (np.arange(len(heading)) + number[:, None] // 8) % 8
    return {
        "tick": number * _SAMPLE_TICKS,
        "x_m": (np.round(x / _STEP_M) * _STEP_M).astype(np.float32),
        "y_m": (np.round(y / _STEP_M) * _STEP_M).astype(np.float32),
        "heading_rad": np.broadcast_to(heading.astype(np.float32), shape),
        "led": np.array([0, 3, 12, 48, 15, 51, 60, 63], dtype=np.uint8)[led],
        "site": np.zeros(shape, dtype=np.uint8),
    }
