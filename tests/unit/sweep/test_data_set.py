"""A sweep's folder: parts that come in any order make the same tables."""

import contextlib
import errno
import json
import os
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kilotwin.errors import InputError, RunError
from kilotwin.files import resources
from kilotwin.runs.columns import Records
from kilotwin.studies.pool.places import Dask, Processes
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.pool.series import engine_sha256
from kilotwin.studies.pool.task import Answer, Done, Failed, Task
from kilotwin.studies.sweep.conditions import Condition, Conditions, Ending
from kilotwin.studies.sweep.data_set import DataSet, trial_key
from kilotwin.studies.sweep.measure import part_of
from kilotwin.studies.sweep.parts import Parts
from kilotwin.studies.sweep.plan import Plan, read_plan
from kilotwin.studies.sweep.report import summary_text
from kilotwin.studies.sweep.runner import Estimate, Sweep

from ..conftest import GIVEN, WIRE

SWEEP = """\
name = "sizes"
base = "small.toml"
seeds = 2
vary.swarm.size = [3, 5]
set.swarm.informed = 0.4
set.controller.rule = "firat"
set.swarm.informed_for = { black = 0.5, white = 0.5 }
"""


@pytest.fixture
def plan(folder: Path) -> Plan:
    (folder / "sweep.toml").write_text(SWEEP)
    return read_plan(folder / "sweep.toml")


def measured(plan: Plan, index: int) -> tuple[str, bytes]:
    """The key, and a result that depends on the trial alone."""
    trial = plan.trials[index]
    schema = Records.of(trial.experiment.keys, {}).sites_schema
    rows = [[0, 305]] + [[0.0, 10.0]] + [[index, 1]] * (len(schema) - 2)
    table = pa.table([pa.array(c, f.type) for c, f in zip(rows, schema, strict=True)], schema)
    size = trial.experiment.size
    result = {
        "robots": size,
        "resting": {"black": index, "white": 0},
        "not_resting": size - index,
        "result_hash": f"{index:016x}",
        "final_hash": f"{index:016x}",
    }
    return key(plan, index), part_of(table, result)


def key(plan: Plan, index: int) -> str:
    return trial_key(plan.trials[index], ["program"])


def keys(plan: Plan) -> list[str]:
    return [key(plan, index) for index in range(len(plan.trials))]


def data_set(folder: Path, plan: Plan, engine: str = "engine") -> DataSet:
    data = DataSet.at(folder, engine)
    data.begin(plan, keys(plan))
    return data


def test_the_tables_are_the_same_in_whatever_order_trials_came(plan: Plan, tmp_path: Path) -> None:
    contents = []
    for name, order in (("a", [0, 1, 2, 3]), ("b", [3, 1, 0, 2])):
        data = data_set(tmp_path / name, plan)
        for index in order:
            data.add(*measured(plan, index))
        assert data.assemble(plan, keys(plan)) == 4
        files = ("trials.parquet", "series.parquet")
        contents.append([(data.folder / file).read_bytes() for file in files])
    assert contents[0] == contents[1]


