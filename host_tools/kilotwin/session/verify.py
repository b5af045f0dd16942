"""Repeats a recorded run and compares: the same result, or the first sample that differs.

Acts from its page are done again, each at its tick.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.runs.folder import EXPERIMENT, FINISHED, MANIFEST
from kilotwin.runs.reader import Run
from kilotwin.session.acts import acts_of
from kilotwin.session.display import Display
from kilotwin.session.run import run

_BEFORE_THE_HASH = "has no result_hash of every sample; Kilotwin 0.2 and older made none"


@dataclass(frozen=True)
class Verification:
    """Outcome of a repetition. `difference`: a sentence, None if there is none.

    `changed`: what was not the same from the start: Kilotwin, the engine, a program.
    `compared`: rows of robots.arrows and objects.arrows. `hashes`: before and now; None of a run
    that was not finished, whose samples alone are compared.
    """

    folder: Path
    difference: str | None
    changed: list[str]
    compared: int
    hashes: tuple[str, str] | None

    def as_dict(self) -> dict[str, Any]:
        """The --json object."""
        before, now = self.hashes or (None, None)
        return {
            "run": str(self.folder),
            "same": self.difference is None,
            "difference": self.difference,
            "changed": self.changed,
            "rows_compared": self.compared,
            "result_hash": before,
            "result_hash_now": now,
        }


def verify(
    recorded: Path, out: Path | None, command_line: list[str], display: Display
) -> Verification:
    """Repeats the run of a run folder, or of its manifest, in `out` or a folder that is deleted.

    InputError for what is no emulated run. Takes as long as the run did.
    """
    before = Run.open(recorded.parent if recorded.name == MANIFEST else recorded)
    rows, things = before.robots(), before.objects() if _has_objects(before) else None
    experiment = experiment_of(before, rows)
    with tempfile.TemporaryDirectory(prefix="kilotwin-verify-") as scratch:
        again, acts = out or Path(scratch) / "again", acts_of(before.events())
        outcome = run(experiment, again, command_line, display, acts=acts)
        now = Run.open(Path(outcome.summary["run_folder"]))
        difference = _first_difference(rows, now.robots(), "robot")
        if difference is None and things is not None:
            difference = _first_difference(things, now.objects(), "object")
        changed = _changed(before.manifest, now.manifest)
    hashes = None
    if before.manifest["status"] == FINISHED:
        hashes = (before.manifest["summary"]["result_hash"], outcome.summary["result_hash"])
        if difference is None and hashes[0] != hashes[1]:
            difference = _beside_samples(before.manifest["summary"], outcome.summary)
    compared = rows.num_rows + (0 if things is None else things.num_rows)
    return Verification(before.folder, difference, changed, compared, hashes)


def _has_objects(run: Run) -> bool:
    return bool(run.experiment.object)


def check_repeatable(before: Run) -> None:
    """InputError of a run that no emulator repeats."""
    manifest, folder = before.manifest, before.folder
    if "engine" not in manifest:
        raise InputError(f"{folder}: a recording of real robots or a table; no emulator repeats it")
    if {"--serve", "serve"} & set(manifest.get("command_line", [])):
        raise InputError(f"{folder}: hosts outside had a hand in it; no repeating that")


def check_translated(experiment: Experiment, robot: int, cannot: str, again: str) -> None:
    """InputError if the robot with that index does not run translated. `cannot`: what is therefore
    not possible, behind "where"; `again`: what to type, to which the key is added."""
    group = experiment.group_of(robot)
    if group.tier == "translated":
        return
    uid = experiment.uid_of(robot)
    where = "natively" if group.tier == "native" else "on a simulated ATmega328P"
    if not group.program.sources:
        what = "of a .hex neither lines nor variables are known; name its program's source"
        raise InputError(f"robot {uid} runs {where}, where {cannot}; {what}")
    index = experiment.group_index(robot)
    key = f"robots.{index}.cpu" if experiment.keys.robots else "swarm.cpu"
    raise InputError(
        f"robot {uid} runs {where}, where {cannot}; let it run by its machine code, from the same "
        f"source: {again} --set {key}=translated"
    )


def experiment_of(before: Run, rows: pa.Table) -> Experiment:
    """The experiment of a run; of one that did not end, as far as it was recorded."""
    check_repeatable(before)
    manifest, folder = before.manifest, before.folder
    if not rows.num_rows and not before.sites().num_rows:
        raise InputError(f"{folder}: holds no samples; there is nothing to compare")
    if manifest["status"] == FINISHED:
        if "final_hash" not in manifest.get("summary", {}):
            raise InputError(f"{folder}/{MANIFEST}: {_BEFORE_THE_HASH}; repeat it by `run`")
        return Experiment.load(folder / EXPERIMENT, [])
    ends = [table["time_s"][-1].as_py() for table in (before.sites(), rows) if table.num_rows]
    recorded_s = max(*ends, before.experiment.record.sample_s)
    return Experiment.load(folder / EXPERIMENT, [Setting(("duration_s",), recorded_s, "--verify")])


def _first_difference(before: pa.Table, now: pa.Table, what: str) -> str | None:
    """The first row that differs, by time, then robot or object; None if all of `before` is in
    `now`. `what` is the column of the latter."""
    rows = min(before.num_rows, now.num_rows)
    first, named = rows, ""
    for name in before.column_names:
        one, other = _plain(before[name]).slice(0, rows), _plain(now[name]).slice(0, rows)
        unlike = np.flatnonzero(pc.not_equal(one, other).to_numpy())
        if len(unlike) and unlike[0] < first:
            first, named = int(unlike[0]), name
    if named:
        time_s, index = before["time_s"][first].as_py(), before[what][first].as_py()
        was, became = before[named][first].as_py(), now[named][first].as_py()
        return f"at {time_s:.3f} s {what} {index} has {named} {became}, and had {was}"
    if now.num_rows < before.num_rows:
        return f"at {before['time_s'][rows].as_py():.3f} s there is no sample any more"
    return None


def _plain(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """With words as text, "" for none, so that any two rows can be compared."""
    if pa.types.is_dictionary(column.type):
        return pc.fill_null(column.cast(pa.string()), "")
    return column


def _beside_samples(before: dict[str, Any], now: dict[str, Any]) -> str:
    """The difference in the summaries of two runs whose samples are equal."""
    counts = [
        f"{name} is {now['stats'].get(name)}, and was {was}"
        for name, was in before["stats"].items()
        if now["stats"].get(name) != was and name.startswith(("frames", "attempts", "received"))
    ]
    if before["events"] != now["events"]:
        counts.insert(0, f"events are {now['events']}, and were {before['events']}")
    where = "; ".join(counts[:1]) or "what robots printed, or when, is not the same"
    return f"all samples agree, but {where}"


def _changed(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    changed = [
        f"{key}: {before.get(key)} -> {now.get(key)}"
        for key in ("kilotwin", "engine", "environment")
        if before.get(key) != now.get(key)
    ]
    programs = zip(before.get("programs", []), now.get("programs", []), strict=False)
    for one, other in programs:
        # Older manifests have keys alone, which tell where a program lies too.
        content = "sources" if "sources" in one and "sources" in other else "key"
        was, became = (f"{it['compiler']} {it[content][:12]}" for it in (one, other))
        if was != became:
            changed.append(f"program {one['name']}: {was} -> {became}")
    return changed
