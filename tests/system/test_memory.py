"""What a robot takes of memory, with all lists of the engine, in a run that goes on."""

import json
import math
from pathlib import Path

import pytest

from .conftest import Kilotwin

PER_M2 = 31.8
WALKERS = """\
duration_s = 12.0
[arena]
shape = "rectangle"
width_m = {side}
height_m = {side}
[swarm]
profile = "kilobot"
program = "firmware/examples/random_walk_counter.c"
cpu = "native"
size = {size}
[engine]
threads = 1  # whose number would depend on how many robots there are
[medium]
kind = "{medium}"
range_m = 0.1
[record]
sample_s = 100.0
"""


@pytest.mark.parametrize(("medium", "most"), [("kilobot", 1820), ("ideal", 1790)])
def test_a_native_walker_takes_so_many_bytes_once_all_have_waited(
    kilotwin: Kilotwin, tmp_path: Path, medium: str, most: int
) -> None:
    """spinup_motors() waits: its call is kept meanwhile, and no memory of that for later."""
    peaks = {}
    for size in (2_000, 22_000):
        file = tmp_path / f"{size}.toml"
        side = round(math.sqrt(size / PER_M2), 2)
        file.write_text(WALKERS.format(side=side, size=size, medium=medium))
        peaks[size] = json.loads(kilotwin("run", str(file), "--json", "--quiet").stdout)
    took = [peaks[size]["peak_bytes"] for size in (2_000, 22_000)]
    assert (took[1] - took[0]) / 20_000 < most
