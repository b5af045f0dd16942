"""Whether a run's samples are far enough apart to hide what its programs do."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin.runs.reader import Run

DECISION_S = "decision_s"
"""Key of a summary: seconds from one change of LED or motors to the next, of the program whose
robots change them most often; None if no program does."""

_STEPS_S = (60.0, 30.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.25)
"""Values of record.sample_s to recommend."""


def decision_s(
    decisions: NDArray[np.uint32], counts: Sequence[int], simulated_s: float
) -> float | None:
    """DECISION_S of so many `decisions` per robot, in groups of `counts` robots."""
    ends = np.cumsum(counts)
    groups = [group for group in np.split(decisions, ends[:-1]) if len(group)]
    most = max(map(_median, groups), default=0.0)
    return round(simulated_s / most, 3) if most > 0 else None


def _median(counts: NDArray[np.uint32]) -> float:
    """As numpy's, which takes longer than short trials can wait."""
    ordered = np.sort(counts)
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return (int(low) + int(high)) / 2


def coarseness(run: "Run", frame_s: float = 0.0) -> str:
    """A line if programs change LED or motors more often than they were sampled; "" if not, or if
    what is shown, each `frame_s` of the run, hides more."""
    summary = run.manifest.get("summary") or {}
    every_s = summary.get(DECISION_S)
    sample_s = seconds(run.experiment.sample_ticks * run.experiment.record.robots_every)
    if every_s is None or max(every_s, frame_s) >= sample_s:
        return ""
    better_s = next((step for step in _STEPS_S if step <= every_s), _STEPS_S[-1])
    advice = f"; --set record.sample_s={better_s:g} shows more" if better_s < sample_s else ""
    return (
        f"colours and places are known each {sample_s:.2g} s only, and robots change LED or motors "
        f"each {every_s:.2g} s{advice}"
    )
