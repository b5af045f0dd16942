"""The search of a hunt: generations of trials, each planned by what the ones before reached.

A generation is planned from the seed, its number and what is known then, and has a fixed number of
trials: the result does not depend on how many of them run at a time.
"""

import random
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.toml_text import toml_of
from kilotwin.runs.folder import slug
from kilotwin.studies.hunt.folder import FOUND, Found, State, with_paths
from kilotwin.studies.hunt.moves import Move, fresh, mutated
from kilotwin.studies.hunt.shrink import Shrinker, Whole, other_seed
from kilotwin.studies.hunt.trial import Fault, Laboratory, Outcome, Tier
from kilotwin.studies.hunt.variation import LATE, Addition, Pose, Put, Variation
from kilotwin.studies.pool.pool import Pool

GENERATION_LEAST, GENERATION_MOST = 16, 128
_GENERATION_S = 1.0
"""CPU time in s that a generation takes, or so."""
_TRIAL_S = 0.01
"""CPU time in s that a trial takes besides the run."""
_OTHER_EACH = 4
"""So often a trial runs on a tier whose turn it is; the rest are as the experiment says."""
_FRESH = 0.4
_MOST_SHRINKING = 2000
_MOST_OF_ONE = 4
"""Things found of one [[expect]], which differ in what breaks it."""
_GUARD_SEEDS = 4
_PHASES = ("RUN late", "oscillators", "starts")
"""Moves by which interrupts come at other places of a program, and more of them."""
Signature = frozenset[tuple[str, ...]]


@dataclass(frozen=True)
class Budget:
    """How long a hunt goes on: trials in all, and when it is over by this clock."""

    trials: int | None
    ends_at: float | None
    clock: Callable[[], float] = time.monotonic

    def left(self, done: int, wanted: int) -> int:
        """How many trials of so many may still be run; 0 when it is over."""
        if self.ends_at is not None and self.clock() >= self.ends_at:
            return 0
        return wanted if self.trials is None else max(0, min(wanted, self.trials - done))


def generation_of(run_s: float) -> int:
    """Trials of a generation, by the CPU time in s of one run: as many of long runs as are needed
    to learn something, of short ones as are run at once."""
    return max(GENERATION_LEAST, min(GENERATION_MOST, int(_GENERATION_S / (_TRIAL_S + run_s))))


