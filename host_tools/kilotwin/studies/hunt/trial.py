"""Trials of a hunt: a variation in, what failed and what was reached out. They are runs of
scenarios, as `kilotwin test` has them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment, Group
from kilotwin.experiment.schema.expect import Expect
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.programs.cache import Notify
from kilotwin.programs.coverage.marks import BITS, clear
from kilotwin.programs.group import settled
from kilotwin.programs.guest_symbols import GuestSymbols
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.native.sanitizer import SANITIZED
from kilotwin.programs.variant import Variant
from kilotwin.studies.hunt.corpus import Feature
from kilotwin.studies.hunt.variation import Base, Pose, Tables, Variation
from kilotwin.studies.pool.built import Builder
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.pool.task import Ran as RanTrial
from kilotwin.studies.pool.task import Task
from kilotwin.studies.scenario.judge import judge
from kilotwin.studies.scenario.looks import Failure, Looks, by_cause
from kilotwin.studies.scenario.one_run import Ran, Seen, ran_of

Tier = Literal["plain", "sanitized", "translated"]
"""plain: as the experiment says; sanitized: natively, looking for undefined behaviour; translated:
of an experiment whose robots run natively, by their machine code, as on the robot."""

TRANSLATED = Setting(("swarm", "cpu"), "translated", "kilotwin hunt")
SETTINGS: dict[Tier, list[Setting]] = {
    "plain": [],
    "sanitized": [SANITIZED],
    "translated": [TRANSLATED],
}

_POSE_DIGITS = 4
_BITS_OF = np.array([number.bit_length() for number in range(256)])


@dataclass(frozen=True)
class Fault:
    """A property that does not hold: `expected`, as an [[expect]] has it, and the cause: `file` and
    `line`, or "" and 0. `said`: what was seen, for people."""

    expected: str
    file: str
    line: int
    said: str

    @property
    def key(self) -> tuple[str, str, int]:
        """Equal for faults that are one."""
        return self.expected, self.file, self.line


@dataclass(frozen=True)
class Outcome:
    """The outcome of a trial. `refused`: there is no such experiment, or it took too long, so that
    nothing is known. `reached`: features of code and states, for guidance. `starts`: poses with
    which robots began."""

    faults: tuple[Fault, ...] = ()
    reached: frozenset[Feature] = frozenset()
    refused: str = ""
    result_hash: str = ""
    starts: tuple[Pose, ...] = ()

    def shows(self, key: tuple[str, str, int]) -> bool:
        """Whether that fault is among them."""
        return any(one.key == key for one in self.faults)


@dataclass(frozen=True)
class Findings(Seen):
    """Looks at a trial, with the changes of LEDs; its marks are its own, though trials share
    a process. `variables`: of each group, offsets in a robot's state of its program's variables."""

    variables: tuple[tuple[int, ...], ...] = ()

    def writer(self, experiment: Experiment) -> Looks:
        """Looks at LEDs too."""
        return Looks(experiment, sees_changes=True)

    def answer(self, ran: RanTrial[Looks]) -> bytes:
        """As JSON."""
        said = super().answer(ran)
        clear(ran.job.all_guests)
        return said

    def numbers(self, ran: RanTrial[Looks]) -> list[tuple[int, int]]:
        """Of each byte of a variable, how many bits it has in any robot: 16 a byte, and those."""
        found: list[tuple[int, int]] = []
        first = 0
        for group, (own, robots) in enumerate(
            zip(self.variables, ran.job.experiment.groups, strict=False)
        ):
            there = range(first, first + robots.count)
            first = there.stop
            if own:
                states = [np.frombuffer(ran.trial.state(robot), np.uint8) for robot in there]
                bits = _BITS_OF[np.stack([state[list(own)] for state in states])]
                pairs = np.unique(bits + 16 * np.arange(len(own)))
                found += [(group, int(pair)) for pair in pairs]
        return found


@dataclass(frozen=True)
class Build:
    """An experiment that was settled for a tier, and what builds its programs."""

    tier: Tier
    experiment: Experiment
    builder: Builder
    variables: tuple[tuple[int, ...], ...] = ()

    @staticmethod
    def of(experiment: Experiment, tier: Tier, notify: Notify) -> "Build":
        """With its programs built: InputError and such if they cannot be."""
        experiment = settled(experiment, notify)
        is_sanitized = tier == "sanitized"
        variant: Variant = "plain" if is_sanitized else "hunted"
        # Faster code pays: a hunt has thousands of trials.
        builder = Builder(notify, variant=variant, sanitized=is_sanitized, at_once=False)
        guests = builder.built(experiment).guests
        groups = zip(experiment.groups, guests, strict=True)
        return Build(
            tier, experiment, builder, tuple(_variables_of(group, guest) for group, guest in groups)
        )

    def settled(self, experiment: Experiment) -> Experiment:
        """A variation of the experiment, with the processors that it was settled for."""
        tiers = {group.program: group.tier for group in self.experiment.groups}
        groups = tuple(replace(group, tier=tiers[group.program]) for group in experiment.groups)
        return replace(experiment, groups=groups)


class Laboratory:
    """Runs trials of one experiment's variations."""

    def __init__(
        self, base: Base, origin: ExperimentText, builds: Sequence[Build], timeout_s: float
    ) -> None:
        """`builds`: the plain one first."""
        self._base = base
        self._expects = [Expect.model_validate(row) for row in base.tables["expect"]]
        self._origin = origin
        self._builds = {build.tier: build for build in builds}
        self._timeout_s = timeout_s

    def expecting(self, expected: str) -> "Laboratory":
        """The same, whose experiments expect nothing else."""
        builds, expects = list(self._builds.values()), self._builds["plain"].experiment.keys.expect
        rows = self._base.tables["expect"]
        key, _, _ = expected.partition(" = ")
        kept = [row for row, one in zip(rows, expects, strict=True) if one.text() == expected]
        if not kept:
            kept = [{key if key.startswith("no_") else "no_crash": True}]
        base = replace(self._base, tables={**self._base.tables, "expect": kept})
        return Laboratory(base, self._origin, builds, self._timeout_s)

    def tables(self, variation: Variation, tier: Tier) -> Tables:
        """The tables of a variation's experiment, which `kilotwin test` runs on that tier, with
        --sanitize on the sanitized one."""
        return self._text(variation, "plain" if tier == "sanitized" else tier).raw

    @property
    def tiers(self) -> Sequence[Tier]:
        """Those that trials can be run on."""
        return list(self._builds)

    def experiment(self, variation: Variation, tier: Tier) -> Experiment:
        """The ordinary experiment of a variation. InputError if there is none."""
        return self._builds[tier].settled(Experiment.of(self._text(variation, tier)))

    def _text(self, variation: Variation, tier: Tier) -> ExperimentText:
        tables, origin = self._base.varied(variation), self._origin
        return ExperimentText(origin.source, origin.folder, tables, "", SETTINGS[tier])

    def run(self, wanted: Sequence[tuple[Variation, Tier]], pool: Pool) -> list[Outcome]:
        """The outcome of each, in their order."""
        outcomes: dict[int, Outcome] = {}
        tasks: dict[int, Task[Ran]] = {}
        for index, (variation, tier) in enumerate(wanted):
            try:
                tasks[index] = self._task(variation, tier)
            except InputError as error:
                outcomes[index] = Outcome(refused=str(error))
        indices = list(tasks)
        for number, answer in pool.answers(list(tasks.values())):
            index = indices[number]
            task, tier = tasks[index], wanted[index][1]
            outcomes[index] = self._as_written(
                task.experiment, outcome_of(task.experiment, ran_of(task, answer), tier)
            )
        return [outcomes[index] for index in range(len(wanted))]

    def _as_written(self, experiment: Experiment, outcome: Outcome) -> Outcome:
        """With expectations as the hunted experiment has them, also those that were cut."""
        pairs = zip(experiment.keys.expect, self._expects, strict=True)
        names = {one.text(): written.text() for one, written in pairs}
        faults = [
            replace(fault, expected=names.get(fault.expected, fault.expected))
            for fault in outcome.faults
        ]
        return replace(outcome, faults=tuple(faults))

    def _task(self, variation: Variation, tier: Tier) -> Task[Ran]:
        experiment = self.experiment(variation, tier)
        return Task(
            experiment,
            Findings(self._builds[tier].variables),
            self._builds[tier].builder.built(experiment).keys,
            self._timeout_s,
            trusted=Task.trusts(),
            variant="plain" if tier == "sanitized" else "hunted",
            sanitized=tier == "sanitized",
        )


