"""The best values of some keys: Optuna proposes points, trials of a sweep measure them.

Points are proposed in batches of a fixed size, each after all results of those before. So what is
proposed depends on the seed and on results alone: not on the number of workers, and not on how
often the search was stopped. A search that goes on asks for the same points again, whose trials are
there.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import optuna
from optuna.distributions import (
    BaseDistribution,
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)
from optuna.trial import TrialState

from kilotwin.errors import InputError
from kilotwin.studies.compare.bootstrap import bootstrap, bootstrap_mean, mean_difference
from kilotwin.studies.compare.plain_intervals import Interval
from kilotwin.studies.search.points import Laboratory, mean_of
from kilotwin.studies.search.space import Axis, Point

Direction = Literal["max", "min"]
Sampler = Literal["tpe", "cmaes", "random"]


@dataclass(frozen=True)
class Goal:
    """A metric that is to be large or small."""

    metric: str
    direction: Direction


@dataclass(frozen=True)
class Search:
    """How to search: so many points, each `repeats` times with seeds from 1 on.

    `prune`: points are given up that are bad at their first repeats; `prune_at`: or, with the first
    seed, after these shares of the experiment's duration. `confirm`: with so many other seeds the
    best point is held against the experiment as it is.
    """

    axes: list[Axis]
    goals: list[Goal]
    points: int
    repeats: int = 3
    batch: int = 4
    sampler: Sampler = "tpe"
    seed: int = 1
    prune: bool = False
    confirm: int = 10
    prune_at: tuple[float, ...] = ()

    @property
    def prunes(self) -> bool:
        """Whether points are given up before all is run."""
        return self.prune or bool(self.prune_at)

    def check(self) -> None:
        """InputError of what does not go together."""
        if len(self.goals) > 1 and self.sampler == "cmaes":
            raise InputError("--sampler cmaes: for one metric; take tpe for several")
        if len(self.goals) > 1 and self.prunes:
            raise InputError("--prune, --prune-at: for one metric; leave it out for several")
        if any(not 0 < share < 1 for share in self.prune_at):
            raise InputError("--prune-at: a share of the duration, above 0 and below 1, as 0.3")
        if self.sampler == "cmaes" and any(axis.choices for axis in self.axes):
            raise InputError("--sampler cmaes: for numbers only; take tpe for choices")


@dataclass(frozen=True)
class Tried:
    """A point with the means of its goals, NaN where a trial failed; `repeats` that were run."""

    point: Point
    means: tuple[float, ...]
    repeats: int

    @property
    def is_pruned(self) -> bool:
        """Whether it was given up before all repeats."""
        return self.repeats == 0


@dataclass(frozen=True)
class Confirmed:
    """The best point with seeds of its own, beside the experiment as it is; `gain` between them."""

    best: Interval
    as_it_is: Interval
    gain: Interval
    seeds: int


@dataclass(frozen=True)
class Found:
    """The result of a search. `front`: points that no other beats in all goals, the best first."""

    search: Search
    tried: list[Tried]
    front: list[Tried]
    importance: dict[str, float]
    confirmed: Confirmed | None
    trials: int


def optimise(search: Search, laboratory: Laboratory, note: Callable[[str], None]) -> Found:
    """Searches, or goes on. InterruptError if interrupted."""
    search.check()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(
        directions=["maximize" if goal.direction == "max" else "minimize" for goal in search.goals],
        sampler=_sampler(search),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=search.batch),
    )
    space = {axis.key: _distribution(axis) for axis in search.axes}
    tried: list[Tried] = []
    while len(tried) < search.points:
        asked = [study.ask(space) for _ in range(min(search.batch, search.points - len(tried)))]
        points = [
            {axis.key: axis.value(trial.params[axis.key]) for axis in search.axes}
            for trial in asked
        ]
        if search.prunes:
            tried += _with_pruning(search, study, asked, points, laboratory)
        else:
            tried += _whole(search, study, asked, points, laboratory)
        if best := _best(search, tried):
            values = ", ".join(f"{mean:.4g}" for mean in best[0].means)
            note(f"{len(tried)} of {search.points} points; the best so far: {values}")
    front = _best(search, tried)
    return Found(
        search,
        tried,
        front,
        _importance(search, study),
        confirm(search, front[0].point, laboratory) if front and search.confirm else None,
        laboratory.trials,
    )


def _sampler(search: Search) -> Any:
    if search.sampler == "random":
        return optuna.samplers.RandomSampler(seed=search.seed)
    if search.sampler == "cmaes":
        return optuna.samplers.CmaEsSampler(seed=search.seed, n_startup_trials=search.batch)
    return optuna.samplers.TPESampler(
        seed=search.seed, n_startup_trials=2 * search.batch, multivariate=True, constant_liar=True
    )


def _distribution(axis: Axis) -> BaseDistribution:
    if axis.choices:
        return CategoricalDistribution(axis.choices)
    if axis.whole:
        step = 1 if axis.step is None else round(axis.step)
        return IntDistribution(round(axis.low), round(axis.high), log=axis.log, step=step)
    return FloatDistribution(axis.low, axis.high, log=axis.log, step=axis.step)


def _whole(
    search: Search, study: Any, asked: Sequence[Any], points: list[Point], laboratory: Laboratory
) -> list[Tried]:
    """All repeats of a batch at once."""
    tried = []
    measured = laboratory.measure(points, range(1, search.repeats + 1))
    for trial, point, values in zip(asked, points, measured, strict=True):
        means = tuple(mean_of(values, goal.metric) for goal in search.goals)
        _tell(study, trial, means)
        tried.append(Tried(point, means, search.repeats))
    return tried


def _with_pruning(
    search: Search, study: Any, asked: Sequence[Any], points: list[Point], laboratory: Laboratory
) -> list[Tried]:
    """Step by step: a point whose mean is worse than the median of those before is given up.

    Steps are shares of the duration with the first seed, then whole trials, one repeat more each.
    """
    (goal,) = search.goals
    left = list(range(len(points)))
    means = dict.fromkeys(left, math.nan)
    repeats = range(1, search.repeats + 1) if search.prune else [search.repeats]
    steps = [*((share, 1) for share in sorted(search.prune_at)), *((1.0, n) for n in repeats)]
    for step, (share, repeat) in enumerate(steps, 1):
        chosen = [points[place] for place in left]
        measured = laboratory.measure(chosen, range(1, repeat + 1), share=share)
        still = []
        for place, values in zip(left, measured, strict=True):
            means[place] = mean_of(values, goal.metric)
            trial = asked[place]
            if not math.isnan(means[place]):
                trial.report(means[place], step)
                if step < len(steps) and trial.should_prune():
                    study.tell(trial, state=TrialState.PRUNED)
                    continue
            still.append(place)
        left = still
    for place in left:
        _tell(study, asked[place], (means[place],))
    return [
        Tried(point, (means[place],), search.repeats if place in left else 0)
        for place, point in enumerate(points)
    ]


def _tell(study: Any, trial: Any, means: tuple[float, ...]) -> None:
    if any(map(math.isnan, means)):
        study.tell(trial, state=TrialState.FAIL)
    else:
        study.tell(trial, list(means))


def _best(search: Search, tried: Sequence[Tried]) -> list[Tried]:
    """Those that no other one beats; of one goal all, the best first."""
    signs = [1 if goal.direction == "max" else -1 for goal in search.goals]
    whole = [one for one in tried if not one.is_pruned and not any(map(math.isnan, one.means))]

    def score(one: Tried) -> tuple[float, ...]:
        return tuple(sign * mean for sign, mean in zip(signs, one.means, strict=True))

    def beats(one: Tried, other: Tried) -> bool:
        pairs = list(zip(score(one), score(other), strict=True))
        return all(a >= b for a, b in pairs) and any(a > b for a, b in pairs)

    ordered = sorted(whole, key=score, reverse=True)
    distinct = [one for i, one in enumerate(ordered) if one.point not in _points(ordered[:i])]
    if len(signs) == 1:
        return distinct
    return [one for one in distinct if not any(beats(other, one) for other in distinct)]


def _points(tried: Sequence[Tried]) -> list[Point]:
    return [one.point for one in tried]


def _importance(search: Search, study: Any) -> dict[str, float]:
    """How much each key matters for the first goal; none of a search too short to say."""
    done = [trial for trial in study.trials if trial.state == TrialState.COMPLETE]
    if len(search.axes) < 2 or len(done) < 2 * search.batch:
        return {}
    evaluator = optuna.importance.PedAnovaImportanceEvaluator()
    target = None if len(search.goals) == 1 else lambda trial: trial.values[0]
    found = optuna.importance.get_param_importances(study, evaluator=evaluator, target=target)
    return {key: float(value) for key, value in found.items()}


def confirm(search: Search, best: Point, laboratory: Laboratory) -> Confirmed | None:
    """The best of many is partly luck: both are run with seeds that the search has not used."""
    first = search.repeats + 1
    seeds = range(first, first + search.confirm)
    metric = search.goals[0].metric
    sides = []
    for values in laboratory.measure([best, {}], seeds):
        numbers = [one[metric] for one in values if one is not None]
        sides.append([number for number in numbers if number is not None])
    if not all(sides):
        return None
    gain = bootstrap(sides, mean_difference)
    return Confirmed(bootstrap_mean(sides[0]), bootstrap_mean(sides[1]), gain, search.confirm)
