"""Checks of `[metric.NAME]` tables: that each says one thing, with the keys that go with it."""

from collections.abc import Iterator

from kilotwin.experiment.checks.arena import shape_problems
from kilotwin.experiment.checks.grid import Problem
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.metric import BUILTINS, CHOICE, Metric
from kilotwin.experiment.states import States
from kilotwin.experiment.toml_lines import KeyPath

_KINDS = ("builtin", "function", "variable")
_OF_VARIABLES = ("of", "per_robot")
_OWN_KEYS = (
    *CHOICE,
    *("within_m", "cell_m", "object", "goal_m", "metric", "at_least", "at_most"),
)


def metric_problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Mistakes in the metrics of an experiment whose other keys are right."""
    for name, metric in experiment.metric.items():
        path: KeyPath = ("metric", name)
        if not name.isidentifier() or not name.isascii():
            what = f"'{name}' is to be a column's name; use letters, digits and _"
            yield Problem(what, (path,))
        yield from _kind(path, metric)
        yield from _names(path, metric, experiment)
        yield from _region(path, metric)


def _kind(path: KeyPath, metric: Metric) -> Iterator[Problem]:
    given = [kind for kind in _KINDS if getattr(metric, kind) is not None]
    if len(given) != 1:
        one = "one of them" if given else "builtin, function or variable"
        has = f"has {' and '.join(given)}" if given else "says not how it is measured"
        yield Problem(f"[metric.{path[1]}] {has}; give it {one}", ((*path, *given[1:2]),))
        return
    if metric.builtin is None:
        allowed: tuple[str, ...] = _OF_VARIABLES if metric.variable else ()
        needed: tuple[str, ...] = ()
        whose = f"a {given[0]}"
    else:
        builtin = BUILTINS[metric.builtin]
        needed, allowed = builtin.needs, (*builtin.needs, *builtin.may_have)
        whose = f"'{metric.builtin}'"
    for key in (*_OWN_KEYS, *_OF_VARIABLES):
        if key not in allowed and getattr(metric, key) != Metric.model_fields[key].default:
            takes = f"it takes {', '.join(allowed)}" if allowed else "remove it"
            yield Problem(f"{whose} has no '{key}'; {takes}", ((*path, key),))
    for key in needed:
        if getattr(metric, key) is None:
            yield Problem(f"{whose} needs '{key}'; add {key} = ...", (path,))
    if metric.builtin == "first_time" and (metric.at_least is None) == (metric.at_most is None):
        yield Problem("'first_time' needs one of at_least and at_most", (path,))


def _names(path: KeyPath, metric: Metric, experiment: ExperimentSchema) -> Iterator[Problem]:
    states = States.of(experiment)
    objects = len(experiment.object)
    others = [name for name, other in experiment.metric.items() if other.builtin != "first_time"]
    choices = {
        "state": states.names[: states.known] if states.known else states.names,
        "site": [site.name for site in experiment.site],
        "metric": others,
    }
    for key, known in choices.items():
        name = getattr(metric, key)
        if name is not None and name not in known:
            what = f"there is no {key} '{name}'; the {key}s are: {', '.join(known) or 'none'}"
            yield Problem(what, ((*path, key),))
    if metric.builtin == "object_distance" and (metric.object or 0) >= objects:
        there = f"the objects are 0 to {objects - 1}" if objects else "there is no [[object]]"
        yield Problem(f"there is no object {metric.object or 0}; {there}", ((*path, "object"),))


def _region(path: KeyPath, metric: Metric) -> Iterator[Problem]:
    region = metric.region
    if region is None:
        return
    place = (*path, "region")
    yield from shape_problems(place, region)
    if region.centre_m is None and region.shape != "polygon":
        yield Problem("the region lacks 'centre_m'; add centre_m = [0.0, 0.0]", (place,))
