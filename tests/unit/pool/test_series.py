"""A trial gives the same bytes in a confined fork, in a process with threads and in a run of its
own; whatever brings a fork down costs one trial."""

import contextlib
import gc
import json
import os
import threading
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.files import confinement
from kilotwin.session.black_box import BlackBox, Watch
from kilotwin.session.fork import Ended
from kilotwin.session.trial import Trial
from kilotwin.studies.pool import helper, series
from kilotwin.studies.pool.built import Builder, built_for
from kilotwin.studies.pool.series import run_series
from kilotwin.studies.pool.task import Answer, Done, Failed, Task
from kilotwin.studies.sweep.measure import RESULT, RESULT_KEYS, Apart, Rows, is_whole, part_of

ROOT = Path(__file__).resolve().parents[3]
TEXT = """\
duration_s = {duration_s}
arena.diameter_m = 1.0
[swarm]
profile = "kilobot"
cpu = "native"
program = "{root}/firmware/examples/random_walk_counter.c"
size = 5
"""
CRASHES = """\
#include <kilolib.h>
static void setup(void) { if (kilo_uid == 2 && rand_hard() < 128) *(volatile int *)0 = 1; }
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


def task(folder: Path, duration_s: float = 5, seed: int = 0, **how: Any) -> Task[bytes]:
    file = folder / "experiment.toml"
    file.write_text(TEXT.format(root=ROOT, duration_s=duration_s))
    return task_of(file, seed, **how)


def task_of(file: Path, seed: int = 0, **how: Any) -> Task[bytes]:
    experiment = Experiment.load(file)
    seeded = experiment.keys.model_copy(update={"seed": seed})
    experiment = replace(experiment, keys=seeded)
    return Task(experiment, Rows(), Builder().built(experiment).keys, **how)


def part(answer: Answer[bytes]) -> bytes:
    assert isinstance(answer, Done), answer
    return answer.value


def reason(answer: Answer[bytes]) -> str:
    assert isinstance(answer, Failed)
    return answer.reason


def test_a_trial_gives_the_same_bytes_alone_in_a_series_trusted_and_as_a_run(
    tmp_path: Path,
) -> None:
    tasks = [task(tmp_path, seed=seed) for seed in range(4)]
    of_series = [part(answer) for answer in run_series(tasks)]
    assert [part(run_series([one])[0]) for one in tasks] == of_series
    assert part(run_series([replace(tasks[3], trusted=True)])[0]) == of_series[3]
    assert part(Apart(tasks[3], tmp_path / "run")()) == of_series[3]
    assert len(set(of_series)) == 4


def counted_forks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Gets an item for each fork from now on."""
    forks: list[int] = []
    fork = os.fork

    def counting() -> int:
        forks.append(1)
        return fork()

    monkeypatch.setattr("os.fork", counting)
    return forks


def test_trials_of_the_same_programs_share_a_fork_and_others_do_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    forks = counted_forks(monkeypatch)
    one = task(tmp_path)
    other = replace(one, programs=("other",))
    run_series([one, one, one, other, other])
    assert len(forks) == 2


def test_a_trial_that_is_closed_lets_its_engine_go_at_once(tmp_path: Path) -> None:
    one = task(tmp_path)
    gc.disable()
    try:
        with BlackBox.made() as box:
            job = built_for(one).job(one.experiment, box.path, variant="plain")
            trial = Trial(job, lambda _: None, lambda: one.outcome.writer(one.experiment))
            assert trial.run(lambda: False)
            trial.close()
            kept = weakref.ref(trial)
            del trial
            assert kept() is None
    finally:
        gc.enable()


def test_a_trial_past_its_time_says_so(tmp_path: Path) -> None:
    late = task(tmp_path, 1e8, timeout_s=0.5, timeout_name="trial_timeout_s")
    (failed,) = run_series([late])
    assert isinstance(failed, Failed)
    assert failed.timed_out
    assert failed.reason.startswith("stopped after trial_timeout_s = 0.5, when")


