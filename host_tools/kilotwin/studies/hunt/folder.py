"""The folder of a hunt: what was tried and found, so that it goes on where it was stopped, and a
scenario for each thing that breaks."""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError
from kilotwin.files.drafts import draft_of
from kilotwin.studies.hunt.corpus import Corpus, Feature
from kilotwin.studies.hunt.variation import Variation

STATE = "hunt.json"
FOUND = "found"
_VERSION = 1


@dataclass(frozen=True)
class Found:
    """Something that breaks: the property and the cause (trial.Fault), the variation that broke it
    first, in which trial, and what was left of it; `file`: its scenario."""

    expected: str
    file: str
    line: int
    said: str
    tier: str
    trial: int
    variation: Variation
    shrunk: Variation
    scenario: str
    robots: int
    duration_s: float
    tried: int

    @property
    def key(self) -> tuple[str, str, int]:
        """As that of its fault."""
        return self.expected, self.file, self.line

    def as_dict(self) -> dict[str, Any]:
        """For files and --json."""
        told = {"variation": self.variation.as_dict(), "shrunk": self.shrunk.as_dict()}
        return {**vars(self), **told}

    @staticmethod
    def of(told: dict[str, Any]) -> "Found":
        """The opposite."""
        variation, shrunk = (Variation.of(told[key]) for key in ("variation", "shrunk"))
        return Found(**{**told, "variation": variation, "shrunk": shrunk})


@dataclass
class State:
    """All that a hunt knows. `moves`: how often each kind of change was part of a trial."""

    identity: str
    seed: int
    generation: int = 0
    trials: int = 0
    refused: int = 0
    simulated_s: float = 0.0
    corpus: Corpus = field(default_factory=Corpus)
    found: list[Found] = field(default_factory=list)
    moves: dict[str, int] = field(default_factory=dict)

    def write(self, folder: Path) -> None:
        """Whole or not at all."""
        folder.mkdir(parents=True, exist_ok=True)
        told = {
            **{key: it for key, it in vars(self).items() if key not in ("corpus", "found")},
            "version": _VERSION,
            "corpus": [one.as_dict() for one in self.corpus.variations],
            "reached": sorted((list(one) for one in self.corpus.reached), key=json.dumps),
            "found": [one.as_dict() for one in self.found],
        }
        with draft_of(folder / STATE) as draft:
            draft.write_text(json.dumps(told))


def opened(folder: Path, identity: str, seed: int) -> State:
    """The state that is in the folder, or that of a new hunt. InputError if the folder is of
    another experiment or seed, or holds something else."""
    file = folder / STATE
    if not file.exists():
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: holds something else; name another folder with --out")
        return State(identity, seed)
    try:
        told = json.loads(file.read_text())
        version, of, its_seed = told.pop("version"), told["identity"], told["seed"]
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(
            f"{file}: damaged; remove the folder, or name another with --out"
        ) from None
    if version != _VERSION or of != identity:
        raise InputError(
            f"{folder}: a hunt of another experiment, or of this one before it was changed; name "
            "another folder with --out, or remove it"
        )
    if its_seed != seed:
        raise InputError(f"{folder}: a hunt with --seed {its_seed}; give that, or another --out")
    reached: set[Feature] = {tuple(one) for one in told.pop("reached")}
    corpus = Corpus([Variation.of(one) for one in told.pop("corpus")], reached)
    found = [Found.of(one) for one in told.pop("found")]
    return State(**told, corpus=corpus, found=found)


_PATHS = {
    "program",
    "hex",
    "include",
    "lab",
    "wire",
    "configuration",
    "kilobot_ids",
    "image",
    "function",
}


def with_paths(tables: Any, resolved: Any, below: Path) -> Any:
    """The tables with paths as the resolved tables have them, so that an experiment in another
    folder, `below`, finds the same files."""
    if isinstance(tables, dict) and isinstance(resolved, dict):
        return {
            key: _moved(resolved[key], below)
            if key in _PATHS and isinstance(resolved.get(key), str | list)
            else with_paths(value, resolved.get(key), below)
            for key, value in tables.items()
        }
    if isinstance(tables, list) and isinstance(resolved, list) and len(tables) == len(resolved):
        return [with_paths(one, other, below) for one, other in zip(tables, resolved, strict=True)]
    return tables


def _moved(written: Any, below: Path) -> Any:
    if isinstance(written, list):
        return [_moved(one, below) for one in written]
    if not Path(written).is_absolute():
        return written
    return os.path.relpath(written, below.resolve())