def test_a_series_written_in_several_groups_has_each_row_once(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables = []
    for name, row_group in (("whole", 1000), ("in-groups", 3)):
        monkeypatch.setattr("kilotwin.studies.sweep.data_set._ROW_GROUP", row_group)
        data = data_set(tmp_path / name, plan)
        for index in range(4):
            data.add(*measured(plan, index))
        data.assemble(plan, keys(plan))
        file = pq.ParquetFile(data.folder / "series.parquet")
        assert file.num_row_groups == (1 if row_group == 1000 else 2)
        tables.append(file.read())
    assert tables[0].equals(tables[1])
    assert tables[0]["trial"].to_pylist() == [0, 0, 1, 1, 2, 2, 3, 3]


def test_a_row_says_what_varied_and_how_it_ended(plan: Plan, tmp_path: Path) -> None:
    data = data_set(tmp_path / "out", plan)
    data.add(*measured(plan, 2))
    assert data.assemble(plan, keys(plan)) == 1
    (row,) = pq.read_table(data.folder / "trials.parquet").to_pylist()
    assert row == {
        "trial": 2,
        "key": key(plan, 2),
        "base": "small",
        "seed": 1,
        "swarm.size": 5,
        "robots": 5,
        "resting_black": 2,
        "resting_white": 0,
        "not_resting": 3,
        "rule": "firat",
        "reading": "reading A",
        "informed": 0.4,
        "share_black": 0.5,
        "share_white": 0.5,
        "result_hash": "0000000000000002",
    }
    series = pq.read_table(data.folder / "series.parquet")
    assert series["trial"].to_pylist() == [2, 2]
    assert series["resting_black"].to_pylist() == [2, 1]


def test_lists_and_tables_are_text_as_it_is_written(folder: Path, tmp_path: Path) -> None:
    (folder / "sweep.toml").write_text(
        'base = "small.toml"\nset.swarm.informed = 0.4\nset.controller = {}\n[vary]\n'
        'states = [{ "mü" = "red" }, { "mü" = "blue" }]\n'
        "[[together]]\nswarm.informed_for = [{ black = 0.5, white = 0.5 }]\n"
    )
    plan = read_plan(folder / "sweep.toml")
    data = data_set(tmp_path / "out", plan)
    data.add(*measured(plan, 0))
    data.assemble(plan, keys(plan))
    (row,) = pq.read_table(data.folder / "trials.parquet").to_pylist()
    assert row["states"] == '{"mü": "red"}'
    assert row["swarm.informed_for"] == '{"black": 0.5, "white": 0.5}'


def test_nothing_finished_makes_no_tables(plan: Plan, tmp_path: Path) -> None:
    data = data_set(tmp_path / "out", plan)
    assert data.assemble(plan, keys(plan)) == 0
    with pytest.raises(InputError, match="no trial is finished yet"):
        Conditions.open(tmp_path / "out")


def test_a_folder_goes_on_only_with_the_engine_that_made_it(plan: Plan, tmp_path: Path) -> None:
    data_set(tmp_path / "out", plan)
    data_set(tmp_path / "out", plan)
    with pytest.raises(InputError, match="another engine made the trials"):
        data_set(tmp_path / "out", plan, "another")


def test_looking_at_a_folder_writes_nothing(plan: Plan, tmp_path: Path) -> None:
    before = sorted(tmp_path.rglob("*"))
    assert not len(DataSet.at(tmp_path / "out", "engine").parts)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_file_is_no_folder(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="file: a file; name a folder"):
        DataSet.at(tmp_path / "file", "engine")
    with pytest.raises(InputError, match=r"not a directory; see to the disk, or name another"):
        data_set(tmp_path / "file" / "out", plan)


@pytest.mark.parametrize(
    "content", ["", "{", "{}", "[]", "3", '{"engine_sha256": 3, "name": null}']
)
def test_a_damaged_sweep_json_is_named(plan: Plan, tmp_path: Path, content: str) -> None:
    data = data_set(tmp_path / "out", plan)
    (data.folder / "sweep.json").write_text(content)
    data.add(*measured(plan, 0))
    data.assemble(plan, keys(plan))
    with pytest.raises(InputError, match=r"sweep\.json: damaged; put back a copy"):
        DataSet.at(data.folder, "engine")
    with pytest.raises(InputError, match=r"sweep\.json: damaged; put back a copy"):
        Conditions.open(data.folder)


def test_what_a_kill_left_at_the_very_start_is_no_other_folder(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / ".sweep.json.new").write_text("{")
    data_set(tmp_path / "out", plan)


def test_tables_of_another_plan_are_made_anew_before_a_trial_runs(
    plan: Plan, folder: Path, tmp_path: Path
) -> None:
    data = data_set(tmp_path / "out", plan)
    for index in range(4):
        data.add(*measured(plan, index))
    data.assemble(plan, keys(plan))
    (folder / "sweep.toml").write_text(SWEEP.replace('"sizes"', '"large"').replace("3, 5", "5, 7"))
    other = read_plan(folder / "sweep.toml")
    data_set(data.folder, other)
    rows = pq.read_table(data.folder / "trials.parquet").to_pylist()
    assert [(row["trial"], row["key"]) for row in rows] == [(0, key(plan, 2)), (1, key(plan, 3))]
    assert Conditions.open(data.folder).name == "large"

    (folder / "sweep.toml").write_text(SWEEP.replace("3, 5", "8, 9"))
    data_set(data.folder, read_plan(folder / "sweep.toml"))
    assert not list(data.folder.glob("*.parquet"))
    data_set(data.folder, plan)
    assert pq.read_table(data.folder / "trials.parquet").num_rows == 4


KEYS = [f"{number:032x}" for number in range(4)]
STREAMS = {key: bytes([65 + number]) * (number * 100) for number, key in enumerate(KEYS)}


def parts_in(file: Path) -> Parts:
    """All of STREAMS, one after the other."""
    parts = Parts(file)
    for key, stream in STREAMS.items():
        parts.add(key, stream)
    return parts


def test_parts_are_read_as_they_were_added_by_who_added_them_and_by_others(tmp_path: Path) -> None:
    for parts in (parts_in(tmp_path / "parts"), Parts(tmp_path / "parts")):
        assert {key: parts.read(key) for key in KEYS} == STREAMS
        assert (parts.read("f" * 32), "f" * 32 in parts, len(parts)) == (None, False, 4)
        assert parts.damaged == []


def test_a_part_that_a_kill_has_cut_is_missing_and_the_next_takes_its_place(tmp_path: Path) -> None:
    file = tmp_path / "parts"
    parts_in(file)
    content = file.read_bytes()
    last = len(Parts(file).read(KEYS[3]) or b"")
    for length in range(1, last + 80, 7):
        file.write_bytes(content[:-length])
        parts = Parts(file)
        assert ([key in parts for key in KEYS], parts.damaged) == ([True] * 3 + [False], [])
        parts.mend()
        parts.add(KEYS[3], STREAMS[KEYS[3]])
        assert file.read_bytes() == content


def test_an_interrupt_while_the_disk_is_waited_for_loses_no_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    parts = Parts(tmp_path / "parts")
    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        parts.add(KEYS[2], STREAMS[KEYS[2]])
    assert parts.read(KEYS[2]) == Parts(tmp_path / "parts").read(KEYS[2]) == STREAMS[KEYS[2]]


def test_a_flipped_bit_anywhere_costs_the_part_that_it_is_in(tmp_path: Path) -> None:
    file = tmp_path / "parts"
    parts_in(file)
    content = file.read_bytes()
    second = content.index(b"B" * 100)
    for place in range(second - 88, second + 100):
        flipped = bytearray(content)
        flipped[place] ^= 16
        file.write_bytes(flipped)
        parts = Parts(file)
        assert [key in parts for key in KEYS] == [True, False, True, True], place
        assert len(parts.damaged) == 1
        parts.mend()
        assert [key in Parts(file) for key in KEYS] == [True, False, True, True], place
        assert Parts(file).damaged == []


def test_a_file_of_something_else_has_no_parts(tmp_path: Path) -> None:
    file = tmp_path / "parts"
    for content in (b"", b"something else", b"\0" * 1000):
        file.write_bytes(content)
        assert len(Parts(file)) == 0


def damage(data: DataSet, place: int) -> None:
    """Flips a bit of a data set's parts."""
    file = data.folder / "parts"
    content = bytearray(file.read_bytes())
    content[place] ^= 1
    file.write_bytes(content)


def test_a_sweep_runs_damaged_trials_again_and_says_so(plan: Plan, tmp_path: Path) -> None:
    notes: list[str] = []
    sweep = Sweep.prepare(plan, tmp_path / "out", notes.append)
    assert (len(sweep.missing()), sweep.there) == (4, set())
    sweep.data.begin(plan, sweep.keys)
    for index, own in enumerate(sweep.keys):
        sweep.data.add(own, measured(plan, index)[1])
    damage(sweep.data, 200)
    again = Sweep.prepare(plan, tmp_path / "out", notes.append)
    assert "damaged at 1 place, the first at byte 0; trials that stood there" in notes[-1]
    assert [own for _, own in again.missing()] == [sweep.keys[0]]
    assert again.estimate().done == 3


def test_a_part_damaged_while_the_sweep_ran_is_told(plan: Plan, tmp_path: Path) -> None:
    data = data_set(tmp_path / "out", plan)
    for index in range(4):
        data.add(*measured(plan, index))
    sweep = Sweep(plan, data, keys(plan), set(keys(plan)))
    assert (sweep.finish(), sweep.exit_code) == (4, 0)
    damage(data, -1)
    assert (sweep.finish(), sweep.exit_code) == (3, 1)
    assert "damaged on the disk since: 1 of the trials" in summary_text(sweep.summary(3))


def test_a_full_disk_is_an_error_and_leaves_all_as_it_was(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = data_set(tmp_path / "out", plan)
    data.add(*measured(plan, 0))
    data.assemble(plan, keys(plan))
    before = {file: file.read_bytes() for file in data.folder.rglob("*") if file.is_file()}

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("kilotwin.studies.sweep.parts._SYNC_S", 0.0)
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RunError, match=r"cannot write \(no space left on device\); make room"):
        data.add(*measured(plan, 1))
    with pytest.raises(RunError, match="then give the same command again"):
        data.assemble(plan, keys(plan))
    assert before == {f: f.read_bytes() for f in data.folder.rglob("*") if f.is_file()}


def test_a_cut_line_of_the_log_is_passed_over(plan: Plan, tmp_path: Path) -> None:
    data = data_set(tmp_path / "out", plan)
    data.log(key="a", cpu_s=2.0, robot_s=100.0)
    with (data.folder / "log.jsonl").open("a") as file:
        file.write('3\n{"cpu_s": "x", "robot_s": 1}\n{"key": "b", "cpu_s": 1')
    data.log(key="c", cpu_s=1.0, robot_s=50.0)
    assert data.seconds_per_robot_second() == 0.02
    assert len((data.folder / "log.jsonl").read_text().splitlines()) == 5


def test_run_folders_of_failed_trials_go_once_the_trials_succeed(
    plan: Plan, tmp_path: Path
) -> None:
    data = data_set(tmp_path / "out", plan)
    # Two of this program, and two of the program before it was mended.
    names = [key(plan, 0), key(plan, 1), "before-0", "before-1"]
    for name, trial in zip(names, [*plan.trials[:2]] * 2, strict=True):
        data.failed_folder(name).mkdir(parents=True)
        (data.failed_folder(name) / "experiment.toml").write_text(trial.experiment.to_toml())
        manifest = {"experiment_sha256": trial.experiment.identity()}
        (data.failed_folder(name) / "manifest.json").write_text(json.dumps(manifest))
    data.add(*measured(plan, 0))
    Sweep(plan, data, keys(plan), {key(plan, 0)}).finish()
    assert {folder.name for folder in data.failed_folder("*").parent.iterdir()} == {
        key(plan, 1),
        "before-1",
    }


def test_a_folder_of_something_else_is_left_alone(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="the folder is not empty"):
        data_set(tmp_path, plan)
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_a_trial_is_recognised_by_experiment_and_program(plan: Plan) -> None:
    assert len(set(keys(plan))) == 4
    assert trial_key(plan.trials[0], ["program"]) == key(plan, 0)
    assert trial_key(plan.trials[0], ["changed"]) != key(plan, 0)
    # Parts have its name: another length would lose those of earlier versions.
    assert re.fullmatch("[0-9a-f]{32}", key(plan, 0))


def test_the_time_of_a_robot_second_is_that_of_the_finished_trials(
    plan: Plan, tmp_path: Path
) -> None:
    data = data_set(tmp_path / "out", plan)
    assert data.seconds_per_robot_second() is None
    data.log(key="a", cpu_s=2.0, robot_s=100.0)
    data.log(key="b", failed="it crashed")
    data.log(key="c", cpu_s=1.0, robot_s=50.0)
    assert data.seconds_per_robot_second() == 0.02


def test_a_guess_of_the_time_knows_media_modules_and_simulated_processors(tmp_path: Path) -> None:
    def guess(base: str, **settings: object) -> float:
        text = f"base = {str(resources.path(base))!r}\nseeds = 1\n"
        file = tmp_path / "sweep.toml"
        file.write_text(text + "".join(f"set.{key} = {value}\n" for key, value in settings.items()))
        plan = read_plan(file)
        data = data_set(tmp_path / f"out-{plan.trials[0].experiment.keys.name}", plan)
        return Sweep(plan, data, keys(plan)).estimate().cpu_s

    # 100 robots, 30,000 s; 50 robots above 200 modules, 37,500 s.
    assert guess("experiments/paper/simplified-n100.toml") == pytest.approx(5.0)
    robots, modules = 50 * 37_500 / 400_000, 200 * 37_500 / 250_000
    assert guess("experiments/kilogrid/paper-n50.toml") == pytest.approx(robots + modules)
    on_boards = guess("experiments/kilogrid/paper-n50.toml", **{"grid.cpu": '"avr"'})
    assert on_boards == pytest.approx(robots + 200 * 37_500 / 400)


def test_the_time_is_divided_among_workers_whose_number_is_known() -> None:
    estimate = Estimate(8, 0, 7200, 0, measured=False)
    assert "about 60 min on 2 processes" in estimate.text(Processes(2))
    address = "tcp://127.0.0.1:8786"
    assert f"about 2.0 h of one core on the Dask cluster at {address}" in estimate.text(
        Dask(address)
    )


@pytest.mark.parametrize(
    ("file", "before", "after"),
    [
        ("my.wire.toml", "scale = 255", "scale = 100"),
        ("mine.py", "return 1.0", "return 2.0"),
        ("blink.c", "RGB(1, 1, 1)", "RGB(0, 1, 1)"),
    ],
)
def test_trials_run_again_once_a_file_that_they_name_says_something_else(
    file: str, before: str, after: str, folder: Path, tmp_path: Path
) -> None:
    (folder / "my.wire.toml").write_text(WIRE)
    (folder / "mine.py").write_text("def radius(sample):\n    return 1.0\n")
    metric = '[metric.radius]\nfunction = "mine.py:radius"\n'
    (folder / "small.toml").write_text(f"{GIVEN}\n{metric}")
    (folder / "sweep.toml").write_text('base = "small.toml"\nseeds = 2\n')

    def keys_now() -> list[str]:
        plan = read_plan(folder / "sweep.toml")
        return list(Sweep.prepare(plan, tmp_path / "out", lambda _: None).keys)

    first = keys_now()
    assert keys_now() == first
    named = folder / file
    named.write_text(named.read_text().replace(before, after))
    assert not set(first) & set(keys_now())


class Answers(Executor):
    """A place whose trials are answered as they are asked for: the second is past its time."""

    name = "a test"

    def __init__(self, plan: Plan, sweep: Sweep) -> None:
        self._late = plan.trials[1].experiment.identity()
        self._parts = {
            trial.experiment.identity(): measured(plan, trial.index)[1] for trial in plan.trials
        }

    @contextlib.contextmanager
    def open(self) -> Iterator[Executor]:
        yield self

    def workers(self) -> int:
        return 1

    def submit(self, _how: Callable[..., object], tasks: list[Task[bytes]]) -> Future[object]:  # type: ignore[override]
        future: Future[object] = Future()
        future.set_result([self._answer(task.experiment.identity()) for task in tasks])
        return future

    def _answer(self, trial: str) -> Answer[bytes]:
        if trial == self._late:
            return Failed("it took too long", timed_out=True)
        return Done(self._parts[trial], 1.0, engine_sha256(), "here")


class Shown:
    """A display that keeps what it is told."""

    def __init__(self) -> None:
        self.began = (0, 0)
        self.steps: list[tuple[int, int, float]] = []

    def note(self, text: str) -> None: ...

    def start(self, trials: int, done: int) -> None:
        self.began = trials, done

    def progress(self, done: int, failed: int, left_s: float, _last: str) -> None:
        self.steps.append((done, failed, left_s))

    def stop(self) -> None: ...


def test_a_sweep_shows_how_many_trials_are_done_and_failed_and_how_long_the_others_take(
    plan: Plan, tmp_path: Path
) -> None:
    sweep = Sweep.prepare(plan, tmp_path / "out", lambda _: None)
    sweep.data.begin(plan, sweep.keys)
    sweep.data.add(sweep.keys[0], measured(plan, 0)[1])
    sweep = Sweep.prepare(plan, tmp_path / "out", lambda _: None)
    shown = Shown()
    sweep.run(Pool(Answers(plan, sweep)), shown)
    assert shown.began == (4, 1)
    counts = [(done, failed) for done, failed, _ in shown.steps]
    assert counts[-1] == (3, 1)
    assert [done + failed for done, failed in counts] == [2, 3, 4]
    left_s = [left for *_, left in shown.steps]
    assert left_s[0] > 0
    assert left_s[2] == 0
    assert (sweep.exit_code, list(sweep.failures)) == (1, [sweep.keys[1]])


def test_trials_are_sorted_into_conditions(plan: Plan, tmp_path: Path) -> None:
    data = data_set(tmp_path / "out", plan)
    for index in range(4):
        data.add(*measured(plan, index))
    data.assemble(plan, keys(plan))
    trials = Conditions.open(data.folder)
    assert trials.progress == ""
    assert trials.sites == ("black", "white")
    assert trials.name == "sizes"
    small = Condition("firat", 3, 0.4, (0.5, 0.5))
    assert trials.where(robots=3) == {small: [Ending((0, 0), 3), Ending((1, 0), 2)]}
    assert small.wanted == (1.5, 1.5)


def test_trials_of_several_readings_are_kept_apart(folder: Path, tmp_path: Path) -> None:
    readings = "vary.reading.count_self = [false, true]\nvary.reading.obstacle_m = [0.02, 0.05]\n"
    (folder / "sweep.toml").write_text(
        SWEEP.replace("vary.swarm.size = [3, 5]\n", readings).replace("seeds = 2", "seeds = 1")
    )
    plan = read_plan(folder / "sweep.toml")
    data = data_set(tmp_path / "out", plan)
    for index in range(4):
        data.add(*measured(plan, index))
    data.assemble(plan, keys(plan))
    assert list(Conditions.by_reading(data.folder)) == [
        "obstacle_m 0.02",
        "reading A",
        "obstacle_m 0.02, count_self true",
        "count_self true",
    ]
    with pytest.raises(InputError, match="4 readings"):
        Conditions.open(data.folder)


@pytest.mark.parametrize(
    ("black", "white", "one"),
    [
        (90, 10, True),
        (89, 10, False),
        (9, 81, True),
        (9, 80, False),
        (50, 50, False),
        (1, 0, True),
        (0, 0, False),
    ],
)
def test_one_aggregate_is_nine_tenths_of_the_resting(black: int, white: int, one: bool) -> None:
    assert Ending((black, white), 0).is_one_aggregate is one


def test_the_error_is_averaged_over_the_sites() -> None:
    ending = Ending((60, 30), 10)
    assert ending.error(Condition("firat", 100, 0.5, (0.7, 0.3))) == (10 + 0) / 2
    assert ending.error(Condition("firat", 100, 0.5, (0.5, 0.5))) == (10 + 20) / 2


def test_what_is_no_sweep_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a sweep's folder"):
        Conditions.open(tmp_path)
    (tmp_path / "sweep.json").write_text(json.dumps({"name": "x"}))
    (tmp_path / "trials.parquet").write_bytes(b"nothing of the kind")
    with pytest.raises(InputError, match="damaged"):
        Conditions.open(tmp_path)
