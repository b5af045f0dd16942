"""Runs an experiment in a child process, and closes its folder whatever happens to the child."""

import contextlib
import importlib.util
import json
import math
import os
import platform
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from kilotwin import __version__
from kilotwin.errors import (
    DeviceError,
    InputError,
    InterruptError,
    KilotwinError,
    RunError,
    TimeoutRunError,
)
from kilotwin.experiment.experiment import Experiment
from kilotwin.files import memory_group
from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.files.plain_text import plain, quoted
from kilotwin.metrics.functions import LocalFunctions, answer
from kilotwin.programs.coverage.marks import Marks, understood
from kilotwin.programs.group import build_all, settled, symbols_of
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.port.twin import TWIN_S, Ear, Mode, Twins, native_kilobots
from kilotwin.programs.translate.optimiser import Optimiser
from kilotwin.programs.variant import Variant
from kilotwin.runs import notes
from kilotwin.runs.folder import (
    FAILED,
    INTERRUPTED,
    RUNNING,
    UIDS,
    add_to_manifest,
    check_free,
    close_for_writer,
    default_folder,
    utc_now,
)
from kilotwin.runs.parcel import digest_of, programs_of
from kilotwin.runs.size import bytes_of, size_of
from kilotwin.runs.trail import Trail
from kilotwin.session.acts import Act
from kilotwin.session.black_box import LOOK_S, BlackBox, Watch
from kilotwin.session.confined_worker import growth_of, unconfined_because
from kilotwin.session.display import Display, Window
from kilotwin.session.estimate import cpu_s_of
from kilotwin.session.faster_code import expected, runs_native_code
from kilotwin.session.job import Job, Probes, Serving, threads_for
from kilotwin.session.worker_process import WorkerProcess, start_worker
from kilotwin.table.ports.pseudo_terminal import remove_dead
from kilotwin.units import duration_text, ticks

# Kinds of reports, and what each has.
_REPORTS: dict[str, dict[str, type]] = {
    "folder": {},
    "started": {},
    "note": {"text": str},
    "waits": {},
    "progress": {"tick": int, "resting": dict, "not_resting": int, "metrics": dict},
    "measure": {},
    "heard": {"heard": dict},
    "done": {"exit_code": int, "summary": dict},
    "error": {"exit_code": int, "message": str},
}
_LONGEST_REPORT, _LONGEST_LOG = 1 << 26, 1 << 20
_GARBLED = (
    "the engine's process reports what cannot be understood; one of the programs wrote into its "
    "files, so that what was recorded is spoiled"
)

# From the first interrupt on: what the engine has under way takes a second or so, unless a program
# keeps it.
_PATIENCE_S = 10.0
# After so long it is known how long a run takes; from how long on what else it could take is said.
_KNOWN_S, _LONG_S = 3.0, 60.0


@dataclass(frozen=True)
class Outcome:
    """How a run ended: `summary` is what --json prints.

    `stop_asked`: Ctrl-C or a kill came, be it too late to cut it short. `timed_out`: the time that
    it had was over before its end. `marks`: what of each group's program has run, if it was built
    for that.
    """

    summary: dict[str, Any]
    exit_code: int
    stop_asked: bool = False
    timed_out: bool = False
    marks: Sequence[Marks] = ()


