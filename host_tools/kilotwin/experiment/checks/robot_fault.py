"""Checks of `[[faults.robot]]` tables: whom they mean, when, and what a motor is told."""

from collections.abc import Iterator, Sequence

from kilotwin.experiment.checks.grid import Problem, within_the_run
from kilotwin.experiment.checks.robots import uids_text
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.toml_lines import KeyPath


def robot_fault_problems(experiment: ExperimentSchema, robots: Sequence[int]) -> Iterator[Problem]:
    """Mistakes in them, where each key by itself is right; `robots`: all uids."""
    for index, fault in enumerate(experiment.faults.robot):
        path: KeyPath = ("faults", "robot", index)
        if fault.robots is not None and fault.share is not None:
            what = "'robots' names some, and 'share' draws some; keep one of them"
            yield Problem(what, ((*path, "share"), (*path, "robots")))
        for uid in fault.robots or ():
            if uid not in robots:
                what = f"there is no robot {uid}; {uids_text(robots)}"
                yield Problem(what, ((*path, "robots"),))
        yield from within_the_run((*path, "at_s"), fault.at_s, experiment)
        if fault.until_s is not None and fault.until_s < fault.at_s:
            what = f"{fault.until_s:g} s is before {fault.at_s:g} s; exchange them"
            yield Problem(what, ((*path, "until_s"),))
        if fault.kind not in ("deaf", "mute") and fault.for_s is not None:
            what = "only deaf and mute robots recover; remove 'for_s', or take one of these kinds"
            yield Problem(what, ((*path, "for_s"), (*path, "kind")))
        motors = [key for key in ("left", "right") if getattr(fault, key) is not None]
        if fault.kind == "drift" and not motors:
            what = "a robot that drifts needs left = ..., right = ... or both: 0.8 is a fifth less"
            yield Problem(what, (path,))
        elif fault.kind != "drift" and motors:
            what = f"'{motors[0]}' goes with kind = \"drift\"; remove it"
            yield Problem(what, ((*path, motors[0]),))
        elif fault.kind == "drift" and experiment.swarm.profile != "kilobot":
            what = (
                "a foot-bot's motion is fixed and ideal, so it does not drift; take "
                'kind = "stuck", or profile = "kilobot"'
            )
            yield Problem(what, ((*path, "kind"), ("swarm", "profile")))
