"""A hunt put together: the experiment, its programs, and the search in them."""

from dataclasses import dataclass
from pathlib import Path

from kilotwin import _emulator
from kilotwin.errors import InputError, KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.hunt import Hunt
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.sanitizer import check_sanitized
from kilotwin.programs.translate.constants import constants_in
from kilotwin.programs.translate.seam import own_extents
from kilotwin.runs.folder import slug
from kilotwin.session.estimate import cpu_s_of
from kilotwin.studies.hunt.folder import opened
from kilotwin.studies.hunt.moves import Ground
from kilotwin.studies.hunt.search import Search, generation_of, quiet_of
from kilotwin.studies.hunt.shrink import Whole
from kilotwin.studies.hunt.trial import SETTINGS, Build, Laboratory, Tier
from kilotwin.studies.hunt.variation import Base, Variation


@dataclass(frozen=True)
class Quarry:
    """The hunted: the tables with what is looked for in each trial, and the experiment."""

    base: Base
    experiment: Experiment
    origin: ExperimentText


def quarry(file: Path, settings: list[Setting]) -> Quarry:
    """InputError for what cannot be hunted."""
    origin = ExperimentText.read(file, settings)
    given = Experiment.of(origin)
    if given.environment is not None:
        where = given.origin.where(("environment",))
        raise InputError(f"{where}: a program outside has its own chance; hunt without it")
    hunt = given.keys.hunt or Hunt()
    kept = [
        (row, expect)
        for row, expect in zip(origin.raw.get("expect", []), given.keys.expect, strict=True)
        if expect.share is None
    ]
    rows = [{key: it for key, it in row.items() if key != "runs"} for row, _ in kept]
    if hunt.mistakes and all(expect.no_mistake is None for _, expect in kept):
        rows.append({"no_mistake": True})
    if not rows:
        rows.append({"no_crash": True})
    tables = {**origin.raw, "expect": rows}
    text = ExperimentText(origin.source, origin.folder, tables, "", [])
    experiment = Experiment.of(text)
    counts = tuple(group.count for group in experiment.groups)
    return Quarry(Base(tables, tuple(experiment.uids), counts), experiment, text)


def prepared(
    file: Path,
    settings: list[Setting],
    folder: Path | None,
    seed: int,
    *,
    timeout_s: float,
    note: Notify,
) -> Search:
    """Builds the programs and opens the folder, runs/hunt-NAME if None is given."""
    hunted = quarry(file, settings)
    experiment = hunted.experiment
    keys = experiment.keys
    folder = folder or Path("runs") / f"hunt-{slug(keys.name)}"
    hunt = keys.hunt or Hunt()
    state = opened(folder, _identity(hunted), seed)
    builds = [Build.of(experiment, "plain", note)]
    if hunt.undefined:
        builds += _on_tier(hunted, "sanitized", note)
    if keys.swarm.profile == "kilobot" and _some_native(experiment):
        builds += _on_tier(hunted, "translated", note)
    moves = Ground.of(experiment, _constants(experiment)).moves()
    on_s = keys.swarm.on_s or 0.0
    whole = Whole(experiment.size, keys.duration_s, (), quiet_of(experiment), on_s, hunt.on_s)
    laboratory = Laboratory(hunted.base, hunted.origin, builds, timeout_s)
    generation = generation_of(cpu_s_of(experiment))
    return Search(laboratory, moves, state, folder, whole, generation, note)


def _constants(experiment: Experiment) -> set[int]:
    """Those of the machine code of programs that are built here as for the robot."""
    found: set[int] = set()
    for group in experiment.groups:
        if group.tier == "translated":
            image = build_image(group.program)
            flash, _ = _emulator.flash_image(str(image.elf))
            found |= constants_in(flash, own_extents(image.elf, image.objects("program")))
    return found


def _identity(hunted: Quarry) -> str:
    """Equal for hunts of the same in the same way."""
    keys = hunted.experiment.keys
    expects = "\n".join(expect.text() for expect in keys.expect)
    return f"{hunted.experiment.identity()} {keys.hunt} {expects}"


def _some_native(experiment: Experiment) -> bool:
    return any(group.tier == "native" for group in experiment.groups)


def _on_tier(hunted: Quarry, tier: Tier, note: Notify) -> list[Build]:
    """None, with a line, where programs cannot be run so."""
    origin, tables = hunted.origin, hunted.base.varied(Variation())
    text = ExperimentText(origin.source, origin.folder, tables, "", SETTINGS[tier])
    try:
        experiment = Experiment.of(text)
        if tier == "sanitized":
            check_sanitized(experiment)
        elif _some_native(experiment):
            note('programs with cpu = "native" of their own are not run as on the robot')
            return []
        return [Build.of(experiment, tier, note)]
    except KilotwinError as error:
        why = {"sanitized": "undefined behaviour is not looked for"}
        note(f"{why.get(tier, 'robots are not run by their machine code too')}: {error}")
        return []
