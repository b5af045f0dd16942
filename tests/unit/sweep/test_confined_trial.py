"""A trial in a confined fork gives what it gives in this process, bit for bit, and no less."""

import json
from pathlib import Path

import pyarrow as pa
import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.files import confinement
from kilotwin.sweep import confined_trial
from kilotwin.sweep.measure import RESULT, Failed, Measured, Task, measure, part_of

ROOT = Path(__file__).resolve().parents[3]
TEXT = """\
duration_s = {duration_s}
arena.diameter_m = 1.0
[swarm]
profile = "kilobot"
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
    failed = confined_trial._answer(task(tmp_path), said, 0)
    assert isinstance(failed, Failed)
    assert (reason in failed.reason, failed.timed_out) == (True, False)


def test_a_table_of_other_columns_is_no_result(tmp_path: Path) -> None:
    made = measure(task(tmp_path))
    assert isinstance(made, Measured)
    metadata = pa.ipc.open_stream(made.part).schema.metadata
    other = part_of(pa.table({"tick": ["x"]}), json.loads(metadata[RESULT]))
    failed = confined_trial._answer(task(tmp_path), b'{"cpu_s": 1}\n' + other, 0)
    assert isinstance(failed, Failed)