def run(
    experiment: Experiment,
    folder: Path | None,
    command_line: list[str],
    display: Display,
    *,
    serving: Serving | None = None,
    probes: Probes | None = None,
    timeout_s: float | None = None,
    twin: Mode = "off",
    window: Window | None = None,
    speed: float = math.inf,
    covered: bool = False,
    sanitized: bool = False,
    acts: tuple[Act, ...] = (),
    trails: tuple[Trail, ...] = (),
) -> Outcome:
    """Builds the programs, runs the experiment, leaves the run folder. Input errors leave none.

    `serving`: the grid waits for a host from outside. After `timeout_s` of wall time the run is
    interrupted. `twin`: whether native programs are held against their ATmega328P. `window`: where
    the run is seen as it goes. `covered`: programs mark what runs. `sanitized`: as
    build_group() has it; others as Job.
    """
    if importlib.util.find_spec("kilotwin._emulator") is None:
        raise RunError("the engine is not built; type: make setup")
    folder = folder or default_folder(experiment)
    check_free(folder)
    size = size_of(experiment.keys)
    if trouble := size.without_room(folder):
        display.warn(trouble)
    experiment = settled(experiment, display.note)
    variant: Variant = "watched" if trails else "covered" if covered else "plain"
    guests, modules = build_all(experiment, display.note, variant=variant, sanitized=sanitized)
    built = [*guests, *([modules] if modules else [])]
    for note in experiment.notes():
        display.note(note)
    functions = LocalFunctions(experiment) if experiment.functions else None
    manifest = new_manifest(experiment, built, command_line)
    natives = native_kilobots(experiment, guests)
    twins = Twins(natives, twin, display.note, listens=serving is None)
    with BlackBox.made() as black_box, Optimiser(built) as optimiser:
        job = Job(
            experiment,
            [str(guest.file) for guest in guests],
            folder.absolute(),
            manifest,
            str(black_box.path),
            "" if modules is None else str(modules.file),
            serving,
            probes or Probes(),
            covered,
            symbols=symbols_of(guests, modules),
            functions_outside=functions is not None,
            acts=acts,
            trails=trails,
            faster=() if runs_native_code(experiment) else expected(experiment, guests),
            listen_to=twins.robots,
            listen_s=TWIN_S,
            viewers=() if window is None else (window.run_end,),
            speed=speed,
            threads=threads_for(experiment),
        )
        try:
            child = _Child(
                job,
                display,
                math.inf if timeout_s is None else timeout_s,
                functions,
                window,
                optimiser=optimiser,
                twins=twins,
            )
            outcome = child.wait()
        finally:
            display.stop()
            for link in serving.names(experiment) if serving is not None else ():
                remove_dead(link)
    outcome.summary["record"] = {**size.as_dict(), "bytes": bytes_of(folder)}
    if outcome.stop_asked:
        return outcome
    outcome.summary["notes"] += notes.of_programs(experiment, outcome.summary["stats"])
    return _with_twins(outcome, twins, folder)


def _with_twins(outcome: Outcome, twins: Twins, folder: Path) -> Outcome:
    """The summary and the manifest say what came of them."""
    if verdicts := [asdict(verdict) for verdict in twins.verdicts()]:
        add_to_manifest(folder, {"twins": verdicts})
        outcome.summary["twins"] = verdicts
    return outcome


def new_manifest(
    experiment: Experiment, guests: list[Guest], command_line: list[str]
) -> dict[str, Any]:
    """The manifest of a run that begins now."""
    return {
        "kilotwin": __version__,
        "status": RUNNING,
        "command_line": command_line,
        "experiment_sha256": experiment.identity(),
        "seed": experiment.keys.seed,
        "programs": [
            {
                "name": it.name,
                "file": it.file.name,
                "key": it.key,
                "compiler": it.compiler,
                "sources": digest_of(program),
            }
            for it, program in zip(guests, programs_of(experiment), strict=False)
        ],
        **_environment(experiment),
        **({UIDS: list(experiment.uids)} if experiment.lab else {}),
        "python": platform.python_version(),
        "machine": _machine(),
        "started_utc": utc_now(),
    }


def _machine() -> str:
    """As platform.platform() has it, which starts a process to ask for the processor."""
    system = os.uname()
    c_library = "".join(platform.libc_ver())
    return f"{system.sysname}-{system.release}-{system.machine}-with-{c_library}"


def _environment(experiment: Experiment) -> dict[str, Any]:
    """Which program an environment has, if there is one."""
    if experiment.environment is None:
        return {}
    named = experiment.environment
    return {"environment": {"file": named.file.name, "sha256": named.sha256()}}


def _beside(folder: Path) -> set[Path]:
    """Files of a grid's runs of this name (runs/grid_record.py)."""
    if not folder.parent.is_dir():
        return set()
    files = folder.parent.iterdir()
    return {f for f in files if f.name.startswith(folder.name) and f.suffix == ".kilodat"}


