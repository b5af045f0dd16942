"""What the parent of a run hands to its worker process."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.experiment import Experiment


@dataclass(frozen=True)
class Job:
    """One run; `guests` are the files of the built programs, one per group of the experiment."""

    experiment: Experiment
    guests: list[str]
    folder: Path
    manifest: dict[str, Any]
    black_box: str | None
