"""`kilotwin run`, its child process, and what becomes of it; on the fake engine."""

import contextlib
import json
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.processes import children

from kilotwin.commands.terminal import Lines, recorded
from kilotwin.experiment.experiment import Experiment
from kilotwin.files.confinement import SINGLE_THREADED
from kilotwin.runs.folder import FINISHED
from kilotwin.runs.reader import Run
from kilotwin.session import run
from kilotwin.session.display import Silent

from ..conftest import BLINK, INFORMED, SMALL, Kilotwin, Load

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def trouble(folder: Path) -> Callable[[str], str]:
    """The file name of a program that the fake engine makes trouble with."""

    def program(name: str) -> str:
        (folder / f"{name}.c").write_text(BLINK)
        return f"swarm.program={name}.c"

    return program


@pytest.fixture
def start(folder: Path, fake_environment: dict[str, str]) -> Iterator[Start]:
    """Starts a run in a process group of its own; all of it ends with the test."""
    with contextlib.ExitStack() as stack:

        def start(*arguments: str) -> "subprocess.Popen[str]":
            process = stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-m", "kilotwin", "run", "small.toml", *arguments],
                    cwd=folder,
                    env={**fake_environment, **SINGLE_THREADED},  # the fake loads numpy at once
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                    start_new_session=True,
                )
            )
            stack.callback(kill_group, process.pid)
            return process

        yield start


@pytest.fixture
def start_endless(start: Start, folder: Path, trouble: Callable[[str], str]) -> Start:
    """Starts a run into the folder `run` that does not end by itself, up to its first samples."""

    def start_endless(*arguments: str) -> "subprocess.Popen[str]":
        endless = ["--set", trouble("slow"), "--set", "duration_s=1e9", "--out", "run"]
        process = start(*endless, *arguments)
        wait_for((folder / "run").exists, "the run folder")
        wait_for(lambda: Run.open(folder / "run").sites().num_rows > 5, "samples")
        return process

    return start_endless


def engine_of(process: "subprocess.Popen[str]") -> int:
    """The process id of its worker."""
    (engine,) = children(process.pid)
    return engine


def stop_engine_of(process: "subprocess.Popen[str]") -> None:
    """Its engine heeds nothing from then on."""
    os.kill(engine_of(process), signal.SIGSTOP)