class _Child:
    """The worker process of one run."""

    def __init__(
        self,
        job: Job,
        display: Display,
        timeout_s: float,
        functions: LocalFunctions | None,
        window: Window | None,
        *,
        optimiser: Optimiser,
        twins: Twins,
    ) -> None:
        self._job = job
        self._twins = twins
        assert job.black_box is not None
        self._black_box = BlackBox(Path(job.black_box))
        self._watch = Watch(self._black_box)
        self._growth = None if unconfined_because(job.experiment) else growth_of(job)
        self._ended_because = ""
        self._window = window
        self._functions = functions
        self._in_function = False
        self._display = display
        self._timeout_s = timeout_s
        self._timed_out = False
        self._folder_made = self._began = False
        self._optimiser = optimiser
        self._began_s = 0.0
        self._estimated = not math.isinf(job.speed)  # it takes as long as its page wants
        self._beside_before = _beside(job.folder)
        self._interrupts = 0
        self._out_of_patience = False

    def wait(self) -> Outcome:
        """Starts it, shows what it reports, and gives its outcome; errors leave a closed folder."""
        last: dict[str, Any] = {}
        with (
            tempfile.TemporaryFile("w+", errors="replace") as log,
            start_worker(self._job, log) as process,
        ):
            if self._window is not None:
                self._window.handed_over()
            assert process.stdout is not None
            with self._stop_on_signals(process):
                reports = process.stdout
                for line in iter(lambda: reports.readline(_LONGEST_REPORT), b""):
                    self._watch.heard()
                    last = self._understood(line, process)
                    if last["type"] == "measure":
                        last = self._answer(last, process)
                    self._show(last)
                    if last["type"] == "error":  # what comes behind it is of no account
                        break
                returncode = process.wait()
                if memory_group.remove(process.pid):
                    self._ended_because = self._black_box.out_of_memory(self._job.experiment)
                self._ended_because = self._ended_because or self._overgrown()
                if self._ended_because:
                    last = {}
                if last.get("type") == "done":
                    summary, code = last["summary"], last["exit_code"]
                    cut_short = self._timed_out and summary["status"] == INTERRUPTED
                    try:
                        marks = understood(last.get("marks", ()))
                    except (TypeError, ValueError):
                        raise RunError(_GARBLED) from None
                    return Outcome(summary, code, self._interrupts > 0, cut_short, marks)
                log.seek(0)
                raise self._failure(last, returncode, log.read(_LONGEST_LOG).strip())

    def _answer(self, message: dict[str, Any], process: WorkerProcess) -> dict[str, Any]:
        """Calls metrics' functions for the worker; returns the message, or an error for one that is
        none. Without an answer, once the run is interrupted."""
        self._in_function = True
        try:
            assert self._functions is not None
            line = answer(self._functions, message)
        except (AssertionError, ValueError, TypeError, KeyError):
            return self._garbled(process)
        finally:
            self._in_function = False
        if process.stdin is not None and not process.stdin.closed:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.write(line)
                process.stdin.flush()
        return message

    def _garbled(self, process: WorkerProcess) -> dict[str, Any]:
        process.kill()
        return {"type": "error", "exit_code": RunError.exit_code, "message": _GARBLED}

    def _understood(self, line: bytes, process: WorkerProcess) -> dict[str, Any]:
        """A report; a program that writes into the worker's pipe ends its run."""
        try:
            message = json.loads(line)
            for key, kind in _REPORTS[message["type"]].items():
                if not isinstance(message[key], kind):
                    raise TypeError
        except (ValueError, TypeError, KeyError, RecursionError):
            return self._garbled(process)
        return dict(message)

    def _show(self, message: dict[str, Any]) -> None:
        experiment = self._job.experiment
        if message["type"] == "folder":
            self._folder_made = True
        elif message["type"] == "started":
            self._began = True
            self._began_s = time.monotonic()
            self._display.note(size_of(experiment.keys).text())
            self._display.start(experiment, self._job.folder)
            if self._window is not None:
                self._window.open(self._job.folder)
        elif message["type"] == "heard":
            self._begin_twins(message["heard"])
        elif message["type"] == "note":
            self._display.note(plain(message["text"]))
        elif message["type"] == "progress":
            ran_s, end = time.monotonic() - self._began_s, ticks(experiment.keys.duration_s)
            whole_s = ran_s * end / max(message["tick"], 1)
            self._optimiser.note(ran_s, whole_s - ran_s)
            self._say_what_native_takes(ran_s, whole_s)
            self._display.progress(
                message["tick"], message["resting"], message["not_resting"], message["metrics"]
            )

    def _begin_twins(self, heard: dict[str, Any]) -> None:
        """With what the run's robots got; what cannot be understood is none of it."""
        ears = {}
        with contextlib.suppress(ValueError, TypeError):
            for robot, messages in heard.items():
                its = tuple((int(tick), str(message), int(mm)) for tick, message, mm in messages)
                ears[int(robot)] = Ear(self._job.experiment.uid_of(int(robot)), its)
        self._twins.begin(ears)

    def _say_what_native_takes(self, ran_s: float, whole_s: float) -> None:
        """Once, of a long run of programs that run translated."""
        experiment = self._job.experiment
        if self._estimated or ran_s < _KNOWN_S or whole_s < _LONG_S:
            return
        self._estimated = True
        native_s = cpu_s_of(experiment, natively=True)
        if native_s < min(whole_s / 2, cpu_s_of(experiment)):
            self._display.note(
                f"takes about {duration_text(whole_s)}; --set swarm.cpu=native would take about "
                f"{duration_text(native_s)} of CPU time, by C and not by the robots' machine code "
                "(docs/limits.md)"
            )

    def _failure(self, last: dict[str, Any], returncode: int, log: str) -> KilotwinError:
        """The error when no `done` came; closes the folder, if there is one."""
        if last.get("type") == "error":
            kinds = {kind.exit_code: kind for kind in (InputError, DeviceError)}
            error: KilotwinError = kinds.get(last["exit_code"], RunError)(last["message"])
            if self._folder_made and not self._began:
                self._remove_refused()
                return error
        else:
            error = self._death(returncode, log)
        if self._folder_made:
            status = INTERRUPTED if isinstance(error, InterruptError) else FAILED
            job = self._job
            close_for_writer(job.folder, job.manifest, status, error.exit_code, str(error))
        return error

    def _remove_refused(self) -> None:
        """A refused run leaves nothing: no folder, no file beside it that was not there before."""
        shutil.rmtree(self._job.folder, ignore_errors=True)
        for file in _beside(self._job.folder) - self._beside_before:
            file.unlink(missing_ok=True)

    def _death(self, returncode: int, log: str) -> KilotwinError:
        kept = f"; what was recorded is in {self._job.folder}" if self._folder_made else ""
        if self._interrupts > 1:
            return InterruptError("interrupted twice, and ended at once" + kept)
        ran = self._ran_last()
        if self._out_of_patience:
            late = f"the engine did not stop within {_PATIENCE_S:.0f} s, and was ended{ran}{kept}"
            if self._timed_out:
                return TimeoutRunError(f"it took longer than {self._timeout_s:g} s; {late}")
            return InterruptError(f"interrupted; {late}")
        if self._ended_because:
            return RunError(self._ended_because + kept)
        cause = f"ended with code {returncode}"
        if returncode < 0:
            cause = f"was ended by {signal.Signals(-returncode).name}"
        return RunError(f"the engine's process {cause}{ran}{kept}", detail=quoted(log))

    def _ran_last(self) -> str:
        last = self._black_box.ran_last(self._job.experiment)
        return f"; last to run was {last}" if last else ""

    @contextlib.contextmanager
    def _stop_on_signals(self, process: WorkerProcess) -> Iterator[None]:
        """Ctrl-C or a polite kill ends the run early, with its data kept; a second ends it now.

        So does the engine's not ending within some seconds.
        """

        def give_up() -> None:
            self._out_of_patience = True
            process.kill()

        def time_is_over() -> None:
            if self._interrupts:
                return
            self._timed_out = True
            if process.stdin is not None:
                process.stdin.close()
            patience.start()

        patience = threading.Timer(_PATIENCE_S, give_up)
        limit = threading.Timer(self._timeout_s, time_is_over)
        patience.daemon = limit.daemon = True

        def stop(number: int, frame: FrameType | None) -> None:
            self._interrupts += 1
            if self._interrupts > 1:
                process.kill()
                if self._in_function:  # which may never return
                    raise InterruptError("interrupted twice, while a metric's function was called")
            elif process.stdin is not None:
                process.stdin.close()
                if not self._timed_out:
                    patience.start()

        over = threading.Event()

        def look() -> None:
            while not over.wait(LOOK_S):
                if why := self._why_to_end(process):
                    self._ended_because = why
                    process.kill()
                    return

        watcher = threading.Thread(target=look, daemon=True)
        if math.isfinite(self._timeout_s):
            limit.start()
        watcher.start()
        with heeding_interrupts(stop):
            try:
                yield
            finally:
                limit.cancel()
                patience.cancel()
                over.set()
                watcher.join()

    def _why_to_end(self, process: WorkerProcess) -> str:
        """Why the worker is to be ended now, as a clause; "" if it is not."""
        # A debugger holds a chip for as long as it likes, an environment thinks as long.
        patient = self._job.probes.gdb is not None or self._job.experiment.environment is not None
        if self._in_function or patient:
            self._watch.heard()
        elif self._watch.is_stuck():
            return self._watch.what(self._job.experiment)
        return self._overgrown(process.pid)

    def _overgrown(self, process: int | None = None) -> str:
        """The excess in the run folder, while the process writes it or at the end; "" if none."""
        if self._growth is None:
            return ""
        trouble = self._growth.too_much(process)
        return trouble and trouble + self._ran_last()
