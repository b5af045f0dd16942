"""Two variants, metric by metric: how far they are apart, and whether that may be chance."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from kilotwin.errors import InputError
from kilotwin.studies.compare.bootstrap import bootstrap, mean_difference
from kilotwin.studies.compare.plain_intervals import Interval
from kilotwin.studies.compare.sides import Side

SAME, APART, OPEN = "within", "outside", "open"
_FEWEST = 5  # trials a side: of fewer an interval by resampling is too narrow
_BOUND = re.compile(r"(?P<metric>[^=]+)=(?P<number>[0-9.eE+-]+)(?P<percent>%?)")


@dataclass(frozen=True)
class Difference:
    """One metric of both sides.

    `difference`: mean of B less mean of A. `delta`: Cliff's, from -1 (all of B below all of A) to
    1. `p`: of the Mann-Whitney test; `p_corrected` by Holm for how many metrics were asked.
    `verdict`: on `bound`, if there is one.
    """

    metric: str
    unit: str
    a: float
    b: float
    trials_a: int
    trials_b: int
    difference: Interval
    delta: float | None
    p: float | None
    p_corrected: float | None
    bound: float | None
    verdict: str


@dataclass(frozen=True)
class VariantComparison:
    """Both sides, what they differ in, and what could not be compared, and why."""

    a: Side
    b: Side
    differences: list[Difference]
    left_out: dict[str, str]
    undecided: str
    """Why nothing is decided by it; "" if something can be."""

    @property
    def within_bounds(self) -> bool:
        """Whether each bound that was given is kept for sure."""
        return all(one.verdict == SAME for one in self.differences if one.bound is not None)

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        return {
            "a": self.a.name,
            "b": self.b.name,
            "trials": [self.a.trials, self.b.trials],
            "sampling": [self.a.sampling, self.b.sampling],
            "undecided": self.undecided,
            "left_out": self.left_out,
            "differences": [_plain(asdict(one)) for one in self.differences],
        }


def _plain(value: Any) -> Any:
    """JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value


def bounds_of(texts: Iterable[str]) -> dict[str, tuple[float, bool]]:
    """Bounds by metric, as "hops=2" or "hops=10%" of A's mean; InputError of what is none."""
    bounds = {}
    for text in texts:
        matched = _BOUND.fullmatch(text)
        try:
            number = float(matched["number"]) if matched else math.nan
        except ValueError:
            number = math.nan
        if matched is None or not number >= 0 or math.isinf(number):
            raise InputError(f"--within {text}: not of the form METRIC=2 or METRIC=10%")
        bounds[matched["metric"]] = (number, bool(matched["percent"]))
    return bounds


def compare(
    a: Side,
    b: Side,
    metrics: Sequence[str] = (),
    within: Mapping[str, tuple[float, bool]] | None = None,
) -> VariantComparison:
    """Every metric that both have, or those named; InputError of one that neither has."""
    within = within or {}
    known = dict.fromkeys([*a.values, *b.values])
    for name in (*metrics, *within):
        if name not in known:
            option = "--metric" if name in metrics else "--within"
            raise InputError(f"{option} {name}: neither has it; they have {', '.join(known)}")
    asked = list(dict.fromkeys([*metrics, *within])) if metrics else list(known)
    left_out, differences = {}, []
    for name in asked:
        if why := _cannot(a, b, name):
            left_out[name] = why
        else:
            differences.append(_difference(a, b, name))
    for name in within:
        if name in left_out:
            raise InputError(f"--within {name}: {left_out[name]}; it cannot be held to a bound")
    undecided = _undecided(a, b)
    corrected = _holm([one.p for one in differences])
    return VariantComparison(
        a,
        b,
        [
            _judged(one, p, within.get(one.metric), undecided)
            for one, p in zip(differences, corrected, strict=True)
        ],
        left_out,
        undecided,
    )


def _cannot(a: Side, b: Side, name: str) -> str:
    for side in (a, b):
        if name not in side.values:
            return f"{side.name} does not have it"
        if not len(side.values[name]):
            return f"{side.name} has no value of it at the end"
    if a.units[name] != b.units[name]:
        units = [side.units[name] or "no unit" for side in (a, b)]
        return f"it is in {units[0]} in A, in {units[1]} in B"
    return ""