def test_trials_are_confined_unless_they_are_trusted_where_their_study_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = task(tmp_path)
    assert series.is_confined(one)
    assert not series.is_confined(replace(one, trusted=True))
    monkeypatch.setenv(confinement.VARIABLE, "off")
    assert Task.trusts()
    assert not series.is_confined(one)


def test_where_confinement_is_required_a_metrics_function_is_confined_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.py").write_text("def one(sample):\n    return 1.0\n")
    file = tmp_path / "mine.toml"
    text = TEXT.format(root=ROOT, duration_s=5)
    file.write_text(f'{text}[metric.mine]\nfunction = "mine.py:one"\n')
    tasks = [task_of(file, seed) for seed in range(2)]
    assert not series.is_confined(tasks[0])
    free = [part(answer) for answer in run_series(tasks)]
    monkeypatch.setenv(confinement.VARIABLE, "require")
    assert series.is_confined(tasks[0])
    forks = counted_forks(monkeypatch)
    assert [part(answer) for answer in run_series(tasks)] == free
    assert len(forks) == 2


def test_what_the_kernel_lacks_is_a_failed_trial_where_it_is_required(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kilotwin._emulator.lacking_layers", lambda: ["no Landlock"])
    assert isinstance(run_series([task(tmp_path)])[0], Done)
    monkeypatch.setenv(confinement.VARIABLE, "require")
    assert "--confine=require: no Landlock" in reason(run_series([task(tmp_path)])[0])


@contextlib.contextmanager
def another_thread() -> Iterator[None]:
    ends = threading.Event()
    thread = threading.Thread(target=ends.wait)
    thread.start()
    try:
        yield
    finally:
        ends.set()
        thread.join()


@pytest.fixture
def other_thread() -> Iterator[None]:
    """This process has a second thread, as a Dask worker has."""
    with another_thread():
        yield


def test_a_process_with_threads_has_a_helper_that_forks_and_gives_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tasks = [task(tmp_path, seed=seed) for seed in range(2)]
    plain = [part(answer) for answer in run_series(tasks)]
    with another_thread():
        monkeypatch.setattr("os.fork", lambda: pytest.fail("a fork of a process with threads"))
        for _ in range(2):
            assert [part(answer) for answer in run_series(tasks)] == plain


def harmful(folder: Path, way: int) -> Task[bytes]:
    file = folder / f"harmful-{way}.toml"
    defines = ['VICTIM=""', 'OUTSIDE=""', f"WAY={way}"]
    robots = f"[[robots]]\nprogram = '{ROOT}/tests/hostile/in_sweep.c'\ndefine = {defines}\n"
    swarm = TEXT.partition("program")[0].format(duration_s=3)
    file.write_text(f"{swarm}{robots}count = 2\n")
    return task_of(file)


@pytest.mark.parametrize(("way", "why"), [(3, "system call"), (4, "without a result")])
def test_a_program_that_ends_its_fork_costs_its_own_trial_alone(
    way: int, why: str, tmp_path: Path
) -> None:
    good, bad = task(tmp_path), harmful(tmp_path, way)
    answers = run_series([good, bad, good])
    assert why in reason(answers[1])
    assert part(answers[0]) == part(answers[2])


@pytest.mark.parametrize(("way", "why"), [(3, "system call"), (4, "without a result")])
def test_a_helper_outlives_a_program_that_would_end_it(
    way: int, why: str, tmp_path: Path, other_thread: None
) -> None:
    bad, good = run_series([harmful(tmp_path, way), task(tmp_path)])
    assert why in reason(bad)
    assert isinstance(good, Done)


def test_a_robot_that_crashes_costs_its_trial_and_ends_the_fork_behind_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "crashes.c").write_text(CRASHES)
    file = tmp_path / "crashes.toml"
    swarm = TEXT.partition("program")[0].format(duration_s=3)
    file.write_text(f'{swarm}[[robots]]\nprogram = "crashes.c"\ncount = 2\n')
    tasks = [task_of(file, seed) for seed in range(12)]
    forks = counted_forks(monkeypatch)
    answers = run_series(tasks)
    failed = [isinstance(answer, Failed) for answer in answers]
    assert set(failed) == {True, False}
    assert len(forks) == sum(failed) + (not failed[-1])
    assert all("crash at crashes.c:2" in reason(one) for one in answers if isinstance(one, Failed))
    alone = [run_series([one])[0] for one in tasks]
    assert [isinstance(answer, Failed) or part(answer) for answer in answers] == [
        isinstance(answer, Failed) or part(answer) for answer in alone
    ]


