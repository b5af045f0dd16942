"""The benchmark of the viewer makes runs that the viewer reads."""

from pathlib import Path

import numpy as np
from tests.bench.view_runs import write_run

from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples


def test_its_runs_are_read_as_any_other(tmp_path: Path) -> None:
    write_run(tmp_path / "run", 200, 1200)
    run = Run.open(tmp_path / "run")
    samples = RunSamples.of(run)
    assert (samples.samples, len(samples.robots.ids)) == (1200, 200)
    assert run.manifest["status"] == "finished"
    first, last = (samples.read([number]) for number in (0, 1199))
    assert np.mean(first["x_m"] != last["x_m"]) > 0.9
    assert np.abs(last["x_m"]).max() <= 0.5 * np.sqrt(200 / 100) + 1e-3
