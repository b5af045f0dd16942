"""Sweeps: stopped, killed, spread over workers, or with trials that fail, they end the same."""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from tests.processes import alive, children

from kilotwin.studies.sweep.parts import Parts

from .conftest import KILOTWIN, ROOT, Kilotwin

SWEEP = """\
name = "small"
seeds = 3
base = "{experiment}"
[set]
duration_s = 900
[vary]
swarm.informed = [0.2, 0.4]
"""
TRIALS = 6
# A sweep that is stopped has so many seeds that it cannot end before, however busy the machine is.
MANY, MOST = ("--seeds", "100"), 200

CRASHES = """\
#include <kilolib.h>
static void setup(void) {}
static void loop(void) { if (kilo_uid == 3 && SEED_CRASHES) *(volatile int *)0 = 1; }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
CRASHING = """\
duration_s = 5
arena.diameter_m = 2.0
[swarm]
profile = "kilobot"
cpu = "native"
[[robots]]
program = "crashes.c"
define = ["SEED_CRASHES={crashes}"]
count = 4
"""


@pytest.fixture
def sweep_file(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SWEEP.format(experiment=ROOT / "experiments/paper/simplified-n50.toml"))
    return file


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The tables as one process makes them, undisturbed."""
    folder = tmp_path_factory.mktemp("reference")
    file = folder / "small.toml"
    file.write_text(SWEEP.format(experiment=ROOT / "experiments/paper/simplified-n50.toml"))
    out = str(folder / "out")
    command = [str(KILOTWIN), "sweep", str(file), "--out", out, "-j", "1", "--quiet"]
    subprocess.run(command, check=True, timeout=600)
    return tables(folder / "out")


def tables(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in ("trials.parquet", "series.parquet")}


def parts(folder: Path) -> int:
    return len(Parts(folder / "parts"))


def wait_for(condition: Callable[[], object], limit_s: float = 600) -> None:
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.01)


