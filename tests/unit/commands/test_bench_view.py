"""`kilotwin bench view` makes runs that the viewer reads, and says what it lacks."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from kilotwin.commands.bench import Workload, bench
from kilotwin.errors import InputError, RunError
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples
from kilotwin.studies.bench.view import measure
from kilotwin.studies.bench.view_runs import write_run


def test_its_runs_are_read_as_any_other(tmp_path: Path) -> None:
    write_run(tmp_path / "run", 200, 1200)
    run = Run.open(tmp_path / "run")
    samples = RunSamples.of(run)
    assert (samples.samples, len(samples.robots.ids)) == (1200, 200)
    assert run.manifest["status"] == "finished"
    first, last = (samples.read([number]) for number in (0, 1199))
    assert np.mean(first["x_m"] != last["x_m"]) > 0.9
    assert np.abs(last["x_m"]).max() <= 0.5 * np.sqrt(200 / 100) + 1e-3


def test_without_playwright_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(RunError, match=r"type: pip install 'kilotwin\[bench\]'"):
        list(measure(1, lambda _: None))


def test_it_is_measured_by_itself() -> None:
    with pytest.raises(InputError, match="type: kilotwin bench view"):
        bench([Workload.view, Workload.walk])