def test_a_program_that_cannot_be_built_is_a_failed_trial(tmp_path: Path) -> None:
    one = task(tmp_path)
    file = tmp_path / "broken.toml"
    file.write_text(TEXT.format(root=ROOT, duration_s=3).replace(f"{ROOT}/firmware/examples/", ""))
    (tmp_path / "random_walk_counter.c").write_text("int main(void) { return nothing; }\n")
    broken = replace(one, experiment=Experiment.load(file), programs=("broken",))
    failed, good = run_series([broken, one])
    assert "random_walk_counter.c: does not compile" in reason(failed)
    assert isinstance(good, Done)


def test_a_helper_that_is_gone_costs_its_trials_and_is_replaced(
    tmp_path: Path, other_thread: None
) -> None:
    one = task(tmp_path)
    assert isinstance(run_series([one])[0], Done)
    process = helper._of_thread.helper._process
    process.kill()
    process.wait()
    assert ["ended without a result" in reason(it) for it in run_series([one, one])] == [True] * 2
    assert isinstance(run_series([one])[0], Done)


def said_instead(folder: Path, said: bytes) -> Sequence[Any]:
    return series._told(task(folder), said)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (b"", "what is no result"),
        (b"[" * 100_000, "what is no result"),
        (b'{"cpu_s": "x", "goes_on": true}\n', "what is no result"),
        (b'{"cpu_s": 1, "goes_on": true}\n', "what is no result"),
        (b'{"cpu_s": 1, "goes_on": true}\nARROW1', "what is no result"),
        (b'{"failed": "why", "timed_out": 5, "goes_on": 1}\n', "why"),
    ],
)
def test_what_a_program_may_write_in_its_place_is_a_failed_trial_and_ends_the_fork(
    said: bytes, why: str, tmp_path: Path
) -> None:
    failed, goes_on = said_instead(tmp_path, said)
    assert isinstance(failed, Failed)
    assert (why in failed.reason, failed.timed_out, goes_on) == (True, False, False)


def test_a_fork_that_ended_itself_has_no_result(tmp_path: Path) -> None:
    box = BlackBox(tmp_path / "box")
    failed = series._ended(task(tmp_path), Ended(b"", 0), Watch(box), box)
    assert failed == Failed("its process ended without a result")


def test_a_part_whose_content_is_not_what_its_types_say_is_not_whole() -> None:
    result = dict.fromkeys(RESULT_KEYS, 0)
    offsets = pa.py_buffer(np.array([0, 1], np.int32).tobytes())
    for text, whole in ((b"a", True), (b"\xff", False)):
        column = pa.StringArray.from_buffers(1, offsets, pa.py_buffer(text))
        table = pa.table({"x": column})
        assert is_whole(part_of(table, result), table.schema) == whole


def test_a_table_of_other_columns_is_no_result(tmp_path: Path) -> None:
    made = part(run_series([task(tmp_path)])[0])
    metadata = pa.ipc.open_stream(made).schema.metadata
    other = part_of(pa.table({"tick": ["x"]}), json.loads(metadata[RESULT]))
    failed, _ = said_instead(tmp_path, b'{"cpu_s": 1, "goes_on": true}\n' + other)
    assert isinstance(failed, Failed)
