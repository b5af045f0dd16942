"""The child process of a run: steps the engine, writes the run folder, reports.

It answers with one JSON object per line on stdout: folder, once there is one, started, progress,
then done or error (run.py has them). The parent ends a run early by closing its stdin, which the
parent's own death does too. Robot programs run in this process; one that brings it down leaves the
parent to close the folder.

As `python -m kilotwin.session.worker PARENT` it takes a pickled Job on stdin first
(worker_process.py).
"""

import contextlib
import json
import os
import pickle
import resource
import select
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from kilotwin import _emulator
from kilotwin.errors import (
    EXIT_INTERRUPTED,
    EXIT_ROBOTS_FAILED,
    InputError,
    KilotwinError,
    RunError,
    cause_of,
)
from kilotwin.experiment.spec.engine import engine_spec, place_of_error
from kilotwin.experiment.spec.informed import informed_for
from kilotwin.experiment.states import Counts
from kilotwin.files import extras
from kilotwin.files.lean_arrow import leave_pandas_out, load_parquet
from kilotwin.metrics.functions import Functions, LocalFunctions, RemoteFunctions
from kilotwin.metrics.meter import Meter, metrics_summary
from kilotwin.metrics.moment import Moment
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.programs.coverage.marks import marks_of_all
from kilotwin.runs.causes import causes
from kilotwin.runs.event_places import EventPlaces
from kilotwin.runs.folder import (
    FAILURES,
    FINISHED,
    INTERRUPTED,
    TOUCHED,
    UNDEFINED,
    add_to_manifest,
    close_manifest,
)
from kilotwin.runs.writer import RunWriter
from kilotwin.session.acts import STEERED, Repetition
from kilotwin.session.confined_worker import confine_worker
from kilotwin.session.job import Job
from kilotwin.session.pace import MOST_TICKS
from kilotwin.session.steps import Steps
from kilotwin.units import seconds, ticks

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from kilotwin._emulator import Event, Samples
    from kilotwin.session.emulated_environment import EmulatedEnvironment
    from kilotwin.session.emulated_grid import EmulatedHost
    from kilotwin.session.live import Live
    from kilotwin.session.served_world import ServedWorld
    from kilotwin.session.steering import Steering

# About how long a call of the engine takes. Until it is over no signal is seen; at its end no robot
# may have been run ahead, which with 100,000 robots would cost an eighth at a third of this time.
_CHUNK_S = 0.4
_PROGRESS_S = 0.2
# Time to close the folder when the parent has died; a program that never returns has no more.
_GRACE_S = 10.0


Report = Callable[[dict[str, Any]], None]


def main() -> None:
    """Runs the job of stdin, for the parent whose process id is the argument."""
    serve(pickle.load(sys.stdin.buffer), int(sys.argv[1]))


def serve(job: Job, parent: int) -> None:
    """Runs the job for the process `parent`; stdin and stdout are pipes to it."""
    _emulator.end_with_parent(parent, _GRACE_S)
    # Ctrl-C is for the parent, which then closes our stdin.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    leave_pandas_out()
    load_parquet()  # a confined process cannot
    # Output of libraries and programs must not get between the reports.
    reports = os.dup(1)
    os.dup2(2, 1)

    def report(message: dict[str, Any]) -> None:
        # A parent that died is noticed by `stopped`, with the folder in order.
        with contextlib.suppress(BrokenPipeError):
            line = memoryview(json.dumps(message).encode() + b"\n")
            while line:
                line = line[os.write(reports, line) :]

    def stopped() -> bool:
        return bool(select.select([0], [], [], 0)[0])

    try:
        simulate(job, report, stopped, confine_worker)
    except ModuleNotFoundError as error:
        lacks = extras.explained(error)
        report({"type": "error", "exit_code": lacks.exit_code, "message": str(lacks)})
    except KilotwinError as error:
        report({"type": "error", "exit_code": error.exit_code, "message": str(error)})


