"""Checks of `[[expect]]` tables: that each says one thing, about what there is, at a sample."""

import math
from collections.abc import Iterator

from kilotwin.experiment.checks.grid import Problem
from kilotwin.experiment.expect_names import Names
from kilotwin.experiment.expression import Expression
from kilotwin.experiment.schema.expect import KINDS, Expect
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.units import TICK_S, seconds

_TIMES = ("at_s", "within_s", "throughout_s")
# A sample is late by a world step at most, of 4 ticks; and as much as a tick is no divisor of it.
_OFF_S = 5 * TICK_S
_OFF_SHARE = 0.02


def expect_problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Mistakes in what is expected of an experiment whose other keys are right."""
    names = Names(experiment)
    for index, expect in enumerate(experiment.expect):
        path: KeyPath = ("expect", index)
        yield from _kind(path, expect)
        if expect.condition is not None:
            wanted = Expression.of(expect.condition).names
            if what := names.problem_of(wanted):
                yield Problem(what, ((*path, expect.kind),))
        yield from _times(path, expect, experiment)


def _kind(path: KeyPath, expect: Expect) -> Iterator[Problem]:
    given = [kind for kind in KINDS if getattr(expect, kind) is not None]
    if len(given) != 1:
        has = f"has {' and '.join(given)}" if given else "says not what is expected"
        which = "one of them" if given else f"one of {', '.join(KINDS)}"
        yield Problem(f"this [[expect]] {has}; give it {which}", ((*path, *given[1:2]),))
        return
    own = {
        "share": ("at_least", "at_most"),
        "condition": (*_TIMES, "after_s"),
    }
    for key in own["share"]:
        if expect.share is None and getattr(expect, key) is not None:
            what = f"'{given[0]}' has no '{key}'; remove it, or write share in place of that"
            yield Problem(what, ((*path, key),))
    for key in own["condition"]:
        if expect.condition is None and getattr(expect, key) is not None:
            what = f"'{given[0]}' is about the whole run; remove '{key}'"
            yield Problem(what, ((*path, key),))
    if expect.share is not None and expect.at_least is None and expect.at_most is None:
        what = "'share' needs at_least, at_most or both; add at_least = 0.8"
        yield Problem(what, ((*path, "share"),))
    if None not in (expect.at_least, expect.at_most) and expect.at_least > expect.at_most:  # type: ignore[operator]
        yield Problem("at_least is above at_most; change one of them", ((*path, "at_least"),))


def _times(path: KeyPath, expect: Expect, experiment: ExperimentSchema) -> Iterator[Problem]:
    given = [key for key in _TIMES if getattr(expect, key) is not None]
    if len(given) > 1:
        what = (
            f"this [[expect]] has {' and '.join(given)}; give it one of them, or none: at the end"
        )
        yield Problem(what, ((*path, given[1]),))
        return
    if expect.after_s is not None and given not in (["within_s"], ["throughout_s"]):
        what = "'after_s' goes with within_s or throughout_s; add one of them, or write at_s"
        yield Problem(what, ((*path, "after_s"),))
        return
    if not given:
        return
    key, length_s = given[0], float(getattr(expect, given[0]))
    begin_s = expect.after_s or 0.0
    end_s = length_s if key == "at_s" else begin_s + length_s
    if end_s > experiment.duration_s + TICK_S:
        what = (
            f"this [[expect]] looks at {end_s:g} s, and the run ends at "
            f"{experiment.duration_s:g} s; make it earlier, or the run longer"
        )
        yield Problem(what, ((*path, key), ("duration_s",)), unless_set=("duration_s",))
        return
    yield from _sampled((*path, key), key, begin_s, end_s, experiment)


def _sampled(
    path: KeyPath, key: str, begin_s: float, end_s: float, experiment: ExperimentSchema
) -> Iterator[Problem]:
    """A problem if there is no sample where it wants to look."""
    every_s = seconds(experiment.sample_ticks)
    off_s = max(_OFF_S, _OFF_SHARE * end_s)
    if end_s >= experiment.duration_s - off_s:
        return  # the end is always sampled
    first_s = math.ceil((begin_s if key != "at_s" else end_s) / every_s - 1e-9) * every_s
    before_s = first_s - every_s
    if key != "at_s":
        if first_s <= end_s + off_s:
            return
        what = f"no sample lies between {begin_s:g} and {end_s:g} s, one comes each {every_s:.4g} s"
    else:
        if min(first_s - end_s, end_s - before_s) <= off_s:
            return
        what = f"{end_s:g} s lies between the samples at {before_s:.4g} and {first_s:.4g} s"
    better_s = end_s - begin_s if key != "at_s" else end_s
    what = f"{what}; set record.sample_s = {better_s:g}, or less"
    yield Problem(what, (path, ("record", "sample_s")))