def outcome_of(experiment: Experiment, ran: Ran, tier: Tier) -> Outcome:
    """Judges the properties by a run. On the sanitized tier crashes and undefined behaviour
    count alone: what robots decide there is not what they decide on the chip."""
    if ran.trouble and (ran.timed_out or _was_refused(ran)):
        return Outcome(refused=ran.trouble)
    verdicts = [one for one in judge(experiment, [ran]) if not one.passed]
    faults: list[Fault] = []
    for verdict in verdicts:
        if tier == "sanitized" and not verdict.expected.startswith(("no_undefined", "no_crash")):
            continue
        if not verdict.blamed:
            faults.append(Fault(verdict.expected, "", 0, verdict.said))
            continue
        failures = {
            "no_crash = true": ran.crashes,
            "no_busy_wait = true": ran.busy_waits,
            "no_undefined = true": ran.undefined,
            "no_mistake = true": ran.mistakes,
        }[verdict.expected]
        faults += [_fault(verdict.expected, one) for one, _ in by_cause(failures)]
    starts = tuple(
        (round(x, _POSE_DIGITS), round(y, _POSE_DIGITS), round(turn, _POSE_DIGITS))
        for x, y, turn in ran.starts
    )
    return Outcome(tuple(faults), frozenset(_reached(ran)), "", ran.result_hash, starts)


def _was_refused(ran: Ran) -> bool:
    """The engine finds no room for the robots, say: that is no failure of a program."""
    return not ran.trouble.startswith(("nothing went on", "its process", "its programs took"))


def _fault(expected: str, failure: Failure) -> Fault:
    return Fault(expected, failure.file, failure.line, f"{failure.who}: {failure.what}")


def _reached(ran: Ran) -> Iterable[Feature]:
    """Features: each bit of a mark of code, each change of an LED, each length of a variable's
    byte in bits."""
    for group, marks in enumerate(ran.marks):
        for address, mark in marks.items():
            for bit in BITS:
                if mark & bit:
                    yield group, address, bit
    for change in ran.led_changes:
        yield "led", *change
    for number in ran.numbers:
        yield "number", *number


def _variables_of(group: Group, guest: Guest) -> tuple[int, ...]:
    """Offsets of bytes of its program's variables; none of a native one, whose pointers are not
    the same in each process."""
    if group.tier != "translated" or guest.symbols is None:
        return ()
    extents = GuestSymbols(guest.symbols).extents()
    return tuple(sorted({at for begin, end in extents for at in range(begin, end)}))