def simulate(
    job: Job,
    report: Report,
    stopped: Callable[[], bool],
    confine: Callable[[Job], dict[str, Any]] | None = None,
) -> None:
    """Runs the experiment to its end or until `stopped`. A refused one leaves no folder.

    `confine` is called before the first program is loaded; what it returns goes into the manifest.
    It is for a process that does nothing else.
    """

    def make_writer() -> RunWriter:
        writer = _make_folder(job)
        report({"type": "folder"})
        return writer

    def confine_now() -> None:
        if confine is not None:
            add_to_manifest(job.folder, confine(job))

    trial = Trial(job, report, make_writer, confine_now)
    try:
        interrupted = not trial.run(stopped)
        summary = trial.summary(interrupted)
        trial.close()
        trial.writer.close(clean=not interrupted)
        exit_code = _exit_code(summary)
        close_manifest(job.folder, summary["status"], exit_code, summary=summary)
    except OSError as error:
        raise RunError(f"{job.folder}: cannot write ({cause_of(error)}); see to the disk") from None
    marks = marks_of_all(job.all_guests) if job.covered else []
    report({"type": "done", "exit_code": exit_code, "summary": summary, "marks": marks})


def _exit_code(summary: dict[str, Any]) -> int:
    if summary["status"] == INTERRUPTED:
        return EXIT_INTERRUPTED
    grid = summary.get("grid", {})
    failed = summary["robots_failed"] or summary["undefined"] or grid.get("modules_failed")
    failed = failed or grid.get("undefined")
    return EXIT_ROBOTS_FAILED if failed else 0


class Writer(Protocol):
    """Where a trial's records go; `writer.RunWriter` is the one that makes a run folder."""

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        """Takes samples of the engine; returns their counts, None for none."""

    def count(self, samples: "Samples") -> Counts:
        """How many robots do what, in each of the samples."""

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """Takes events."""


WriterT = TypeVar("WriterT", bound=Writer)