def command_of(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/cmdline").read_text().split("\0")


def kill_group(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)


def wait_for(condition: Callable[[], object], what: str, limit_s: float = 600) -> None:
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, f"waited {limit_s} s for {what}"
        time.sleep(0.005)


def status(folder: Path) -> str:
    return str(json.loads((folder / "manifest.json").read_text())["status"])


def test_json_is_one_object_with_all_that_others_rely_on(kilotwin: Kilotwin, folder: Path) -> None:
    (folder / "small.toml").write_text(SMALL + INFORMED)
    done = kilotwin("run", "small.toml", "--json", "--set", "swarm.informed=0.5", "--seed", "4")
    result = json.loads(done.stdout)
    assert result["experiment"] == "small"
    assert result["seed"] == 4
    assert result["duration_s"] == 60
    assert result["robots"] == 10
    assert result["informed"] == {"black": 4, "white": 1}
    assert set(result["resting"]) == {"black", "white"}
    assert sum(result["resting"].values()) + result["not_resting"] == 10
    assert len(result["result_hash"]) == 16
    assert result["robot_s_per_cpu_s"] == pytest.approx(600 / result["cpu_s"], rel=0.2)
    assert {"cpu_s", "wall_s", "run_folder", "events", "stats", "robots_failed"} <= set(result)
    assert Path(result["run_folder"]).parent == folder / "runs"


def test_the_last_record_is_the_end(kilotwin: Kilotwin, folder: Path) -> None:
    kilotwin("run", "small.toml", "--out", "run")
    ticks = Run.open(folder / "run").sites()["tick"].to_pylist()
    assert ticks[:3] == [0, 305, 610]
    assert ticks[-1] == 1831
    assert len(set(ticks)) == len(ticks)


def test_the_manifest_says_all_about_the_run(kilotwin: Kilotwin, folder: Path) -> None:
    kilotwin("run", "small.toml", "--out", "run", "--set", "seed=5")
    manifest = json.loads((folder / "run/manifest.json").read_text())
    assert manifest["status"] == "finished"
    assert manifest["exit_code"] == 0
    assert manifest["seed"] == 5
    assert manifest["command_line"][-2:] == ["--set", "seed=5"]
    assert manifest["engine"]["version"] == "fake"
    assert manifest["programs"][0]["name"] == "blink"
    assert len(manifest["experiment_sha256"]) == 64
    assert manifest["started_utc"] <= manifest["ended_utc"]
    assert manifest["summary"]["robots"] == 10


def test_the_summary_is_for_people(kilotwin: Kilotwin) -> None:
    done = kilotwin("run", "small.toml", "--out", "run", "--quiet")
    assert "small, seed 1: 60 s simulated" in done.stdout
    assert "resting on black" in done.stdout
    assert "not resting" in done.stdout
    assert done.stdout.rstrip().endswith("run")
    assert done.stderr == ""


def test_plots_come_with_a_run_if_wanted(kilotwin: Kilotwin, folder: Path) -> None:
    kilotwin("run", "small.toml", "--out", "run", "--plots")
    assert (folder / "run/map.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "run/timeline.png").read_bytes().startswith(b"\x89PNG")


def test_options_may_come_from_the_environment(kilotwin: Kilotwin, folder: Path) -> None:
    environment = {"KILOTWIN_SEED": "9", "KILOTWIN_OUT": "here", "KILOTWIN_JSON": "1"}
    done = kilotwin("run", "small.toml", **environment, KILOTWIN_SET="duration_s=30 name=x")
    result = json.loads(done.stdout)
    assert (result["seed"], result["duration_s"], result["experiment"]) == (9, 30, "x")
    assert (folder / "here/manifest.json").exists()


def test_what_the_engine_refuses_leaves_no_folder(
    kilotwin: Kilotwin, folder: Path, trouble: Callable[[str], str]
) -> None:
    done = kilotwin("run", "small.toml", "--out", "run", "--set", trouble("refused"), expect=2)
    assert done.stderr.splitlines()[-1] == (
        "kilotwin: --set swarm.program=refused.c: there is no room for 7 of the robots"
    )
    assert not (folder / "run").exists()


def test_robots_that_crash_are_listed_and_the_folder_is_whole(
    kilotwin: Kilotwin, folder: Path, trouble: Callable[[str], str]
) -> None:
    words = ["--out", "run", "--json", "--set", trouble("crashes"), "--set", "swarm.size=2"]
    done = kilotwin("run", "small.toml", *words, expect=4)
    failed = json.loads(done.stdout)["robots_failed"]
    assert [(event["robot"], event["program"], event["tick"]) for event in failed] == [
        (0, "crashes", 0),
        (1, "crashes", 0),
    ]
    assert "crash: SIGSEGV: robots 1 and 2 (crashes), from tick 0" in done.stderr
    assert status(folder / "run") == "finished"
    assert len(Run.open(folder / "run").events()) == 2


def test_when_the_engine_dies_the_parent_closes_the_folder(
    kilotwin: Kilotwin, folder: Path, trouble: Callable[[str], str]
) -> None:
    done = kilotwin("run", "small.toml", "--out", "run", "--set", trouble("dies"), expect=1)
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("kilotwin:")]
    assert "was ended by SIGSEGV; last to run was dies robot 1 tick 1000" in line
    assert "Traceback" not in done.stderr
    manifest = json.loads((folder / "run/manifest.json").read_text())
    assert (manifest["status"], manifest["exit_code"]) == ("failed", 1)
    assert "SIGSEGV" in manifest["reason"]
    assert Run.open(folder / "run").robots().num_rows >= 10


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_run_keeps_its_data(number: int, start_endless: Start, folder: Path) -> None:
    process = start_endless("--json")
    os.kill(process.pid, number)
    os.killpg(process.pid, number)  # as `timeout` does
    output, errors = process.communicate(timeout=600)
    assert process.returncode == 130, errors
    assert "interrupted; what was recorded is kept" in errors
    result = json.loads(output)
    assert result["status"] == "interrupted"
    assert 0 < result["simulated_s"] < 1e9
    assert status(folder / "run") == "interrupted"
    run = Run.open(folder / "run")
    assert run.sites()["tick"][-1].as_py() == round(result["simulated_s"] / 0.032768)
    assert not (folder / "run/robots.parquet").exists()


def test_a_run_whose_terminal_goes_away_keeps_its_data(
    folder: Path, fake_environment: dict[str, str], trouble: Callable[[str], str]
) -> None:
    command = [sys.executable, "-m", "kilotwin", "run", "small.toml", "--out", "run"]
    command += ["--set", trouble("slow"), "--set", "duration_s=1e9"]
    here, there = pty.openpty()
    process = subprocess.Popen(
        ["setsid", "--ctty", *command],
        cwd=folder,
        env={**fake_environment, **SINGLE_THREADED},
        stdin=there,
        stdout=there,
        stderr=there,
    )
    os.close(there)
    try:
        wait_for((folder / "run").exists, "the run folder")
        wait_for(lambda: Run.open(folder / "run").sites().num_rows > 5, "samples")
        os.close(here)
        assert process.wait(600) == 130
    finally:
        process.kill()
        process.wait()
    assert status(folder / "run") == "interrupted"


def test_a_run_interrupted_twice_ends_at_once_and_says_what_is_kept(
    start_endless: Start, folder: Path
) -> None:
    process = start_endless()
    stop_engine_of(process)  # it does not heed the first one
    # On a busy machine several may arrive as one.
    while process.poll() is None:
        os.kill(process.pid, signal.SIGINT)
        time.sleep(0.1)
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130, errors
    said = f"interrupted twice, and ended at once; what was recorded is in {folder / 'run'}"
    assert errors.splitlines()[-1] == f"kilotwin: {said}"
    assert status(folder / "run") == "interrupted"
    assert Run.open(folder / "run").sites().num_rows > 5


@pytest.mark.waits
def test_a_run_whose_engine_hangs_ends_soon_after_one_polite_kill(
    start_endless: Start, folder: Path
) -> None:
    process = start_endless()
    stop_engine_of(process)
    process.terminate()
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130, errors
    said = errors.splitlines()[-1]
    assert said.startswith("kilotwin: interrupted; the engine did not stop within 10 s")
    assert said.endswith(f"what was recorded is in {folder / 'run'}")
    assert status(folder / "run") == "interrupted"
    assert Run.open(folder / "run").sites().num_rows > 5


def test_a_robot_that_is_not_there_is_not_said_to_wait_for_gdb(kilotwin: Kilotwin) -> None:
    done = kilotwin("run", "small.toml", "--gdb", "99", expect=2)
    assert "there is no such robot; name one of 1 to 10" in done.stderr
    assert "waits" not in done.stderr


def test_a_child_whose_parent_is_killed_closes_the_folder(
    start_endless: Start, folder: Path
) -> None:
    process = start_endless()
    process.kill()
    wait_for(lambda: status(folder / "run") == "interrupted", "the child to end")


def test_progress_on_a_terminal_is_live(
    folder: Path, fake_environment: dict[str, str], trouble: Callable[[str], str]
) -> None:
    here, there = pty.openpty()
    words = ["--out", "run", "--set", trouble("slow"), "--set", "duration_s=30000"]
    with subprocess.Popen(
        [sys.executable, "-m", "kilotwin", "run", "small.toml", *words],
        cwd=folder,
        env={**fake_environment, "TERM": "xterm", "COLUMNS": "80"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=there,
    ) as process:
        os.close(there)
        shown = b""
        with contextlib.suppress(OSError):  # the other end is closed
            while block := os.read(here, 65536):
                shown += block
        os.close(here)
    assert process.returncode == 0, shown
    text = shown.decode()
    assert "small, seed 1" in text
    assert re.search(r"of 30,000 s in \d+ s, [\d,]+ x real time", text)
    assert re.search(r"black \d+, white \d+, not resting \d+", text)


def test_progress_off_a_terminal_is_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter(range(100))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    lines = Lines()
    for step in range(25):
        lines.progress(305 * step, {"black": 3, "white": 0}, 7)
    shown = capsys.readouterr().err.splitlines()
    assert len(shown) == 2
    assert "black 3, white 0, not resting 7" in shown[0]


def test_a_record_of_a_table_is_not_told_to_be_so_many_times_real_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter(range(0, 100, 10))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    Lines(recorded).progress(305, {}, 7)
    shown = capsys.readouterr().err
    assert "s recorded, " in shown
    assert "real time" not in shown


class _StopsTooLate(Silent):
    """Presses Ctrl-C when the run is over, before its end was read."""

    def start(self, experiment: Experiment, folder: Path) -> None:
        def is_over() -> bool:
            return f'"status": "{FINISHED}"' in (folder / "manifest.json").read_text()

        wait_for(is_over, "the end of the run")
        os.kill(os.getpid(), signal.SIGINT)


def test_a_wish_to_stop_that_comes_too_late_is_told(
    load: Load, tmp_path: Path, fake_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in fake_environment.items():
        monkeypatch.setenv(name, value)
    outcome = run.run(load(), tmp_path / "out", ["kilotwin", "run"], _StopsTooLate())
    assert (outcome.exit_code, outcome.stop_asked) == (0, True)
    assert not run.run(load(), tmp_path / "out2", ["kilotwin", "run"], Silent()).stop_asked


def test_a_run_without_a_grid_does_not_wait_for_the_can_tools() -> None:
    code = (
        "import sys, kilotwin.session.worker; "
        "print([m for m in ('can', 'cantools', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_command_forks_its_worker_into_a_process_group_of_its_own(
    start_endless: Start,
) -> None:
    process = start_endless()
    engine = engine_of(process)
    assert command_of(engine) == command_of(process.pid)
    assert os.getpgid(engine) == engine


def test_a_process_with_threads_starts_a_python_for_its_worker(
    load: Load, tmp_path: Path, fake_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in {**fake_environment, **SINGLE_THREADED}.items():
        monkeypatch.setenv(name, value)

    def no_fork() -> int:
        raise AssertionError("forked beside a thread")

    monkeypatch.setattr(os, "fork", no_fork)
    over = threading.Event()
    beside = threading.Thread(target=over.wait)
    beside.start()
    try:
        assert run.run(load(), tmp_path / "out", ["kilotwin", "run"], Silent()).exit_code == 0
    finally:
        over.set()
        beside.join()


def test_a_run_whose_standard_files_are_closed_is_as_any_other(
    folder: Path, fake_environment: dict[str, str]
) -> None:
    command = 'exec "$0" -m kilotwin run small.toml --json 2>&- <&-'
    done = subprocess.run(
        ["/bin/sh", "-c", command, sys.executable],
        cwd=folder,
        env=fake_environment,
        stdout=subprocess.PIPE,
        check=True,
        timeout=600,
    )
    assert json.loads(done.stdout)["status"] == "finished"
