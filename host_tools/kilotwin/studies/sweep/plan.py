"""Which trials a sweep file means: every combination of its lists, once per seed."""
# ruff: noqa: RUF012 (pydantic copies defaults)

import itertools
import math
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, ValidationError

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.section import Section, Text, one_or_more
from kilotwin.experiment.text import ExperimentText, Setting
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.experiment.validation_errors import input_error

_RANGE_KEYS = {"from", "to", "step"}
_MOST_TRIALS = 1_000_000


def _flat(table: Any) -> Any:
    """`{"swarm": {"informed": [0.1]}}` as `{"swarm.informed": [0.1]}`; a range stays a table."""
    if not isinstance(table, dict):
        return table
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and value and not _is_range(value):
            flat.update({f"{key}.{inner}": leaf for inner, leaf in _flat(value).items()})
        else:
            flat[key] = value
    return flat


def _is_range(table: Mapping[str, Any]) -> bool:
    """Whether it is meant as one, be it with a key that is written wrongly."""
    return not _RANGE_KEYS.isdisjoint(table) and not any(
        isinstance(value, dict | list) for value in table.values()
    )


def _values(value: Any) -> Any:
    """A list as it is; a range {from, to, step} as the numbers from `from` up to `to`."""
    if isinstance(value, list):
        return value
    if not isinstance(value, dict) or set(value) != _RANGE_KEYS:
        other = sorted(set(value) - _RANGE_KEYS) if isinstance(value, dict) else []
        named = "".join(f"; a range has no '{key}'" for key in other[:1])
        raise ValueError(
            f"must be a list, or a range {{ from = 0.1, to = 0.5, step = 0.1 }}{named}"
        )
    if not all(
        isinstance(part, int | float) and not isinstance(part, bool) for part in value.values()
    ):
        raise ValueError("must have numbers as `from`, `to` and `step`")
    # Decimal: 0.1, 0.2, 0.3 as they are written, not 0.30000000000000004.
    first, last, step = (Decimal(str(value[key])) for key in ("from", "to", "step"))
    if not all(number.is_finite() for number in (first, last, step)):
        raise ValueError("must have finite numbers as `from`, `to` and `step`")
    if step <= 0 or last < first or (last - first) / step > _MOST_TRIALS:
        raise ValueError("must have a step above 0 that leads from `from` up to `to`")
    whole = all(isinstance(part, int) for part in value.values())
    numbers = (first + step * index for index in range(int((last - first) / step) + 1))
    return [int(number) if whole else float(number) for number in numbers]


def _not_empty(table: dict[str, Any]) -> dict[str, Any]:
    if not table:
        raise ValueError("must have lists, as swarm.size = [50, 100]; or remove it")
    return table


def _walltime(text: str) -> str:
    if not re.fullmatch(r"(\d+-)?\d+(:\d+){0,2}", text):
        raise ValueError('must be a time as Slurm takes it, as "24:00:00"')
    return text


def _memory(text: str) -> str:
    if not re.fullmatch(r"\d+(\.\d+)? *([kMGT]i?)?B", text):
        raise ValueError('must be a number of bytes with a unit, as "2GB"')
    return text


Values = Annotated[list[Any], Field(min_length=1), BeforeValidator(_values)]
Axes = Annotated[dict[Text, Values], BeforeValidator(_flat)]
Together = Annotated[Axes, AfterValidator(_not_empty)]
Settings = Annotated[dict[Text, Any], BeforeValidator(_flat)]
Seeds = Annotated[int, Field(ge=1, le=_MOST_TRIALS)]


class Block(Section):
    """A set of trials: every combination of its values, once per seed."""

    base: Annotated[list[Text], Field(min_length=1), BeforeValidator(one_or_more)]
    """An experiment's file or several; paths start at the sweep's file."""
    seeds: Seeds = 1
    """How many seeds: from `first_seed` on."""
    first_seed: Annotated[int, Field(ge=0, le=2**62)] = 1
    """The first of the seeds."""
    set: Settings = {}
    """Keys that have one value in all trials, as `--set` takes them."""
    vary: Axes = {}
    """Lists or ranges { from, to, step } of values; every combination is run."""
    together: list[Together] = []
    """Tables of lists of one length: their keys change together, not in every combination."""
    each: Axes = {}
    """Lists or ranges of values, one at a time: first none of them, then each by itself."""