class Trial(Generic[WriterT]):
    """The engine, the writer, and what has been seen so far."""

    def __init__(
        self,
        job: Job,
        report: Report,
        make_writer: Callable[[], WriterT],
        confine: Callable[[], None] = lambda: None,
    ) -> None:
        """Reads and opens all that it needs, is confined by `confine`, and then loads the programs
        and powers the robots up."""
        self._began = time.perf_counter()
        self._cpu_began = time.process_time()
        self._job = job
        self._report = report
        self._keys = job.experiment.keys
        self._check_probes()
        self._simulation = self._make_simulation()
        self._places = EventPlaces(job.experiment, job.symbols)
        self._meter = self._make_meter()
        self._environment = self._make_environment()
        self._steps = Steps(self._keys)
        self.writer = make_writer()
        self._host, self._served = self._join_hosts()
        confine()
        self._power_up()
        self._attach_probes()
        self._keep_environment()
        self._live = None if job.live is None else self._join_viewer(job.live)
        self._repetition: Repetition | None = None
        if job.acts:
            self._repetition = Repetition(job.acts, self._make_steering().do)
        # Beside other programs, looks are to take their share of this one's time, not of all.
        self._clock = time.perf_counter if self._live is None else time.process_time
        self._chunk_s = _CHUNK_S
        if self._live is not None:
            from kilotwin.session.live import chunk_s

            self._chunk_s = chunk_s(self._simulation.robots)
        self._events: Counter[str] = Counter()
        self._failed: list[dict[str, Any]] = []
        self._undefined: list[dict[str, Any]] = []
        self._touched = False
        # Records how modules are at samples.
        self._modules: RunWriter | None = None
        if isinstance(self.writer, RunWriter) and self.writer.wants_modules and not self._served:
            self._modules = self.writer
        if isinstance(self.writer, RunWriter):
            self.writer.before_event = self._take_events
        self._stops_at_samples = self._meter.wants_moments or self._modules is not None
        self._startup_s = 0.0
        self._sampled_at = -1
        self._samples = 0
        self._last: Counts | None = None
        self._reported_at = 0.0
        report({"type": "started", "folder": str(job.folder)})

    def _check_probes(self) -> None:
        probes, size = self._job.probes, self._job.experiment.size
        wanted = [("--gdb", probes.gdb), *(("--vcd", robot) for robot in probes.vcd)]
        for option, robot in wanted:
            if robot is not None and robot >= size:
                raise InputError(f"{option} {robot}: there are robots 0 to {size - 1}")

    def _attach_probes(self) -> None:
        probes = self._job.probes
        try:
            for robot in probes.vcd:
                self._simulation.trace(robot, str(self._job.folder / f"robot_{robot}.vcd"))
        except _emulator.EngineError as error:
            raise InputError(str(error)) from None
        if probes.gdb is not None:
            what = f"robot {probes.gdb} waits; in avr-gdb type: target remote :{probes.gdb_port}"
            self._report({"type": "note", "text": what})

    def run(self, stopped: Callable[[], bool]) -> bool:
        """Advances to the end; False if stopped before. The last record is the last moment."""
        if self._served is not None:
            return self._serve(self._served, stopped)
        simulation, end = self._simulation, ticks(self._keys.duration_s)
        chunk = 1
        self._take(simulation.samples())
        while simulation.tick < end and not stopped():
            began_s = self._clock()
            allowed = self._allowed_ticks()
            if not allowed:
                self._report({"type": "waits"})
                continue
            if self._repetition is not None:
                allowed = min(allowed, self._repetition.ticks(simulation.tick))
            ahead = min(chunk, end - simulation.tick, self._ticks_until_sample(), allowed)
            self._advance(ahead)
            self._startup_s = self._startup_s or time.perf_counter() - self._began
            took_s = self._clock() - began_s
            chunk = max(1, min(4 * ahead, round(ahead * self._chunk_s / max(took_s, 1e-6))))
            samples = simulation.samples()
            self._take(samples, last=self._ends_with(samples, end))
        if self._sampled_at != simulation.tick:
            self._take(simulation.snapshot(), last=True)
        return simulation.tick >= end

    def _ends_with(self, samples: "Samples", end: int) -> bool:
        """Whether the last of these samples is the last of the run."""
        now = self._simulation.tick
        return now >= end and len(samples["tick"]) > 0 and int(samples["tick"][-1]) == now

    def _ticks_until_sample(self) -> int:
        """So far may the engine go for the sake of what is measured beside its samples."""
        if not self._stops_at_samples:
            return sys.maxsize
        return max(1, self._samples * self._keys.sample_ticks - self._simulation.tick)

    def _serve(self, world: "ServedWorld", stopped: Callable[[], bool]) -> bool:
        """Until a host has had its run; False if stopped before."""
        while not world.over and not stopped():
            world.step()
            self._take(world.from_zero(self._simulation.samples()))
            if self._live is not None:
                self._live.heed(self._zero_tick)
            world.wait()
        return world.ran

    def _allowed_ticks(self) -> int:
        """How far a viewer lets it go now; 0 after a wait."""
        if self._live is None:
            return MOST_TICKS
        return self._live.ticks_now(self._zero_tick, sys.stdin.fileno())

    def _join_viewer(self, descriptor: int) -> "Live":
        """The link to a viewer, which does not steer where hosts outside have the say."""
        steering = self._make_steering() if self._served is None else None
        from kilotwin.session.live import Live

        return Live(descriptor, self._simulation, steering, grid=self._keys.grid is not None)

    def _make_steering(self) -> "Steering":
        grid = None if self._host is None else self._host.order
        from kilotwin.session.steering import Steering

        return Steering(self._simulation, self._keys.sample_ticks, self._note_act, grid)

    def _note_act(self, event: dict[str, Any]) -> None:
        """The run was steered, or its pace changed: an event, and the manifest says so at once."""
        self.writer.add_events([event])
        self._events[event["kind"]] += 1
        time_s = round(seconds(event["tick"]), 3)
        if event["kind"] == STEERED and not self._touched:
            self._touched = True
            add_to_manifest(self._job.folder, {TOUCHED: {"first_s": time_s}})
        self._report({"type": "note", "text": f"at {time_s:.3f} s: {event['text']}"})

    def _advance(self, count: int) -> None:
        """So many ticks, with the grid's host or the environment doing in between what is due."""
        simulation, end = self._simulation, self._simulation.tick + count
        while simulation.tick < end:
            self._steps.step(simulation)
            ahead = self._steps.most_ticks(simulation, end - simulation.tick)
            if self._host is not None:
                self._host.step()
                ahead = min(ahead, self._host.ticks_until_due())
            if self._environment is not None:
                self._environment.step(simulation)
                ahead = min(ahead, self._environment.ticks_until_due(simulation))
            simulation.advance(ahead)

    def _take_events(self) -> None:
        """Writes down what programs did before now, in order of time: at the end of a call of the
        engine, and before an event that is not the engine's, so that all are in that order."""
        modules = [] if self._host is None else self._host.module_events()
        robots = [self._places.of_robot(told) for told in self._simulation.events()]
        for event in robots:
            event["tick"] -= self._zero_tick
            self._events[event["kind"]] += 1
            if event["kind"] in FAILURES:
                self._failed.append(event)
            elif event["kind"] == UNDEFINED:
                self._undefined.append(event)
        if modules or robots:
            self.writer.add_events(sorted(modules + robots, key=lambda event: event["tick"]))

    def _take(self, samples: "Samples", *, last: bool = False) -> None:
        self._take_events()
        if self._host is not None:
            self._host.see(samples)
        self._samples += len(samples["tick"])
        counts = self.writer.add(samples, self._measure(samples, last=last))
        if counts is None:
            return
        self._sampled_at = int(samples["tick"][-1])
        if self._modules is not None:
            self._modules.add_modules(self._sampled_at, self._simulation.modules())
        self._last = counts
        if time.perf_counter() - self._reported_at > _PROGRESS_S:
            self._reported_at = time.perf_counter()
            shown = {"tick": self._simulation.tick - self._zero_tick, **self._robots_now(counts)}
            self._report({"type": "progress", **shown, "metrics": self._meter.latest})

    def _measure(self, samples: "Samples", *, last: bool) -> MetricValues:
        if not len(samples["tick"]):
            return NO_METRICS
        failed = len({event["robot"] for event in self._failed})
        moment = Moment(self._simulation, failed, self._keys.grid is not None)
        is_now = int(samples["tick"][-1]) == self._simulation.tick - self._zero_tick
        before = set(self._meter.failed)
        measured = self._meter.measure(samples, moment if is_now else None, last=last)
        for name in self._meter.failed.keys() - before:
            what = f"metric {name}: {self._meter.failed[name]}"
            event = {"tick": int(samples["tick"][-1]), "kind": "metric_failed", "text": what}
            self.writer.add_events([event])
        return measured

    def _robots_now(self, counts: Counts) -> dict[str, Any]:
        names = [site.name for site in self._keys.site]
        return {
            "resting": dict(zip(names, counts.resting[-1].tolist(), strict=True)),
            "not_resting": int(counts.not_resting[-1]),
        }

    def summary(self, interrupted: bool) -> dict[str, Any]:
        """The object that `kilotwin run --json` prints."""
        simulation = self._simulation
        cpu_s = time.process_time() - self._cpu_began
        simulated_s = seconds(simulation.tick - self._zero_tick)
        last = self._last if self._served is not None else None
        if last is None:
            snapshot = simulation.snapshot()
            if self._host is not None:
                self._host.see(snapshot)
            last = self.writer.count(snapshot)
        return {
            "experiment": self._keys.name,
            "seed": self._keys.seed,
            "status": INTERRUPTED if interrupted else FINISHED,
            "duration_s": self._keys.duration_s,
            "simulated_s": round(simulated_s, 3),
            "robots": simulation.robots,
            **self._robots_now(last),
            "informed": informed_for(self._keys),
            "cpu_s": round(cpu_s, 3),
            "wall_s": round(time.perf_counter() - self._began, 3),
            "startup_s": round(self._startup_s, 4),
            "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            "robot_s_per_cpu_s": round(simulation.robots * simulated_s / max(cpu_s, 1e-9)),
            "result_hash": simulation.result_hash(),
            "final_hash": simulation.final_hash(),
            "run_folder": str(self._job.folder),
            "events": dict(self._events),
            "robots_failed": self._failed,
            "causes": [cause.as_dict("robot") for cause in causes(self._failed)],
            "undefined": [cause.as_dict("robot") for cause in causes(self._undefined)],
            "stats": simulation.stats(),
            "metrics": metrics_summary(self._keys, self._meter.latest),
            "metrics_failed": self._meter.failed,
            **self._environment_summary(),
            **({} if self._host is None else {"grid": self._host.summary()}),
        }

    def frames(self) -> "NDArray[np.uint32]":
        """[robots, 2]: frames sent and received so far."""
        return self._simulation.frames()

    def close(self) -> None:
        """Ends what the grid has open; the writer is its maker's."""
        if isinstance(self.writer, RunWriter):
            self.writer.before_event = lambda: None  # what robots do from now on is no part of it
        if self._environment is not None:
            self._environment.close()
        if self._host is not None:
            self._host.finish()
        if self._served is not None:
            self._served.close()

    def _make_meter(self) -> Meter:
        """Before there is a folder, and before this process is confined."""
        job = self._job
        functions: Functions | None = None
        if job.functions_outside:
            functions = RemoteFunctions(self._report, sys.stdin.buffer)
        elif job.experiment.functions:
            functions = LocalFunctions(job.experiment)
        return Meter(job.experiment, functions, job.guests)

    def _make_environment(self) -> "EmulatedEnvironment | None":
        """Before there is a folder: its program may refuse. A served world's is outside."""
        if self._keys.environment is None or self._job.serving is not None:
            return None
        from kilotwin.session.emulated_environment import EmulatedEnvironment

        return EmulatedEnvironment(self._job.experiment)

    def _keep_environment(self) -> None:
        if self._environment is not None:
            writer = self.writer if isinstance(self.writer, RunWriter) else None
            from kilotwin.runs import environment_record as records

            self._environment.keep(
                records.EnvironmentRecord(writer) if writer else records.EnvironmentEvents()
            )

    def _environment_summary(self) -> dict[str, Any]:
        if self._environment is None:
            return {}
        simulation = self._simulation
        return {"environment": self._environment.summary(simulation.stats(), simulation.robots)}

    def _join_hosts(self) -> "tuple[EmulatedHost | None, ServedWorld | None]":
        """The grid's host, or what waits for hosts from outside; neither without either."""
        job = self._job
        writer = self.writer if isinstance(self.writer, RunWriter) else None
        if job.serving is not None:
            assert writer is not None
            from kilotwin.session.served_world import ServedWorld

            world = ServedWorld(self._simulation, job.experiment, job.serving, writer)
            for note in world.notes():
                self._report({"type": "note", "text": note})
            return None, world
        if self._keys.grid is None:
            return None, None
        from kilotwin.session import emulated_grid as grid

        return grid.EmulatedHost(self._simulation, job.experiment, self._places, writer), None

    @property
    def _zero_tick(self) -> int:
        """Tick of the engine when the run began."""
        return 0 if self._served is None else self._served.zero_tick or 0

    def _make_simulation(self) -> _emulator.Simulation:
        job = self._job
        spec = engine_spec(
            job.experiment,
            job.guests,
            sample_ticks=self._keys.sample_ticks,
            black_box=job.black_box,
            module_guest=job.module_guest,
            lead_ticks=self._lead_ticks(),
            waits=job.serving is not None,
            debugged=None if job.probes.gdb is None else (job.probes.gdb, job.probes.gdb_port),
        )
        with self._placing_errors():
            return _emulator.Simulation(spec, powered=False)

    def _power_up(self) -> None:
        """The first time that a program can do anything."""
        with self._placing_errors():
            self._simulation.power_up()

    @contextlib.contextmanager
    def _placing_errors(self) -> Iterator[None]:
        """What the engine does not like becomes an error at its place in the experiment."""
        job = self._job
        try:
            yield
        except _emulator.EngineError as error:
            place = place_of_error(job.experiment, str(error), job.module_guest)
            raise job.experiment.error(place, str(error)) from None

    def _lead_ticks(self) -> int:
        if self._keys.grid is None or self._job.serving is not None:
            return 0
        from kilotwin.session.emulated_grid import lead_ticks

        return lead_ticks(self._job.experiment)


def _make_folder(job: Job) -> RunWriter:
    engine = {
        "version": _emulator.VERSION,
        "build": _emulator.BUILD,
        "box2d": _emulator.BOX2D_VERSION,
        "guest_abi": _emulator.GUEST_ABI,
    }
    try:
        return RunWriter(job.folder, job.experiment, {**job.manifest, "engine": engine})
    except OSError as error:
        raise InputError(f"--out {job.folder}: {cause_of(error)}; name another folder") from None


if __name__ == "__main__":
    main()
