"""A trial: an experiment run in this process, and all that takes part in it put together."""

import contextlib
import resource
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Generic

from kilotwin import _emulator
from kilotwin.errors import InputError
from kilotwin.experiment.spec.engine import engine_spec, place_of_error
from kilotwin.experiment.spec.informed import informed_for
from kilotwin.metrics.functions import Functions, LocalFunctions, RemoteFunctions
from kilotwin.metrics.meter import Meter
from kilotwin.runs import notes
from kilotwin.runs.event_places import EventPlaces
from kilotwin.runs.folder import FINISHED, INTERRUPTED, TOUCHED, add_to_manifest
from kilotwin.runs.sampling import DECISION_S, decision_s
from kilotwin.runs.writer import RunWriter
from kilotwin.session.acts import STEERED, Repetition
from kilotwin.session.emulated import EmulatedWorld
from kilotwin.session.estimate import cpu_s_of
from kilotwin.session.faster_code import FasterCode
from kilotwin.session.job import Job
from kilotwin.session.loop import Attention, Companion, Each, Session
from kilotwin.session.recorder import (
    CellRecorder,
    FrameRecorder,
    Listener,
    ModuleRecorder,
    Recorder,
    Report,
    TrailKeeper,
    Writer,
    WriterT,
)
from kilotwin.session.steps import Steps
from kilotwin.units import seconds, ticks

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from kilotwin.session.emulated_environment import EmulatedEnvironment
    from kilotwin.session.steering import Steering

# About how long a call of the engine takes. Until it is over no signal is seen; at its end no robot
# may have been run ahead, which with 100,000 robots would cost an eighth at a third of this time.
_CHUNK_S = 0.4
# A first one is meant to take an eighth, for the estimate is one: a short trial has no second.
_SURE_S = _CHUNK_S / 8


