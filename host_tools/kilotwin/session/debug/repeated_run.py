"""The run that a debugger repeats: of a run folder or an experiment file, with its programs built
so that they can be held."""

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.programs.cache import Notify
from kilotwin.programs.group import build_all, settled, symbols_of
from kilotwin.programs.translate.translation import translated_guest
from kilotwin.runs.folder import EXPERIMENT, FINISHED, MANIFEST
from kilotwin.runs.reader import Run
from kilotwin.session.acts import Act, acts_of
from kilotwin.session.black_box import BlackBox
from kilotwin.session.debug.travel import Travel
from kilotwin.session.debug.world_process import Held
from kilotwin.session.job import Job
from kilotwin.session.verify import check_translated, experiment_of


@dataclass(frozen=True)
class Repeated:
    """`file`: the experiment file; of a recorded run that in its folder. `result_hash` is that of
    the recorded run, "" if there is none to compare with."""

    file: Path
    experiment: Experiment
    acts: tuple[Act, ...] = ()
    result_hash: str = ""

    @staticmethod
    def of(target: Path, settings: Sequence[Setting]) -> "Repeated":
        """Reads it from a run folder, its manifest, or an experiment file. InputError for what
        cannot be repeated: real robots, hosts outside."""
        folder = target.parent if target.name == MANIFEST else target
        if not (folder / MANIFEST).is_file():
            return Repeated(target, Experiment.load(target, settings))
        if settings:
            raise InputError("--set, --seed: a recorded run is repeated as it was; leave them out")
        run = Run.open(folder)
        experiment = experiment_of(run, run.robots())
        finished = run.manifest["status"] == FINISHED
        hash_ = str(run.manifest["summary"]["result_hash"]) if finished else ""
        return Repeated(folder / EXPERIMENT, experiment, acts_of(run.events()), hash_)

    @property
    def duration_s(self) -> float:
        """How long the run takes, in simulated seconds."""
        return self.experiment.keys.duration_s


@contextlib.contextmanager
def travel_in(
    repeated: Repeated,
    robots: Sequence[int],
    notify: Notify = lambda _: None,
    interrupted: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[Travel, dict[int, Path]]]:
    """The run, which has not begun; and the .elf of each robot's program that can be held, by the
    robot's index. InputError if one of `robots` cannot be."""
    experiment = settled(repeated.experiment, notify)
    for robot in robots:
        cannot = "gdb holds none"
        if experiment.group_of(robot).on_board:
            again = f"kilotwin run {repeated.file} --gdb {experiment.uid_of(robot)}"
            cannot = f"gdb has no way back (without one: {again})"
        check_translated(experiment, robot, cannot, f"kilotwin debug {repeated.file}")
    guests, modules = build_all(experiment, notify)
    held = {}
    symbols: dict[int, Path] = {}
    first = 0
    for group, guest in zip(experiment.groups, guests, strict=True):
        if group.tier == "translated":
            debugged = translated_guest(group.program, notify, variant="debugged")
            watched = translated_guest(group.program, notify, variant="watched")
            held[guest.file] = Held(group.program.name, guest.file, debugged.file, watched.file)
            assert guest.symbols is not None
            symbols.update(dict.fromkeys(range(first, first + group.count), guest.symbols))
        first += group.count
    with BlackBox.made() as box:
        job = Job(
            experiment,
            [str(guest.file) for guest in guests],
            Path.cwd(),
            {},
            str(box.path),
            "" if modules is None else str(modules.file),
            symbols=symbols_of(guests, modules),
            acts=repeated.acts,
        )
        with Travel(job, list(held.values()), interrupted=interrupted) as travel:
            yield travel, symbols


def moment(at_s: float | None, duration_s: float) -> float:
    """Where to hold: `at_s`, or the begin. InputError if it is no moment of the run."""
    at_s = 0.0 if at_s is None else at_s
    if not (math.isfinite(at_s) and 0 <= at_s < duration_s):
        raise InputError(f"--at {at_s:g}: the run has 0 to {duration_s:g} s")
    return at_s
