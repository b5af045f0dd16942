"""A sweep as text: its trials before, what came of them after."""

import json
from typing import Any

from kilotwin.studies.pool.places import Place
from kilotwin.studies.sweep.plan import shown
from kilotwin.studies.sweep.runner import Sweep
from kilotwin.studies.sweep.slurm import Slurm


def listing_text(sweep: Sweep, place: Place, as_json: bool) -> str:
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
        what = "took too long" if failed["timed_out"] else "failed twice"
        lines.append(f"{what}: {failed['trial']}: {failed['failed']}{where}")
    if summary["damaged"]:
        lines.append(
            f"damaged on the disk since: {summary['damaged']} of the trials; the same command runs "
            "them again"
        )
    if spoiled := summary["metrics_failed"]:
        lines.append(
            f"metrics failed in {len(spoiled)} of the trials, which lack them; the first: "
            f"{spoiled[0]}"
        )
    if summary["status"] == "interrupted":
        lines.append("interrupted; the same command goes on from here")
    return "\n".join(lines)