class Trial(Generic[WriterT]):
    """The engine, the writer, and their companions."""

    def __init__(
        self,
        job: Job,
        report: Report,
        make_writer: Callable[[], WriterT],
        confine: Callable[[], None] = lambda: None,
        beside: Callable[[EmulatedWorld], Sequence[Companion]] = lambda _: (),
    ) -> None:
        """Reads and opens all that it needs, is confined by `confine`, and then loads the programs
        and powers the robots up. `beside`: companions that act before all others."""
        self._began = time.perf_counter()
        self._cpu_began = time.process_time()
        self._job = job
        self._report = report
        self._keys = job.experiment.keys
        self._check_probes()
        self._simulation = self._make_simulation()
        meter = self._make_meter()
        environments = self._make_environments()
        self.writer = make_writer()
        writer: Writer = self.writer
        self._folder = [writer] if isinstance(writer, RunWriter) else []
        self._world, hosts = self._make_world()
        confine()
        self._power_up()
        self._attach_probes()
        for environment in environments:
            self._keep(environment)
        self._recorder: Recorder[WriterT] = Recorder(
            self._world,
            job.experiment,
            self.writer,
            meter,
            report=report,
            attention=self._make_attention(),
        )
        for folder in self._folder:
            folder.before_event = self._recorder.take_events
        self._began_tick, self._startup_s = self._world.tick, 0.0
        self._touched = False
        self._companions: list[Companion] = [
            *beside(self._world),
            self._recorder,
            *self._module_recorders(),
            Listener(self._world, job.listen_to, job.listen_s, report),
            *self._frame_recorders(),
            *self._repetitions(),
            *self._trails(),
            Steps(job.experiment, self._simulation),
            *hosts,
            *environments,
            FasterCode(job.faster, self._note_faster_code),
            *self._viewers(),
            Each(self._note_start),
        ]
        report({"type": "started", "folder": str(job.folder)})

    def run(self, stopped: Callable[[], bool]) -> bool:
        """Advances to the end; False if stopped before. The last record is the last moment."""
        Session(self._world, self._companions).run(stopped)
        self._note_start()  # a short trial is over with its first step
        return self._world.ran

    def summary(self, interrupted: bool) -> dict[str, Any]:
        """The object that `kilotwin run --json` prints."""
        simulation = self._simulation
        cpu_s = time.process_time() - self._cpu_began
        simulated_s = seconds(self._world.run_tick)
        parts = {key: it for one in self._companions for key, it in one.summary().items()}
        return {
            "experiment": self._keys.name,
            "seed": self._keys.seed,
            "status": INTERRUPTED if interrupted else FINISHED,
            "duration_s": self._keys.duration_s,
            "simulated_s": round(simulated_s, 3),
            "robots": simulation.robots,
            "informed": informed_for(self._keys),
            "cpu_s": round(cpu_s, 3),
            "wall_s": round(time.perf_counter() - self._began, 3),
            "startup_s": round(self._startup_s, 4),
            "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            "robot_s_per_cpu_s": round(simulation.robots * simulated_s / max(cpu_s, 1e-9)),
            "result_hash": simulation.result_hash(),
            "final_hash": simulation.final_hash(),
            "run_folder": str(self._job.folder),
            "stats": simulation.stats(),
            DECISION_S: decision_s(simulation.decisions(), self._counts(), simulated_s),
            "notes": [*notes.of_robots(simulation, self._job.experiment)],
            **parts,
        }

    def _counts(self) -> list[int]:
        """Robots of each program."""
        return [group.count for group in self._job.experiment.groups]

    def frames(self) -> "NDArray[np.uint32]":
        """[robots, 2]: frames sent and received so far."""
        return self._simulation.frames()

    def state(self, robot: int) -> bytes:
        """The bytes of a robot's variables now, as its program has laid them out."""
        return self._simulation.state(robot)

    def close(self) -> None:
        """Ends what companions have open; the writer is its maker's."""
        for folder in self._folder:
            folder.before_event = lambda: None  # what robots do from now on is no part of it
        for companion in self._companions:
            companion.close()
        self._companions = []  # some know this trial, whose engine would wait for Python to collect

    def _check_probes(self) -> None:
        probes, experiment = self._job.probes, self._job.experiment
        wanted = [("--gdb", probes.gdb), *(("--vcd", uid) for uid in probes.vcd)]
        for option, uid in wanted:
            if uid is None:
                continue
            if not experiment.group_of(experiment.robot_named(uid, option)).on_board:
                what = f"robot {uid} does not run on a board"
                raise InputError(
                    f'{option} {uid}: {what}: only robots with a hex, or cpu = "avr", do'
                )

    def _debugged(self) -> tuple[int, int] | None:
        """The robot that gdb controls, and the port for it."""
        probes = self._job.probes
        if probes.gdb is None:
            return None
        return self._job.experiment.robot_named(probes.gdb, "--gdb"), probes.gdb_port

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
            debugged=self._debugged(),
            threads=job.threads,
        )
        with self._placing_errors():
            return _emulator.Simulation(spec, powered=False)

    def _lead_ticks(self) -> int:
        if self._job.serving is not None:
            return 0
        from kilotwin.session.emulated_grid import lead_ticks

        return lead_ticks(self._job.experiment)

    @contextlib.contextmanager
    def _placing_errors(self) -> Iterator[None]:
        """An error of the engine becomes one at its place in the experiment."""
        job = self._job
        try:
            yield
        except _emulator.EngineError as error:
            place = place_of_error(job.experiment, str(error), job.module_guest)
            raise job.experiment.error(place, str(error)) from None

    def _make_meter(self) -> Meter:
        """Before there is a folder, and before this process is confined."""
        job = self._job
        functions: Functions | None = None
        if job.functions_outside:
            functions = RemoteFunctions(self._report, sys.stdin.buffer)
        elif job.experiment.functions:
            functions = LocalFunctions(job.experiment)
        return Meter(job.experiment, functions, job.symbols)

    def _make_environments(self) -> "list[EmulatedEnvironment]":
        """Before there is a folder: its program may refuse. A served world's is outside."""
        if self._keys.environment is None or self._job.serving is not None:
            return []
        from kilotwin.session.emulated_environment import EmulatedEnvironment

        return [EmulatedEnvironment(self._job.experiment, self._simulation)]

    def _make_world(self) -> tuple[EmulatedWorld, list[Companion]]:
        """The world, and what hosts it: the grid's host, or what waits for hosts from outside."""
        job = self._job
        places = EventPlaces(job.experiment, job.symbols)
        if job.serving is not None:
            from kilotwin.session.served_world import serve

            (writer,) = self._folder
            served = serve(self._simulation, places, job.experiment, job.serving, writer)
            for note in served.notes:
                self._report({"type": "note", "text": note})
            return served.world, served.companions
        end = min([ticks(self._keys.duration_s), *(trail.end_tick for trail in job.trails)])
        if self._keys.grid is None:
            return EmulatedWorld(self._simulation, places, end=end), []
        from kilotwin.session.emulated_grid import EmulatedHost

        to = next(iter(self._folder), None)
        hosts = [EmulatedHost(self._simulation, job.experiment, places, to)]
        return EmulatedWorld(self._simulation, places, hosts, end), [*hosts]

    def _power_up(self) -> None:
        """The first time that a program can do anything."""
        with self._placing_errors():
            self._simulation.power_up()

    def _attach_probes(self) -> None:
        probes = self._job.probes
        try:
            for uid in probes.vcd:
                robot = self._job.experiment.robot_named(uid, "--vcd")
                self._simulation.trace(robot, str(self._job.folder / f"robot_{uid}.vcd"))
        except _emulator.EngineError as error:
            raise InputError(str(error)) from None
        if probes.gdb is not None:
            what = f"robot {probes.gdb} waits; in avr-gdb type: target remote :{probes.gdb_port}"
            self._report({"type": "note", "text": what})

    def _keep(self, environment: "EmulatedEnvironment") -> None:
        from kilotwin.runs.environment_record import EnvironmentEvents, EnvironmentRecord

        records = [EnvironmentRecord(folder) for folder in self._folder]
        environment.keep(next(iter(records), EnvironmentEvents()))

    def _make_attention(self) -> Attention:
        """When the recorder takes what there is: in a served world, which lives by the wall, at
        once. Beside a viewer, looks are to take their share of this process's time, not of all."""
        if self._job.serving is not None:
            return Attention(0.0)
        if not self._job.viewers:
            if self._folder:  # it is to have all up to where a program brings the engine down
                return Attention(_CHUNK_S)
            share = _SURE_S / max(cpu_s_of(self._job.experiment), _SURE_S)
            return Attention(_CHUNK_S, first=max(1, int(ticks(self._keys.duration_s) * share)))
        from kilotwin.session.live import chunk_s

        return Attention(chunk_s(self._simulation.robots), time.process_time)

    def _module_recorders(self) -> list[Companion]:
        if self._job.serving is not None:
            return []
        sample_ticks, recorders = self._keys.sample_ticks, list[Companion]()
        for folder in self._folder:
            if folder.wants_modules:
                recorders.append(ModuleRecorder(self._world, folder, sample_ticks))
            if folder.wants_cells:
                recorders.append(CellRecorder(self._world, folder, sample_ticks))
        return recorders

    def _repetitions(self) -> list[Companion]:
        return [Repetition(self._job.acts, self._make_steering().do)] if self._job.acts else []

    def _frame_recorders(self) -> list[Companion]:
        """None beside a trail, which takes them."""
        sample_ticks = self._keys.sample_ticks
        return [
            FrameRecorder(self._world, folder, sample_ticks)
            for folder in self._folder
            if folder.wants_frames and not self._job.trails
        ]

    def _trails(self) -> list[Companion]:
        return [TrailKeeper(self._world, one, self._job.folder) for one in self._job.trails]

    def _viewers(self) -> list[Companion]:
        """The links to viewers, which do not steer where hosts outside have the say."""
        job, world = self._job, self._world
        if not job.viewers:
            return []
        from kilotwin.session.live import Live

        return [
            Live(
                viewer,
                self._simulation,
                self._make_steering() if job.serving is None else None,
                grid=self._keys.grid is not None,
                zero_tick=lambda: world.zero_tick,
                waits=lambda: self._report({"type": "waits"}),
                others=(sys.stdin.fileno(),),
                speed=job.speed,
            )
            for viewer in job.viewers
        ]

    def _make_steering(self) -> "Steering":
        from kilotwin.session.steering import Steering, no_grid

        orders = [host.order for host in self._world.hosts]
        grid = next(iter(orders), no_grid)
        return Steering(
            self._simulation,
            self._keys.sample_ticks,
            self._note_act,
            grid,
            self._job.experiment.uid_of,
        )

    def _note_act(self, event: dict[str, Any]) -> None:
        """The run was steered, or its pace changed: an event, and the manifest says so at once."""
        self.writer.add_events([event])
        self._recorder.kinds[event["kind"]] += 1
        time_s = round(seconds(event["tick"]), 3)
        if event["kind"] == STEERED and not self._touched:
            self._touched = True
            if self._folder:
                add_to_manifest(self._job.folder, {TOUCHED: {"first_s": time_s}})
        self._report({"type": "note", "text": f"at {time_s:.3f} s: {event['text']}"})

    def _note_faster_code(self, tick: int) -> None:
        time_s = round(seconds(tick - self._world.zero_tick), 3)
        add_to_manifest(self._job.folder, {"faster_code_from_s": time_s})

    def _note_start(self) -> None:
        """How long it took until the first step was over."""
        if not self._startup_s and self._world.tick > self._began_tick:
            self._startup_s = time.perf_counter() - self._began