class SlurmOptions(Section):
    """Arguments of dask-jobqueue's SLURMCluster (queue, account, ...), and the number of jobs."""

    model_config = ConfigDict(extra="allow")

    jobs: Annotated[int, Field(ge=1, le=100_000)] = 4
    """Jobs of one core."""
    walltime: Annotated[Text, AfterValidator(_walltime)] = "24:00:00"
    """How long a job may take."""
    memory: Annotated[Text, AfterValidator(_memory)] = "2GB"
    """Memory of one job."""


class SweepSchema(Section):
    """A whole sweep file: one block in it, or several as [[block]]."""

    name: Text
    """Its name in folders and figures; the file's name if left out."""
    base: Annotated[list[Text], BeforeValidator(one_or_more)] | None = None
    """As in a block; without [[block]] the file is one block itself."""
    seeds: Seeds = 1
    """As in a block, for blocks without it."""
    trial_timeout_s: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """Wall time that a trial may take; it is stopped then, and counts as failed."""
    first_seed: Annotated[int, Field(ge=0, le=2**62)] = 1
    """As in a block, for blocks without it."""
    set: Settings = {}
    """As in a block, for all blocks."""
    vary: Axes = {}
    """As in a block; not beside [[block]]."""
    together: list[Together] = []
    """As in a block; not beside [[block]]."""
    each: Axes = {}
    """As in a block; not beside [[block]]."""
    block: list[Block] = []
    """Blocks of trials, one after the other."""
    slurm: SlurmOptions = SlurmOptions()
    """For --slurm."""


# A value and where it is written, as ("vary", "swarm", "informed", 2).
_Written = tuple[Any, KeyPath]
_Part = dict[str, _Written]


@dataclass(frozen=True)
class _Combination:
    """Where one experiment of the sweep comes from: block, seeds, and a choice on each axis."""

    place: KeyPath
    seeds: range
    paths: Sequence[KeyPath]


@dataclass(frozen=True)
class Trial:
    """One run. `settings` are what varies over the sweep, by block or within one."""

    index: int
    base: str
    seed: int
    settings: Mapping[str, Any]
    experiment: Experiment


@dataclass(frozen=True)
class Plan:
    """A sweep, read and checked; `trials` in the order of the data set. `text` is its file's."""

    keys: SweepSchema
    text: str
    origin: ExperimentText
    trials: Sequence[Trial]

    @property
    def varied(self) -> list[str]:
        """The keys that the trials differ in, besides base and seed, in the order of the file."""
        return list(dict.fromkeys(key for trial in self.trials for key in trial.settings))

    def in_running_order(self) -> list[Trial]:
        """Seed by seed, so that a stopped sweep has a little of everything."""
        firsts = {id(trial): place for place, trial in enumerate(self.trials)}
        return sorted(self.trials, key=lambda trial: (trial.seed, firsts[id(trial)]))