def _undecided(a: Side, b: Side) -> str:
    for side in (a, b):
        if side.shortened:
            return f"{side.name}: {side.shortened}; runs that were cut short decide nothing"
    ends = [*a.end_s, *b.end_s]
    if max(ends) - min(ends) > 0.02 * max(ends):
        return (
            f"trials end at {min(ends):,.0f} to {max(ends):,.0f} s; those of different length "
            "decide nothing"
        )
    fewest = min((a, b), key=lambda side: side.trials)
    if fewest.trials < _FEWEST:
        number = "one trial decides" if fewest.trials == 1 else f"{fewest.trials} trials decide"
        return f"{fewest.name}: {number} nothing; {_FEWEST} on each side are the fewest"
    return ""


def _difference(a: Side, b: Side, name: str) -> Difference:
    one, other = a.values[name], b.values[name]
    apart = bootstrap([other.tolist(), one.tolist()], mean_difference)
    delta = p = None
    if min(len(one), len(other)) > 1:
        tested = stats.mannwhitneyu(other, one)
        delta = float(2 * tested.statistic / (len(one) * len(other)) - 1)
        p = 1.0 if _all_equal(one, other) else float(tested.pvalue)
    return Difference(
        name,
        a.units[name],
        float(one.mean()),
        float(other.mean()),
        len(one),
        len(other),
        apart,
        delta,
        p,
        None,
        None,
        OPEN,
    )


def _all_equal(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    return len(np.unique(np.concatenate([one, other]))) == 1


def _holm(values: Sequence[float | None]) -> list[float | None]:
    """p-values, each corrected for how many there are; the smallest one most."""
    tested = sorted((p, place) for place, p in enumerate(values) if p is not None)
    corrected: list[float | None] = [None] * len(values)
    largest = 0.0
    for rank, (p, place) in enumerate(tested):
        largest = max(largest, min(1.0, p * (len(tested) - rank)))
        corrected[place] = largest
    return corrected


def _judged(
    one: Difference, p: float | None, within: tuple[float, bool] | None, undecided: str
) -> Difference:
    bound, verdict = None, OPEN
    if within is not None:
        number, is_share = within
        bound = abs(one.a) * number / 100 if is_share else number
        apart = one.difference
        if not undecided and apart.is_known:
            if -bound <= apart.low and apart.high <= bound:
                verdict = SAME
            elif apart.low > bound or apart.high < -bound:
                verdict = APART
    fields = {**vars(one), "p_corrected": p, "bound": bound, "verdict": verdict}
    return Difference(**fields)


def report_text(comparison: VariantComparison) -> str:
    """A table in Markdown, and what could not be compared."""
    a, b = comparison.a, comparison.b
    bounded = any(one.bound is not None for one in comparison.differences)
    lines = [
        f"A: {a.name}, {_trials(a)}",
        f"B: {b.name}, {_trials(b)}",
        "",
        "| metric | A | B | B less A [95 % interval] | Cliff's delta | p, corrected |"
        + " within |" * bounded,
        "|---" * (6 + bounded) + "|",
    ]
    lines += [_row(one, bounded) for one in comparison.differences]
    if a.sampling != b.sampling:
        lines += ["", f"A is sampled {a.sampling}, B {b.sampling}."]
    if comparison.left_out:
        lines += ["", *(f"not compared: {n}: {why}" for n, why in comparison.left_out.items())]
    if comparison.undecided:
        lines += ["", f"undecided: {comparison.undecided}"]
    elif any(one.p is not None for one in comparison.differences):
        tests = sum(one.p is not None for one in comparison.differences)
        lines += ["", f"Mann-Whitney tests, corrected by Holm for {tests} metrics."]
    return "\n".join(lines)


def _trials(side: Side) -> str:
    trials = f"{side.trials} trials" if side.trials > 1 else "one trial"
    return f"{trials} of {max(side.end_s):,.0f} s"


def _row(one: Difference, bounded: bool) -> str:
    name = f"{one.metric} ({one.unit})" if one.unit not in ("", one.metric) else one.metric
    interval = one.difference
    apart = f"{interval.value:.4g}"
    if interval.is_known:
        apart += f" [{interval.low:.4g}, {interval.high:.4g}]"
    delta = "" if one.delta is None else f"{one.delta:.2f}"
    p = "" if one.p_corrected is None else f"{one.p_corrected:.2g}"
    cells = [name, f"{one.a:.4g}", f"{one.b:.4g}", apart, delta, p]
    if bounded:
        cells.append("" if one.bound is None else f"{one.bound:.4g}: {one.verdict}")
    return f"| {' | '.join(cells)} |"
