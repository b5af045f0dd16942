"""Checks of `[[step]]` tables: that each does one thing, to what there is, before the end."""

from collections.abc import Iterator, Sequence

from kilotwin.experiment.checks.arena import pose_problems
from kilotwin.experiment.checks.grid import Problem, within_the_run
from kilotwin.experiment.checks.robots import uids_text
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.toml_lines import KeyPath

_PAIRS = (("lamp", "peak"), ("robot", "pose"))
_ACTS = "give it ambient, lamp and peak, or robot and pose"


def step_problems(experiment: ExperimentSchema, robots: Sequence[int]) -> Iterator[Problem]:
    """Mistakes in the steps of an experiment whose other keys are right; `robots`: their uids."""
    for index, step in enumerate(experiment.step):
        path: KeyPath = ("step", index)
        given = [key for key in ("ambient", "lamp", "robot") if getattr(step, key) is not None]
        lacking = [
            (has, lacks)
            for pair in _PAIRS
            for has, lacks in (pair, pair[::-1])
            if getattr(step, has) is not None and getattr(step, lacks) is None
        ]
        if lacking:
            has, lacks = lacking[0]
            yield Problem(f"'{has}' and '{lacks}' go together; add {lacks} = ...", (path,))
        elif len(given) != 1:
            has = "does two things" if given else "does nothing"
            yield Problem(f"this [[step]] {has}; {_ACTS}", (path,))
        elif step.lamp is not None:
            yield from _lamp((*path, "lamp"), step.lamp, len(experiment.light.source))
        elif step.robot is not None and step.pose is not None:
            if step.robot not in robots:
                what = f"there is no robot {step.robot}; {uids_text(robots)}"
                yield Problem(what, ((*path, "robot"),))
            radius = PROFILES[experiment.swarm.profile].radius_m
            x, y, _ = step.pose
            yield from pose_problems((*path, "pose"), x, y, radius, experiment)
        yield from within_the_run((*path, "at_s"), step.at_s, experiment)


def _lamp(path: KeyPath, index: int, number: int) -> Iterator[Problem]:
    if index >= number:
        there = f"the lamps are 0 to {number - 1}" if number else "there is no [[light.source]]"
        yield Problem(f"there is no lamp {index}; {there}", (path,))
