"""The first of a debugger's worlds: a fork of this process, confined as a run's worker is, that
puts the run together and then obeys."""

import contextlib
import gc
import os
import signal
import sys
import traceback
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NoReturn

from kilotwin import _emulator
from kilotwin.errors import KilotwinError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.states import Counts, States, count
from kilotwin.files.confined_process import confine_process
from kilotwin.metrics.values import NO_METRICS, MetricValues
from kilotwin.session.confined_worker import load_libraries, unconfined_because
from kilotwin.session.debug.checkpoints import MOST_BYTES
from kilotwin.session.debug.held_world import HeldWorld
from kilotwin.session.debug.links import Link
from kilotwin.session.job import Job
from kilotwin.session.trial import Trial

if TYPE_CHECKING:
    from kilotwin._emulator import Event, Samples


@dataclass(frozen=True)
class Held:
    """A program that a debugger can hold: the file that the engine loads, and the code beside it of
    robots that are held, and of one of which it is noted what it writes."""

    name: str
    file: Path
    debugged: Path
    watched: Path


class _NoWriter:
    """In place of the writer of a run folder: a run that is repeated leaves nothing."""

    def __init__(self, experiment: Experiment) -> None:
        self._states = States.of(experiment.keys)
        self._sites = len(experiment.keys.site)

    def add(self, samples: "Samples", measured: MetricValues = NO_METRICS) -> Counts | None:
        return None

    def count(self, samples: "Samples") -> Counts:
        return count(self._states, samples["led"], samples["site"], self._sites)

    def add_events(self, events: "Iterable[Event | dict[str, Any]]") -> None:
        """They are not kept."""


def start(job: Job, held: Sequence[Held], links: Sequence[tuple[Link, Link]], log: IO[str]) -> int:
    """Forks it, on link 0; what it and its programs print goes into `log`. Its process id."""
    load_libraries(job.experiment)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    parent = os.getpid()
    process = os.fork()
    if process == 0:
        _be_world(job, held, [theirs for _, theirs in links], log, parent)
    for _, theirs in links:
        theirs.close()
    return process


def _be_world(
    job: Job, held: Sequence[Held], links: Sequence[Link], log: IO[str], parent: int
) -> NoReturn:
    code = 1
    # The leader's objects are not finalised here: its temporary folders would go.
    gc.freeze()
    try:
        os.setpgid(0, 0)
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # no process waits for forks of forks
        _emulator.end_with_parent(parent)
        for stream in (1, 2):
            os.dup2(log.fileno(), stream)
        _leave_all_but({1, 2, *(link.fileno() for link in links)})
        _repeat(job, held, links)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError):
            sys.stderr.flush()
        os._exit(code)


def _leave_all_but(kept: set[int]) -> None:
    """Leaves the leader's files, so that a link ends with the leader. Their numbers stay open, on
    nothing: libraries close at a fork, or when an object goes, what they had opened there."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for file in [int(one.name) for one in Path("/proc/self/fd").iterdir()]:
        if file not in kept:
            os.dup2(nothing, file)


def _repeat(job: Job, held: Sequence[Held], links: Sequence[Link]) -> None:
    def load_confined() -> None:
        _confine(job, held)
        for one in held:
            _emulator.hold_by(str(one.file), one.name, str(one.debugged), str(one.watched))

    try:
        trial = Trial(
            job,
            lambda _: None,
            lambda: _NoWriter(job.experiment),
            load_confined,
            lambda world: [HeldWorld(world.simulation, links)],
        )
        # A collection touches every object, and so copies the memory that forks share.
        gc.collect()
        gc.freeze()
        gc.disable()
        trial.run(lambda: False)
    except KilotwinError as error:
        links[0].send({"type": "error", "exit_code": error.exit_code, "message": str(error)})


def _confine(job: Job, held: Sequence[Held]) -> None:
    if unconfined_because(job.experiment):
        return
    missing = _emulator.lacking_layers()
    from kilotwin.files import confinement

    if confinement.mode() == "require" and missing:
        raise RunError(f"--confine=require: {missing[0]}; use a newer kernel, or leave it out")
    if job.acts:
        import kilotwin.session.steering  # noqa: F401 (a confined process could not)
    confine_process(
        job.experiment.size,
        readable=[
            *map(Path, job.all_guests),
            *(file for one in held for file in (one.debugged, one.watched)),
        ],
        writable=[] if job.black_box is None else [Path(job.black_box)],
        forks_bytes=MOST_BYTES,
    )
