"""How much of what robots 5 cm apart send is received, by distance, against a table of real ones.

The run is that of experiments/calibration/spacing-25.toml, whose robots print what they heard.
"""

import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError
from kilotwin.runs.folder import PRINTS
from kilotwin.runs.reader import Run

# Counted on a table of 25 Kilobots for 150 s, at a pitch of 5 cm: cm, and the share received. On
# that table the range was 20 to 21 cm.
_REAL = {
    **{5.0: 0.971, 7.1: 0.965, 10.0: 0.960, 11.2: 0.958},
    **{14.1: 0.954, 15.8: 0.946, 18.0: 0.932, 20.0: 0.511},
}
# At the rim of the range the share is that of the pairs whose range is longer: not compared.
_RIM_CM = 20.0
# From seed to seed, which draws other ranges of the robots, it is so much.
_WITHIN = 0.05
_ROBOTS = 25


@dataclass(frozen=True)
class SpacingComparison:
    """Shares received by cm."""

    shares: dict[float, float]

    @property
    def worst(self) -> float:
        """The largest difference of a share from the real one below the rim; above 0: more here."""
        below = [cm for cm in _REAL if cm < _RIM_CM]
        return max((self.shares[cm] - _REAL[cm] for cm in below), key=abs)

    @property
    def within_bounds(self) -> bool:
        """Whether it is small."""
        return abs(self.worst) <= _WITHIN

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        return {
            "within_bounds": self.within_bounds,
            "worst": self.worst,
            "rows": [
                {"cm": cm, "emulated": self.shares[cm], "real": real} for cm, real in _REAL.items()
            ],
        }


def compare(folder: Path) -> SpacingComparison:
    """Compares a run folder; InputError if its robots did not print what they heard."""
    run = Run.open(folder)
    first = run.robots("x_m", "y_m").to_pandas()
    places = first[first.tick == first.tick.min()].set_index("robot")
    sent, heard = _counts(folder)
    frames: dict[float, list[float]] = defaultdict(list)
    for listener, counts in heard.items():
        for sender, count in counts.items():
            if sender == listener:
                continue
            one, other = places.loc[listener - 1], places.loc[sender - 1]
            way_cm = 100 * float(((one.x_m - other.x_m) ** 2 + (one.y_m - other.y_m) ** 2) ** 0.5)
            near = min(_REAL, key=lambda cm, way_cm=way_cm: abs(cm - way_cm))  # type: ignore[misc]
            if abs(near - way_cm) < 0.1:
                frames[near].append(count / sent[sender])
    return SpacingComparison({cm: sum(of) / len(of) for cm, of in sorted(frames.items())})


def _counts(folder: Path) -> tuple[dict[int, int], dict[int, dict[int, int]]]:
    """Frames sent by uid, and heard by uid, of each uid."""
    sent, heard = {}, {}
    for uid in range(1, _ROBOTS + 1):
        file = folder / PRINTS / f"robot-{uid}.log"
        text = file.read_text() if file.exists() else ""
        told = re.search(r"\] sent (\d+)$", text, re.MULTILINE)
        rows = re.findall(r"\] (\d+) (\d+)$", text, re.MULTILINE)
        if told is None or len(rows) != _ROBOTS:
            what = f"robot {uid} has not printed what it heard"
            raise InputError(f"{folder}: {what}; run experiments/calibration/spacing-25.toml")
        sent[uid] = int(told[1])
        heard[uid] = {int(number): int(count) for number, count in rows}
    return sent, heard


def report_text(found: SpacingComparison) -> str:
    """For people."""
    rows = [
        f"  {cm:5.1f} cm  {found.shares[cm]:.3f}  real {real:.3f}" for cm, real in _REAL.items()
    ]
    return "\n".join(
        [
            "share received:",
            *rows,
            f"off by {found.worst:+.3f} at worst below {_RIM_CM:g} cm; {_WITHIN} is allowed",
        ]
    )