@contextmanager
def started(*words: object, env: dict[str, str]) -> Iterator["subprocess.Popen[str]"]:
    """`kilotwin sweep ...`, ended at the end."""
    command = [str(KILOTWIN), "sweep", *map(str, words), "--quiet"]
    with subprocess.Popen(command, env=env, text=True, stderr=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def test_the_data_set_does_not_depend_on_the_number_of_workers(
    kilotwin: Kilotwin, sweep_file: Path, reference: dict[str, bytes], tmp_path: Path
) -> None:
    done = kilotwin("sweep", sweep_file, "--out", tmp_path / "out", "-j", "2", "--json")
    assert tables(tmp_path / "out") == reference
    summary = json.loads(done.stdout)
    assert (summary["trials"], summary["finished"], summary["failed"]) == (TRIALS, TRIALS, [])
    assert f"{TRIALS} trials; about" in done.stderr


def test_a_killed_sweep_goes_on_to_the_same_data_set_and_leaves_no_process(
    kilotwin: Kilotwin,
    environment: dict[str, str],
    sweep_file: Path,
    reference: dict[str, bytes],
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    with started(sweep_file, "--out", out, "-j", "2", *MANY, env=environment) as process:
        wait_for(lambda: parts(out) >= 1)
        workers = children(process.pid)
        process.kill()
    wait_for(lambda: not any(map(alive, workers)))
    assert parts(out) < MOST
    done = kilotwin("sweep", sweep_file, "--out", out, "-j", "2")
    # Those that were done may all be of the seeds that are left out now.
    assert re.search(rf"{TRIALS} trials(, \d+ of them there already)?;", done.stderr)
    assert tables(out) == reference


SLOW = """\
duration_s = {duration_s}
arena.diameter_m = 2.0
[swarm]
profile = "kilobot"
[[robots]]
program = "crashes.c"
define = ["SEED_CRASHES=0"]
count = 4
"""


def test_a_trial_past_its_time_is_stopped_and_named_and_the_sweep_goes_on(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "crashes.c").write_text(CRASHES)
    (tmp_path / "slow.toml").write_text(SLOW.format(duration_s=5))
    file = tmp_path / "sweep.toml"
    # Others have the time that a busy machine takes for them.
    file.write_text(
        'base = "slow.toml"\ntrial_timeout_s = 8\n[vary]\nduration_s = [5, 100000000, 6]\n'
    )
    words = ("sweep", file, "--out", tmp_path / "out", "-j", "1", "--json")
    summary = json.loads(kilotwin(*words, expect=1).stdout)
    (failed,) = summary["failed"]
    assert (summary["finished"], failed["timed_out"]) == (2, True)
    assert "duration_s 100000000" in failed["trial"]
    assert "stopped after trial_timeout_s = 8, when" in failed["failed"]
    done = kilotwin(*words[:-1], "--trial-timeout", "1", expect=1)
    assert "took too long: slow, duration_s 100000000, seed 1: stopped after" in done.stdout
    assert "2 of them there already" in done.stderr


def test_a_full_disk_and_a_damaged_part_cost_nothing_but_time(
    kilotwin: Kilotwin,
    environment: dict[str, str],
    sweep_file: Path,
    reference: dict[str, bytes],
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    words = ["sweep", str(sweep_file), "--out", str(out), "-j", "1", "--quiet"]
    kilotwin(*words, "--list")  # compiles the program
    # 4 KB: room for what a trial's process notes in /tmp, and not for a part.
    limited = ["bash", "-c", 'ulimit -f 4; exec "$@"', "bash", str(KILOTWIN), *words]
    done = subprocess.run(limited, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert "cannot write (file too large); make room" in done.stderr
    kilotwin(*words)
    assert tables(out) == reference
    content = bytearray((out / "parts").read_bytes())
    content[500] ^= 1
    (out / "parts").write_bytes(content)
    done = kilotwin("sweep", sweep_file, "--out", out)
    assert "damaged at 1 place" in done.stderr
    assert f"{TRIALS} trials, {TRIALS - 1} of them there already" in done.stderr
    assert tables(out) == reference


@pytest.mark.long
def test_the_papers_whole_grid_survives_kills_at_random_moments(
    kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path
) -> None:
    """All cells at full length, two trials of each, twice: a quarter of an hour on two cores."""
    grid, seeds = "experiments/paper/grid.toml", ("--seeds", "2")
    undisturbed, out = tmp_path / "undisturbed", tmp_path / "out"
    kilotwin("sweep", grid, *seeds, "--out", undisturbed, timeout_s=7200)
    moments = random.Random(20261122)
    for _ in range(3):
        before = parts(out)
        with started(grid, *seeds, "--out", out, env=environment) as process:
            wait_for(lambda before=before: parts(out) >= before + 5)  # type: ignore[misc]
            time.sleep(moments.uniform(0, 120))
            workers = children(process.pid)
            process.kill()
        wait_for(lambda workers=workers: not any(map(alive, workers)))  # type: ignore[misc]
    kilotwin("sweep", grid, *seeds, "--out", out, timeout_s=7200)
    assert tables(out) == tables(undisturbed)


def test_a_second_sweep_into_the_same_folder_is_refused_and_harms_nothing(
    kilotwin: Kilotwin,
    environment: dict[str, str],
    sweep_file: Path,
    reference: dict[str, bytes],
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    with started(sweep_file, "--out", out, "-j", "1", *MANY, env=environment) as process:
        wait_for(lambda: parts(out) >= 1)
        done = kilotwin("sweep", sweep_file, "--out", out, expect=2)
        assert "another sweep is at work in it" in done.stderr
        kilotwin("sweep", sweep_file, "--out", out, "--list")
        before = parts(out)
        wait_for(lambda: parts(out) > before)
        process.kill()
    kilotwin("sweep", sweep_file, "--out", out)
    assert tables(out) == reference


def test_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(
    kilotwin: Kilotwin,
    environment: dict[str, str],
    sweep_file: Path,
    reference: dict[str, bytes],
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    with started(sweep_file, "--out", out, "-j", "1", *MANY, env=environment) as process:
        wait_for(lambda: parts(out) >= 1)
        process.send_signal(signal.SIGINT)
        assert process.wait(600) == 130
    assert pq.read_table(out / "trials.parquet").num_rows == parts(out)
    refused = kilotwin("sweep", sweep_file, "--out", out, "--no-resume", expect=2)
    holds = re.search(r"holds (\d+) of these trials", refused.stderr)
    assert holds is not None
    assert 1 <= int(holds[1]) <= parts(out)
    kilotwin("sweep", sweep_file, "--out", out, "--resume")
    assert tables(out) == reference


def test_a_worker_that_dies_costs_nothing_but_time(
    environment: dict[str, str], sweep_file: Path, reference: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with started(sweep_file, "--out", out, "-j", "2", env=environment) as process:
        wait_for(lambda: parts(out) >= 1)
        # The pool's workers, not its resource tracker, are the busy ones.
        os.kill(max(children(process.pid)), signal.SIGKILL)
        assert process.wait(600) == 0
    assert tables(out) == reference


def test_a_trial_that_fails_is_tried_again_then_listed_with_its_run_folder(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "crashes.c").write_text(CRASHES)
    for name, crashes in (("good", 0), ("bad", 1)):
        (tmp_path / f"{name}.toml").write_text(CRASHING.format(crashes=crashes))
    (tmp_path / "sweep.toml").write_text('base = ["good.toml", "bad.toml"]\n')
    out = tmp_path / "out"
    done = kilotwin("sweep", tmp_path / "sweep.toml", "--out", out, "--json", expect=1)
    (failed,) = json.loads(done.stdout)["failed"]
    assert failed["trial"] == "bad, seed 1"
    assert "robot 3 (crashes)" in failed["failed"]
    assert (Path(failed["run_folder"]) / "events.jsonl").read_text().count('"crash"') == 1
    assert pq.read_table(out / "trials.parquet")["base"].to_pylist() == ["good"]
    # Mended, it is another program; the folder of the trial that succeeds now is not kept.
    (tmp_path / "crashes.c").write_text(CRASHES.replace("SEED_CRASHES)", "0)"))
    kilotwin("sweep", tmp_path / "sweep.toml", "--out", out)
    assert pq.read_table(out / "trials.parquet")["base"].to_pylist() == ["good", "bad"]
    assert list((out / "failed").iterdir()) == []


def test_the_list_says_what_is_there_and_runs_nothing(
    kilotwin: Kilotwin, sweep_file: Path, tmp_path: Path
) -> None:
    done = kilotwin("sweep", sweep_file, "--out", tmp_path / "out", "--list")
    assert len([line for line in done.stdout.splitlines() if "seed" in line]) == TRIALS
    assert not (tmp_path / "out").exists()
    rows = json.loads(
        kilotwin("sweep", sweep_file, "--out", tmp_path / "out", "--list", "--json").stdout
    )
    assert rows[0] == {
        "trial": 0,
        "base": "simplified-n50",
        "seed": 1,
        "swarm.informed": 0.2,
        "finished": False,
    }


def test_slurm_gets_a_job_script_with_the_options_of_the_file(
    kilotwin: Kilotwin, sweep_file: Path, tmp_path: Path
) -> None:
    with sweep_file.open("a") as file:
        file.write('[slurm]\nqueue = "long"\naccount = "swarm"\nwalltime = "02:00:00"\njobs = 8\n')
    out = tmp_path / "out"
    done = kilotwin("sweep", sweep_file, "--out", out, "--slurm", "--list")
    for line in (
        "#SBATCH -p long",
        "#SBATCH -A swarm",
        "#SBATCH -t 02:00:00",
        "#SBATCH --cpus-per-task=1",
        "distributed.cli.dask_worker",
        "--nthreads 1",
    ):
        assert line in done.stdout, line
    assert "on jobs of Slurm" in done.stdout


def test_options_that_slurm_does_not_take_are_named_with_their_line(
    kilotwin: Kilotwin, sweep_file: Path, tmp_path: Path
) -> None:
    with sweep_file.open("a") as file:
        file.write("[slurm]\nfoo = 3\n")
    done = kilotwin("sweep", sweep_file, "--out", tmp_path / "out", "--slurm", expect=2)
    assert "small.toml:8: [slurm]: Got unexpected keyword argument 'foo'" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(shutil.which("sbatch") is not None, reason="Slurm is here")
def test_without_slurm_here_the_error_says_so(
    kilotwin: Kilotwin, sweep_file: Path, tmp_path: Path
) -> None:
    done = kilotwin("sweep", sweep_file, "--out", tmp_path / "out", "--slurm", expect=3)
    assert "--slurm: sbatch is not there" in done.stderr


def test_a_dask_cluster_of_two_workers_makes_the_same_data_set(
    kilotwin: Kilotwin, sweep_file: Path, reference: dict[str, bytes], tmp_path: Path
) -> None:
    with dask_cluster(tmp_path) as (address, _):
        out = tmp_path / "out"
        kilotwin("sweep", sweep_file, "--out", out, "--dask", address)
    assert tables(out) == reference


@pytest.mark.long
def test_a_dask_worker_that_dies_costs_nothing_but_time(
    environment: dict[str, str], sweep_file: Path, reference: dict[str, bytes], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with (
        dask_cluster(tmp_path) as (address, workers),
        started(sweep_file, "--out", out, "--dask", address, env=environment) as process,
    ):
        wait_for(lambda: parts(out) >= 1)
        workers[0].kill()
        assert process.wait(600) == 0
    assert tables(out) == reference


def test_where_no_scheduler_answers_the_error_says_what_to_start(
    kilotwin: Kilotwin, sweep_file: Path, tmp_path: Path
) -> None:
    words = ["--out", tmp_path / "out", "--dask", "tcp://127.0.0.1:9"]
    done = kilotwin("sweep", sweep_file, *words, expect=3)
    assert "no scheduler answers" in done.stderr
    assert "dask worker --nthreads 1" in done.stderr


@contextmanager
def dask_cluster(
    folder: Path,
) -> Iterator[tuple[str, list["subprocess.Popen[bytes]"]]]:
    """A scheduler and two workers of one thread each, as people start them."""
    dask = KILOTWIN.with_name("dask")
    file = folder / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    scheduler = [dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *common]
    worker = [dask, "worker", "--nthreads", "1", "--host", "127.0.0.1", *common]
    processes = [subprocess.Popen(scheduler, cwd=folder, **quiet)]  # type: ignore[call-overload]
    try:
        wait_for(file.is_file)
        for _ in range(2):
            processes.append(subprocess.Popen(worker, cwd=folder, **quiet))  # type: ignore[call-overload]
        yield json.loads(file.read_text())["address"], processes[1:]
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()