@dataclass
class Search:
    """A hunt: what it may do, and what it knows."""

    laboratory: Laboratory
    moves: dict[str, Move]
    state: State
    folder: Path
    whole: Whole
    generation: int
    note: Callable[[str], None]

    def run(self, pool: Pool, budget: Budget) -> Iterator[Found | None]:
        """Each thing when it is found, and None after each generation."""
        while left := budget.left(self.state.trials, self.generation):
            planned = self._planned()[:left]
            outcomes = self.laboratory.run(planned, pool)
            for (variation, tier), outcome in zip(planned, outcomes, strict=True):
                self.state.trials += 1
                yield from self._learn(variation, tier, outcome, pool)
            self.state.generation += 1
            self.state.write(self.folder)
            yield None

    def _planned(self) -> list[tuple[Variation, Tier]]:
        state, tiers = self.state, self.laboratory.tiers
        chance = random.Random(f"hunt {state.seed} {state.generation}")
        planned: list[tuple[Variation, Tier]] = []
        if state.generation == 0:
            planned += [(Variation(), tier) for tier in tiers]
        while len(planned) < self.generation:
            if not state.corpus.variations or chance.random() < _FRESH:
                one = fresh(chance, self.moves)
            else:
                parents = [state.corpus.choose(chance) for _ in range(2)]
                one = mutated(chance, self.moves, *parents)
            other = tiers[len(planned) // _OTHER_EACH % len(tiers)]
            planned.append((one, other if len(planned) % _OTHER_EACH == 0 else tiers[0]))
        return planned

    def _learn(
        self, variation: Variation, tier: Tier, outcome: Outcome, pool: Pool
    ) -> Iterator[Found]:
        if outcome.refused:
            self.state.refused += 1
            return
        for kind in signature(variation):
            name = " ".join(kind)
            self.state.moves[name] = self.state.moves.get(name, 0) + 1
        self.state.corpus.learn(variation, outcome.reached)
        for fault in outcome.faults:
            if self._is_new(variation, fault):
                found = self._pinned(variation, tier, fault, outcome.starts, pool)
                if found is not None:
                    self.state.found.append(found)
                    yield found

    def _is_new(self, variation: Variation, fault: Fault) -> bool:
        """A cause is found once; an [[expect]] once for each set of changes that breaks it."""
        if fault.file:
            return not any((one.file, one.line) == fault.key[1:] for one in self.state.found)
        alike = [one for one in self.state.found if one.key == fault.key]
        its = breaking(variation)
        return len(alike) < _MOST_OF_ONE and not any(breaking(one.shrunk) <= its for one in alike)

    def _pinned(
        self,
        variation: Variation,
        tier: Tier,
        fault: Fault,
        starts: tuple[Pose, ...],
        pool: Pool,
    ) -> Found | None:
        """Shrunk, and written as a scenario; None if it is the same as one before after all."""
        laboratory = self.laboratory.expecting(fault.expected)
        guard = _Guard(laboratory, tier, fault, pool)
        whole = replace(self.whole, poses=starts)
        shrinker = Shrinker(guard.fails, whole, _MOST_SHRINKING, self._luck)
        shrunk = shrinker.shrunk(variation)
        if not self._is_new(shrunk, fault):
            return None
        experiment = laboratory.experiment(shrunk, tier)
        (outcome,) = laboratory.run([(shrunk, tier)], pool)
        seen = next((one for one in outcome.faults if one.key == fault.key), fault)
        file = self._write(laboratory, experiment, shrunk, tier, seen)
        return Found(
            fault.expected,
            fault.file,
            fault.line,
            seen.said,
            tier,
            self.state.trials,
            variation,
            shrunk,
            str(file),
            experiment.size,
            experiment.keys.duration_s,
            shrinker.tried,
        )

    def _luck(self, chance: random.Random, one: Variation) -> Variation:
        """Another seed, and other phases where they may differ."""
        one = other_seed(chance, one)
        kind = chance.choice(("", *_PHASES))
        return self.moves[kind](chance, one) if kind in self.moves else one

    def _write(
        self,
        laboratory: Laboratory,
        experiment: Experiment,
        shrunk: Variation,
        tier: Tier,
        fault: Fault,
    ) -> Path:
        """A scenario that `kilotwin test` fails on."""
        below = self.folder / FOUND
        below.mkdir(parents=True, exist_ok=True)
        number = len(self.state.found) + 1
        name = f"{number}-{slug(_name_of(fault))}"
        tables = laboratory.tables(shrunk, tier)
        written: dict[str, Any] = with_paths(tables, experiment.resolved(), below)
        written["name"] = name
        file = below / f"{name}.toml"
        sanitize = " --sanitize" if tier == "sanitized" else ""
        comments = [
            f"Found by kilotwin hunt: {fault.expected}",
            *fault.said.splitlines(),
            f"kilotwin test{sanitize} {file}",
        ]
        file.write_text("".join(f"# {line}\n" for line in comments) + toml_of(written))
        return file


def _name_of(fault: Fault) -> str:
    where = f"{Path(fault.file).stem} {fault.line}" if fault.file else ""
    return f"{fault.expected.split('=')[0].strip()} {where}"[:40] if where else fault.expected[:40]


class _Guard:
    """Judges candidates of a shrinking. One that breaks an expectation counts only if as few robots
    in as short a time can meet it at all: else it would be shrunk to what nobody expects."""

    def __init__(self, laboratory: Laboratory, tier: Tier, fault: Fault, pool: Pool) -> None:
        self._laboratory = laboratory
        self._tier = tier
        self._fault = fault
        self._pool = pool
        self._met: dict[tuple[tuple[int, ...], float | None], bool] = {}

    def fails(self, candidates: Sequence[Variation]) -> list[bool]:
        """Whether each of them shows the fault."""
        wanted = [(one, self._tier) for one in candidates]
        outcomes = self._laboratory.run(wanted, self._pool)
        return [
            outcome.shows(self._fault.key) and self._is_fair(one)
            for one, outcome in zip(candidates, outcomes, strict=True)
        ]

    def _is_fair(self, one: Variation) -> bool:
        if self._fault.expected.startswith("no_") or not self._fault.expected:
            return True
        if not one.robots and one.duration_s is None:
            return True
        key = one.robots, one.duration_s
        if key not in self._met:
            plain = Variation(robots=one.robots, duration_s=one.duration_s)
            seeds = [replace(plain, seed=seed) for seed in (None, *range(2, _GUARD_SEEDS + 1))]
            outcomes = self._laboratory.run([(it, self._tier) for it in seeds], self._pool)
            met = [not it.refused and not it.shows(self._fault.key) for it in outcomes]
            self._met[key] = any(met)
        return self._met[key]


def signature(variation: Variation) -> Signature:
    """The kinds of its changes."""
    kinds: set[tuple[str, ...]] = {put.path for put in variation.puts}
    kinds |= {_kind_of(one) for one in variation.additions}
    kinds |= {("uids",)} if variation.uids else set()
    kinds |= {("poses",)} if variation.poses else set()
    return frozenset(kinds)


def breaking(variation: Variation) -> Signature:
    """The same without what takes chance out, and without where robots stand."""
    quiet = {put.path for put in variation.puts if put.value == 0.0}
    return frozenset(signature(variation) - quiet - {("poses",)})


def _kind_of(one: Addition) -> tuple[str, ...]:
    what = next((it for name in ("kind", "send") if (it := one.of(name)) is not None), "")
    if one.path == LATE:
        return ("RUN late",)
    if one.path == ("step",):
        what = "moved" if one.of("pose") is not None else "light"
    return (*one.path, str(what)) if what else one.path


def quiet_of(experiment: Experiment) -> tuple[Put, ...]:
    """Values that take chance out of the medium and the motors."""
    keys = experiment.keys
    medium = [
        Put(("medium", key), 0.0)
        for key in (
            "range_spread",
            "loss",
            "loss_at_range",
            "overhead_loss",
            "gain_noise_lsb",
            "distance_error_mm",
            "clock_spread",
            "sensitivity_spread",
        )
        if getattr(keys.medium, key)
    ]
    motion = [
        Put(("motion", key), 0.0)
        for key in ("speed_spread", "bias_spread", "motor_noise")
        if keys.motion is not None and getattr(keys.motion, key)
    ]
    return (*medium, *motion)
