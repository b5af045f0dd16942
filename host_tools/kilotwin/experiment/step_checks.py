"""Checks of `[[step]]` tables: that each does one thing, to what there is, before the end."""

from collections.abc import Iterator

from kilotwin.experiment.grid_checks import Problem, within_the_run
from kilotwin.experiment.schema import ExperimentSchema
from kilotwin.experiment.toml_lines import KeyPath


def step_problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Mistakes in the steps of an experiment whose other keys are right."""
    lamps = len(experiment.light.source)
    for index, step in enumerate(experiment.step):
        path: KeyPath = ("step", index)
        if (step.lamp is None) != (step.peak is None):
            lacks = "lamp" if step.lamp is None else "peak"
            yield Problem(f"'lamp' and 'peak' go together; add {lacks} = ...", (path,))
        elif (step.ambient is None) == (step.lamp is None):
            has = "does nothing" if step.ambient is None else "does two things"
            yield Problem(f"this [[step]] {has}; give it ambient, or lamp and peak", (path,))
        elif step.lamp is not None and step.lamp >= lamps:
            there = f"the lamps are 0 to {lamps - 1}" if lamps else "there is no [[light.source]]"
            yield Problem(f"there is no lamp {step.lamp}; {there}", ((*path, "lamp"),))
        yield from within_the_run((*path, "at_s"), step.at_s, experiment)
