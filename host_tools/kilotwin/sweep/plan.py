"""Which trials a sweep file means: every combination of its lists, once per seed."""
# ruff: noqa: RUF012 (pydantic copies defaults)

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError

from kilotwin.errors import InputError
from kilotwin.experiment import Experiment
from kilotwin.experiment_errors import input_error
from kilotwin.experiment_schema import Section, Text, one_or_more
from kilotwin.experiment_text import ExperimentText, Setting
from kilotwin.toml_lines import KeyPath

_RANGE_KEYS = {"from", "to", "step"}
_MOST_TRIALS = 1_000_000


def _flat(table: Any) -> Any:
    """`{"swarm": {"informed": [0.1]}}` as `{"swarm.informed": [0.1]}`; a range stays a table."""
    if not isinstance(table, dict):
        return table
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and not set(value) <= _RANGE_KEYS:
            flat.update({f"{key}.{inner}": leaf for inner, leaf in _flat(value).items()})
        else:
            flat[key] = value
    return flat


def _values(value: Any) -> Any:
    """A list as it is; a range {from, to, step} as the numbers from `from` up to `to`."""
    if not isinstance(value, dict):
        return value
    if set(value) != _RANGE_KEYS or not all(
        isinstance(part, int | float) and not isinstance(part, bool) for part in value.values()
    ):
        raise ValueError("must be a list, or a range { from = 0.1, to = 0.5, step = 0.1 }")
    # Decimal: 0.1, 0.2, 0.3 as they are written, not 0.30000000000000004.
    first, last, step = (Decimal(str(value[key])) for key in ("from", "to", "step"))
    if step <= 0 or last < first or (last - first) / step > _MOST_TRIALS:
        raise ValueError("must have a step above 0 that leads from `from` up to `to`")
    whole = all(isinstance(part, int) for part in value.values())
    numbers = (first + step * index for index in range(int((last - first) / step) + 1))
    return [int(number) if whole else float(number) for number in numbers]


def _flat_values(table: Any) -> Any:
    flat = _flat(table)
    return {key: _values(value) for key, value in flat.items()} if isinstance(flat, dict) else flat


Values = Annotated[list[Any], Field(min_length=1)]
Axes = Annotated[dict[Text, Values], BeforeValidator(_flat_values)]
Settings = Annotated[dict[Text, Any], BeforeValidator(_flat)]
Seeds = Annotated[int, Field(ge=1, le=1_000_000)]


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
    together: list[Axes] = []
    """Tables of lists of one length: their keys change together, not in every combination."""
    each: Axes = {}
    """Lists or ranges of values, one at a time: first none of them, then each by itself."""


class SweepSchema(Section):
    """A whole sweep file: one block in it, or several as [[block]]."""

    name: Text
    """What folders and figures call it; the file's name if left out."""
    base: Annotated[list[Text], BeforeValidator(one_or_more)] | None = None
    """As in a block; without [[block]] the file is one block itself."""
    seeds: Seeds = 1
    """As in a block, for blocks that do not say it."""
    first_seed: Annotated[int, Field(ge=0, le=2**62)] = 1
    """As in a block, for blocks that do not say it."""
    set: Settings = {}
    """As in a block, for all blocks."""
    vary: Axes = {}
    """As in a block; not beside [[block]]."""
    together: list[Axes] = []
    """As in a block; not beside [[block]]."""
    each: Axes = {}
    """As in a block; not beside [[block]]."""
    block: list[Block] = []
    """Blocks of trials, one after the other."""
    slurm: dict[Text, Any] = {}
    """For --slurm: what dask-jobqueue's SLURMCluster takes (queue, account, walltime, memory, ...),
    and `jobs`, how many jobs of one core to ask for."""


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
    """A sweep, read and checked; `trials` in the order of the data set."""

    keys: SweepSchema
    text: str
    trials: Sequence[Trial]

    @property
    def varied(self) -> list[str]:
        """The keys that the trials differ in, besides base and seed, in the order of the file."""
        return list(dict.fromkeys(key for trial in self.trials for key in trial.settings))

    def in_running_order(self) -> list[Trial]:
        """Seed by seed, so that a stopped sweep has a little of everything."""
        firsts = {id(trial): place for place, trial in enumerate(self.trials)}
        return sorted(self.trials, key=lambda trial: (trial.seed, firsts[id(trial)]))


def read_plan(file: Path, settings: Iterable[Setting] = (), seeds: int | None = None) -> Plan:
    """Reads a sweep file and checks every experiment in it; InputError names the place.

    `settings` go on top of every trial, `seeds` in place of every block's number of seeds.
    """
    text = ExperimentText.read(file, [])
    try:
        keys = SweepSchema.model_validate(text.raw)
    except ValidationError as error:
        raise input_error(text, error, schema=SweepSchema) from None
    trials: list[Trial] = []
    for place, block in _blocks(keys, text):
        count = seeds or block.seeds
        for base, chosen in _combinations(block, place, text):
            for seed in range(block.first_seed, block.first_seed + count):
                _check_number(len(trials), text)
                varied = {**block.set, **chosen}
                own = _settings({**keys.set, **varied}, seed, text)
                experiment = Experiment.load(_file(base, place, text), [*own, *settings])
                trials.append(Trial(len(trials), Path(base).stem, seed, varied, experiment))
    return Plan(keys, file.read_text(), trials)


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


def _combinations(
    block: Block, place: KeyPath, text: ExperimentText
) -> Iterator[tuple[str, dict[str, Any]]]:
    """(base, values) for every combination; the last key changes fastest."""
    axes: list[list[dict[str, Any]]] = []
    for index, table in enumerate(block.together):
        lengths = {key: len(values) for key, values in table.items()}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{key} has {length}" for key, length in lengths.items())
            raise InputError(
                f"{text.where((*place, 'together', index))}: lists of different lengths "
                f"({listed}); keys of one [[together]] table change together"
            )
        axes.append(
            [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]
        )
    axes += [[{key: value} for value in values] for key, values in block.vary.items()]
    alone = [{key: value} for key, values in block.each.items() for value in values]
    axes.append([{}, *alone])
    for base in block.base:
        for parts in itertools.product(*axes):
            yield base, {key: value for part in parts for key, value in part.items()}


def _check_number(count: int, text: ExperimentText) -> None:
    if count >= _MOST_TRIALS:
        raise InputError(f"{text.source}: more than {_MOST_TRIALS:,} trials; split the sweep")


def _file(base: str, place: KeyPath, text: ExperimentText) -> Path:
    file = text.folder / base
    if not file.is_file():
        raise InputError(f"{text.where((*place, 'base'))}: {base}: no such file beside the sweep")
    return file


def _settings(values: Mapping[str, Any], seed: int, text: ExperimentText) -> list[Setting]:
    """What is wrong with a value is told with the sweep's name and the value."""
    given = [
        Setting(tuple(key.split(".")), value, f"{text.source}: {key} = {value!r}")
        for key, value in values.items()
    ]
    return [*given, Setting(("seed",), seed, f"{text.source}: seed = {seed}")]


def shown(trial: Trial) -> str:
    """`simplified-n50, swarm.informed 0.1, seed 3`."""
    values = [f"{key} {value}" for key, value in trial.settings.items()]
    return ", ".join([trial.base, *values, f"seed {trial.seed}"])
