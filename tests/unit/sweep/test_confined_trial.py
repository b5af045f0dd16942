"""A trial in a confined fork gives what it gives in this process, bit for bit, and no less."""

import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.files import confinement
from kilotwin.session.fork import Ended
from kilotwin.studies.sweep import confined_trial, parts, trial_helper
from kilotwin.studies.sweep.measure import (
    RESULT,
    RESULT_KEYS,
    Failed,
    Measured,
    Task,
    measure,
    part_of,
)

ROOT = Path(__file__).resolve().parents[3]
TEXT = """\
duration_s = {duration_s}
arena.diameter_m = 1.0
[swarm]
profile = "kilobot"
cpu = "native"
program = "{root}/firmware/blank.c"
size = 5
"""


def task(folder: Path, duration_s: float = 5, timeout_s: float | None = None) -> Task:
    file = folder / "experiment.toml"
    file.write_text(TEXT.format(root=ROOT, duration_s=duration_s))
    return Task("key", Experiment.load(file), folder / "failed", timeout_s)


def test_a_confined_trial_gives_the_bytes_of_one_that_is_not(tmp_path: Path) -> None:
    confined, plain = confined_trial.measure_confined(task(tmp_path)), measure(task(tmp_path))
    assert isinstance(confined, Measured), confined
    assert isinstance(plain, Measured)
    assert (confined.part, confined.engine_sha256) == (plain.part, plain.engine_sha256)


def test_a_confined_trial_past_its_time_says_so(tmp_path: Path) -> None:
    failed = confined_trial.measure_confined(task(tmp_path, 1e8, 0.5))
    assert isinstance(failed, Failed)
    assert failed.timed_out
    assert failed.reason.startswith("stopped after trial_timeout_s = 0.5")


def test_trusted_programs_are_not_confined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(confinement.VARIABLE, "off")
    monkeypatch.setattr("os.fork", lambda: pytest.fail("a fork"))
    assert isinstance(confined_trial.measure_confined(task(tmp_path)), Measured)


def test_a_trial_that_its_sweep_trusts_is_not_confined_where_it_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.fork", lambda: pytest.fail("a fork"))
    trusted = replace(task(tmp_path), trusted=True)
    assert isinstance(confined_trial.measure_confined(trusted), Measured)


@pytest.fixture
def other_thread() -> Iterator[None]:
    """This process has a second thread, as a Dask worker has."""
    ends = threading.Event()
    thread = threading.Thread(target=ends.wait)
    thread.start()
    yield
    ends.set()
    thread.join()


def test_a_process_with_threads_has_a_helper_that_confines_and_gives_the_same_bytes(
    tmp_path: Path, other_thread: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = measure(task(tmp_path))
    monkeypatch.setattr("os.fork", lambda: pytest.fail("a fork of a process with threads"))
    first, second = (confined_trial.measure_confined(task(tmp_path)) for _ in range(2))
    for confined in (first, second):
        assert isinstance(plain, Measured)
        assert isinstance(confined, Measured), confined
        assert confined.part == plain.part


@pytest.mark.parametrize(("way", "reason"), [(3, "system call"), (4, "without a result")])
def test_a_helper_outlives_a_program_that_would_end_it(
    way: int, reason: str, tmp_path: Path, other_thread: None
) -> None:
    file = tmp_path / "harmful.toml"
    defines = ['VICTIM=""', 'OUTSIDE=""', f"WAY={way}"]
    robots = f"[[robots]]\nprogram = '{ROOT}/tests/hostile/in_sweep.c'\ndefine = {defines}\n"
    swarm = TEXT.partition("program")[0].format(duration_s=3)
    file.write_text(f"{swarm}{robots}count = 2\n")
    failed = confined_trial.measure_confined(Task("key", Experiment.load(file), tmp_path / "f"))
    assert isinstance(failed, Failed)
    assert reason in failed.reason
    assert isinstance(confined_trial.measure_confined(task(tmp_path)), Measured)


def test_a_helper_that_is_gone_costs_a_trial_and_is_replaced(
    tmp_path: Path, other_thread: None
) -> None:
    assert isinstance(confined_trial.measure_confined(task(tmp_path)), Measured)
    helper = trial_helper._of_thread.helper
    helper._process.kill()
    helper._process.wait()
    failed = confined_trial.measure_confined(task(tmp_path))
    assert isinstance(failed, Failed)
    assert "ended without a result" in failed.reason
    assert isinstance(confined_trial.measure_confined(task(tmp_path)), Measured)


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        (b"", "without a result"),
        (b"[" * 100_000, "without a result"),
        (b'{"cpu_s": "x"}\n', "without a result"),
        (b'{"cpu_s": 1}\n', "what is no result"),
        (b'{"cpu_s": 1}\nARROW1', "what is no result"),
        (b'{"failed": "why", "timed_out": 5}\n', "why"),
    ],
)
def test_what_a_program_may_write_in_its_place_is_a_failed_trial(
    said: bytes, reason: str, tmp_path: Path
) -> None:
    failed = confined_trial._answer(task(tmp_path), Ended(said, 0))
    assert isinstance(failed, Failed)
    assert (reason in failed.reason, failed.timed_out) == (True, False)


def test_a_part_whose_content_is_not_what_its_types_say_is_not_whole() -> None:
    result = dict.fromkeys(RESULT_KEYS, 0)
    offsets = pa.py_buffer(np.array([0, 1], np.int32).tobytes())
    for text, whole in ((b"a", True), (b"\xff", False)):
        column = pa.StringArray.from_buffers(1, offsets, pa.py_buffer(text))
        assert parts.is_whole(part_of(pa.table({"x": column}), result)) == whole


def test_a_table_of_other_columns_is_no_result(tmp_path: Path) -> None:
    made = measure(task(tmp_path))
    assert isinstance(made, Measured)
    metadata = pa.ipc.open_stream(made.part).schema.metadata
    other = part_of(pa.table({"tick": ["x"]}), json.loads(metadata[RESULT]))
    failed = confined_trial._answer(task(tmp_path), Ended(b'{"cpu_s": 1}\n' + other, 0))
    assert isinstance(failed, Failed)