def read_plan(
    file: Path,
    settings: Iterable[Setting] = (),
    seeds: int | None = None,
    trial_timeout_s: float | None = None,
) -> Plan:
    """Reads a sweep file and checks every experiment in it; InputError names the place.

    `settings` go on top of every trial, `seeds` in place of every block's number of seeds,
    `trial_timeout_s` in place of the file's.
    """
    text = ExperimentText.read(file, [])
    if "swarm" in text.raw and not {"base", "block"} & text.raw.keys():
        what = (
            f"an experiment, not a sweep; type: kilotwin run {file}, or write a sweep with base ="
        )
        raise InputError(f'{file}: {what} "{file.name}"')
    try:
        keys = SweepSchema.model_validate(text.raw)
    except ValidationError as error:
        raise input_error(text, error, schema=SweepSchema) from None
    if trial_timeout_s is not None:
        keys = keys.model_copy(update={"trial_timeout_s": trial_timeout_s})
    settings = list(settings)
    blocks = [(place, block, _axes(block, place, text)) for place, block in _blocks(keys, text)]
    for place, block, _ in blocks:
        _check_keys(keys, block, place, text, settings)
    if sum((seeds or block.seeds) * math.prod(map(len, axes)) for _, block, axes in blocks) > (
        _MOST_TRIALS
    ):
        raise InputError(f"{text.source}: more than {_MOST_TRIALS:,} trials; split the sweep")
    trials: list[Trial] = []
    known: dict[str, list[_Combination]] = {}
    names = _base_names([block for _, block, _ in blocks], text)
    for place, block, axes in blocks:
        own = range(block.first_seed, block.first_seed + (seeds or block.seeds))
        for parts in itertools.product(*axes):
            chosen = _merged([_written(block.set, (*place, "set")), *parts])
            base = chosen.pop("base")
            given = _settings(_merged([_written(keys.set, ("set",)), chosen]), text)
            file_ = _file(base, text)
            experiment = Experiment.load(file_, [*given, *settings])
            combination = _Combination(place, own, [_path_of(part) for part in parts])
            _check_new(combination, known.setdefault(_seeded(experiment, 0).identity(), []), text)
            varied = {key: value for key, (value, _) in chosen.items()}
            name = names[os.path.normpath(file_)]
            trials += [
                Trial(index, name, seed, varied, _seeded(experiment, seed))
                for index, seed in enumerate(own, len(trials))
            ]
    return Plan(keys, file.read_text(), text, trials)


def _blocks(keys: SweepSchema, text: ExperimentText) -> Iterator[tuple[KeyPath, Block]]:
    own = {key: getattr(keys, key) for key in ("base", "vary", "together", "each")}
    if keys.block:
        for key, value in own.items():
            if value:
                raise InputError(
                    f"{text.where((key,))}: '{key}' stands beside [[block]]; move it into the block"
                )
        for index, block in enumerate(keys.block):
            given = block.model_fields_set
            defaults = {
                key: getattr(keys, key) for key in ("seeds", "first_seed") if key not in given
            }
            yield ("block", index), block.model_copy(update=defaults)
    elif not keys.base:
        raise InputError(
            f'{text.source}: no experiment to run; add base = "experiment.toml" or [[block]]'
        )
    else:
        yield (), Block(**own, seeds=keys.seeds, first_seed=keys.first_seed)


def _written(table: Mapping[str, Any], place: KeyPath) -> _Part:
    return {key: (value, (*place, *key.split("."))) for key, value in table.items()}


def _merged(parts: Iterable[_Part]) -> _Part:
    return {key: written for part in parts for key, written in part.items()}


def _axes(block: Block, place: KeyPath, text: ExperimentText) -> list[list[_Part]]:
    """The combinations, first of the bases; the last key changes fastest."""
    axes = [[{"base": (base, (*place, "base", index))} for index, base in enumerate(block.base)]]
    for number, table in enumerate(block.together):
        lists = _lists(table, (*place, "together", number))
        lengths = {key: len(values) for key, values in table.items()}
        for key, values in lists.items():
            if len(values) != len(next(iter(lists.values()))):
                listed = ", ".join(f"{key} has {length}" for key, length in lengths.items())
                raise InputError(
                    f"{text.where(values[0][1][:-1])}: lists of different lengths ({listed}); "
                    "keys of one [[together]] table change together"
                )
        axes.append(
            [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]
        )
    vary = _lists(block.vary, (*place, "vary"))
    axes += [[{key: value} for value in values] for key, values in vary.items()]
    each = _lists(block.each, (*place, "each"))
    axes.append([{}, *({key: value} for key, values in each.items() for value in values)])
    return axes


def _lists(table: Mapping[str, list[Any]], place: KeyPath) -> dict[str, list[_Written]]:
    return {
        key: [(value, (*place, *key.split("."), index)) for index, value in enumerate(values)]
        for key, values in table.items()
    }


