"""A run is repeated up to a moment, with a trail, to tell why a robot did something."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.compute as pc

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.programs.group import settled
from kilotwin.runs.folder import EXPERIMENT
from kilotwin.runs.reader import Run
from kilotwin.runs.trail import Trail, read_trail
from kilotwin.session.acts import acts_of
from kilotwin.session.display import Display
from kilotwin.session.run import run
from kilotwin.session.verify import check_repeatable, check_translated
from kilotwin.studies.why.chain import Link, Question, explain
from kilotwin.studies.why.facts import Facts, What
from kilotwin.studies.why.programs import Programs
from kilotwin.units import seconds, ticks

LED, MOTORS = "led", "motors"
_WHATS = {LED: What.LED, MOTORS: What.MOTORS}


@dataclass(frozen=True)
class Asked:
    """A question: of the robot with that uid, about its last change of `what` up to `at_s`:
    led, motors or a variable; over `depth` messages at most."""

    robot: int
    at_s: float
    what: str
    depth: int


@dataclass(frozen=True)
class Answer:
    """The chain, and the run that it is of."""

    run: Run
    experiment: Experiment
    links: list[Link]


def ask(folder: Path, asked: Asked, command_line: list[str], display: Display) -> Answer:
    """Repeats the run of a run folder up to the moment, and explains.

    InputError for what is no emulated run, a robot, time or variable that it has not, a robot that
    does not run translated. RunError if it is another run by now.
    """
    before = Run.open(folder)
    experiment = _experiment(before, asked)
    robot = experiment.robot_named(asked.robot, "--robot")
    experiment = settled(experiment, display.note)
    typed = f"kilotwin run {folder / EXPERIMENT}"
    check_translated(experiment, robot, "no store is seen", typed)
    programs = Programs(experiment)
    question = _question(programs, robot, asked)
    trail = Trail(
        max(ticks(asked.at_s), 1),
        programs.draws,
        robot,
        question.address,
        question.address + question.length,
    )
    with tempfile.TemporaryDirectory(prefix="kilotwin-why-") as scratch:
        outcome = run(
            experiment,
            Path(scratch) / "again",
            command_line,
            display,
            acts=acts_of(before.events()),
            trails=(trail,),
        )
        again = Run.open(Path(outcome.summary["run_folder"]))
        _check_same(before, again)
        facts = Facts(read_trail(again.folder))
    return Answer(before, experiment, explain(facts, programs, question, asked.depth))


def _experiment(before: Run, asked: Asked) -> Experiment:
    """Its experiment. InputError if it cannot be repeated, or is over before the moment."""
    check_repeatable(before)
    ran = before.manifest.get("summary", {}).get("simulated_s")
    if ran is None:
        rows = before.robots()
        ran = rows["time_s"][-1].as_py() if rows.num_rows else before.experiment.duration_s
    if not 0 < asked.at_s <= ran + seconds(1):
        raise InputError(
            f"--at {asked.at_s:g}: the run goes from 0 to {ran:g} s; name a moment in it"
        )
    return Experiment.load(before.folder / EXPERIMENT, [])


def _question(programs: Programs, robot: int, asked: Asked) -> Question:
    what = _WHATS.get(asked.what)
    if what is not None:
        return Question(robot, asked.at_s, what, asked.what)
    try:
        place = programs.number(robot, asked.what)
    except InputError as error:
        raise InputError(f"'{asked.what}': it is led, motors or a variable; {error}") from None
    return Question(robot, asked.at_s, What.ASKED, asked.what, place.offset, place.length)


def _check_same(before: Run, again: Run) -> None:
    """The repetition is the run, as far as its samples tell."""
    one, other = before.robots(), again.robots()
    if not one.num_rows or not other.num_rows:
        return
    shared = [name for name in ("x_m", "y_m", "led") if name in one.column_names]
    ticks_of = one["tick"].combine_chunks()
    last = pc.max(pc.filter(ticks_of, pc.is_in(ticks_of, other["tick"].combine_chunks()))).as_py()
    if last is None:
        return
    rows = [table.filter(pc.equal(table["tick"], last)) for table in (one, other)]
    for name in shared:
        was, now = (np.asarray(table[name].cast("string")) for table in rows)
        if len(was) != len(now) or (was != now).any():
            raise RunError(
                f"{before.folder}: repeated, it is another run at {seconds(last):.3f} s ({name} "
                f"differs); kilotwin run --verify {before.folder} says what has changed"
            )
