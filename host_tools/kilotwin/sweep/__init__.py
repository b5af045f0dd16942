"""Many runs of one experiment, varied: the plan, where it runs, and the data set it leaves."""

import json
import os
from typing import Any

from kilotwin.sweep.executors import Dask, Place, Processes, Slurm
from kilotwin.sweep.plan import Plan, read_plan, shown
from kilotwin.sweep.runner import Sweep, default_folder

__all__ = ["Sweep", "choose_place", "default_folder", "listing", "read_plan", "summary_text"]


def choose_place(plan: Plan, processes: int | None, dask: str | None, slurm: bool) -> Place:
    """Where the trials run; processes of this machine, one per core, if nothing else is asked."""
    if dask:
        return Dask(dask)
    if slurm:
        jobs = Slurm(plan.keys.slurm, plan.origin.where(("slurm",)))
        jobs.job_script()  # what is wrong with the options is told before anything is written
        return jobs
    return Processes(processes or len(os.sched_getaffinity(0)))


def listing(sweep: Sweep, place: Place, as_json: bool) -> str:
    """A line per trial and the estimate; for Slurm the job script too."""
    missing = {key for _, key in sweep.missing()}
    trials = list(zip(sweep.plan.trials, sweep.keys, strict=True))
    if as_json:
        rows = [
            {
                "trial": trial.index,
                "base": trial.base,
                "seed": trial.seed,
                **trial.settings,
                "finished": key not in missing,
            }
            for trial, key in trials
        ]
        return json.dumps(rows)
    lines = [f"{'      ' if key in missing else 'there '}{shown(trial)}" for trial, key in trials]
    lines.append(sweep.estimate().text(place))
    if isinstance(place, Slurm):
        lines += ["", place.job_script()]
    return "\n".join(lines)


def summary_text(summary: dict[str, Any]) -> str:
    """The end of a sweep in a few lines."""
    lines = [
        f"{summary['sweep']}: {summary['finished']} of {summary['trials']} trials in "
        f"{summary['folder']}"
    ]
    for failed in summary["failed"]:
        where = f" ({failed['run_folder']})" if failed["run_folder"] else ""
        lines.append(f"failed twice: {failed['trial']}: {failed['failed']}{where}")
    if summary["damaged"]:
        lines.append(
            f"damaged on the disk since: {summary['damaged']} of the trials; the same command runs "
            "them again"
        )
    if summary["status"] == "interrupted":
        lines.append("interrupted; the same command goes on from here")
    return "\n".join(lines)