def _check_keys(
    keys: SweepSchema,
    block: Block,
    place: KeyPath,
    text: ExperimentText,
    settings: Sequence[Setting],
) -> None:
    """Checks that every key is given once, so that the data set's columns show what was run."""
    together = enumerate(block.together)
    tables: list[tuple[KeyPath, Mapping[str, Any]]] = [
        (("set",), keys.set),
        ((*place, "set"), block.set),
        *(((*place, "together", number), table) for number, table in together),
        ((*place, "vary"), block.vary),
        ((*place, "each"), block.each),
    ]
    given: list[tuple[KeyPath, KeyPath, bool]] = []
    for table, entries in tables:
        before = list(given)
        for name in entries:
            key = tuple(name.split("."))
            where = (*table, *key)
            if key == ("seed",):
                raise InputError(
                    f"{text.where(where)}: a sweep does not take 'seed'; write seeds = 3 for "
                    "seeds 1 to 3, and first_seed = 5 to begin at another"
                )
            if key == ("robots",) and table != ("set",):
                raise InputError(
                    f"{text.where(where)}: 'robots' cannot vary as a whole, for the column robots "
                    "says how many there are; vary keys below it, as robots.0.program"
                )
            for other, others, is_set in before:
                # A set value may be gone through one by one, or completed by a key below it.
                completes = is_set and (table[-1] == "each" or len(other) < len(key))
                if _overlap(key, other) and not completes:
                    raise InputError(
                        f"{text.where(where)}: {name} is given at {text.where(others)} too; "
                        "keep one of them"
                    )
            given.append((key, where, table[-1] == "set"))
            for setting in settings:
                if table != ("set",) and _overlap(key, setting.keys):
                    raise InputError(
                        f"{setting.written}: the sweep varies {name} ({text.where(where)}); leave "
                        "it out, or change the file"
                    )
    for setting in settings:
        if setting.keys == ("seed",):
            raise InputError(
                f"{setting.written}: a sweep does not take 'seed'; use --seeds, or first_seed in "
                "its file"
            )


def _overlap(one: KeyPath, other: KeyPath) -> bool:
    """Whether one of the keys is the other, or below it."""
    length = min(len(one), len(other))
    return one[:length] == other[:length]


def _check_new(new: _Combination, like: list[_Combination], text: ExperimentText) -> None:
    """The same trial twice would count as two that agree. `like` mean the same experiment."""
    for old in like:
        if max(old.seeds.start, new.seeds.start) < min(old.seeds.stop, new.seeds.stop):
            differ = (a for a, b in zip(new.paths, old.paths, strict=False) if a != b)
            here = next(differ, new.place) if new.place == old.place else new.place
            again = "" if new.place == old.place else f" at {text.where(old.place)}"
            raise InputError(
                f"{text.where(here)}: means trials that the sweep has already{again} (a value "
                "that stands twice, or is the base's own); remove one of them"
            )
    like.append(new)


def _path_of(part: _Part) -> KeyPath:
    return next((path for _, path in part.values()), ())


def _seeded(experiment: Experiment, seed: int) -> Experiment:
    """The same with another seed; nothing else of an experiment depends on it."""
    return replace(experiment, keys=experiment.keys.model_copy(update={"seed": seed}))


def _file(base: _Written, text: ExperimentText) -> Path:
    name, path = base
    file: Path = text.folder / name
    if not file.is_file():
        raise InputError(f"{text.where(path)}: {name}: no such file beside the sweep")
    return file


def _base_names(blocks: Iterable[Block], text: ExperimentText) -> dict[str, str]:
    """Name of each base: its file's name, or as the sweep writes it where two have that."""
    written: dict[str, str] = {}
    for block in blocks:
        for base in block.base:
            written.setdefault(os.path.normpath(text.folder / base), base)
    named = Counter(Path(base).stem for base in written.values())
    return {
        file: Path(base).stem if named[Path(base).stem] == 1 else base
        for file, base in written.items()
    }


def _settings(values: _Part, text: ExperimentText) -> list[Setting]:
    """Errors about a value name its place in the sweep, and the value."""
    return [
        Setting(tuple(key.split(".")), value, f"{text.where(path)}: {key} = {value!r}")
        for key, (value, path) in values.items()
    ]


def shown(trial: Trial) -> str:
    """`simplified-n50, swarm.informed 0.1, seed 3`. A name says what its lists are for."""
    named = "name" in trial.settings
    values = [
        str(value) if key == "name" else f"{key} {value}"
        for key, value in trial.settings.items()
        if not (named and isinstance(value, list))
    ]
    return ", ".join([trial.base, *values, f"seed {trial.seed}"])
