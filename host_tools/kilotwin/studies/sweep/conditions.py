"""A sweep's trials, sorted by what the paper varies: controller, N, and informed robots."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import pyarrow as pa

from kilotwin.errors import InputError
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.text import parse_setting
from kilotwin.runs.reader import read_parquet
from kilotwin.studies.sweep.data_set import ABOUT, TRIALS, about

Row = dict[str, Any]

# Columns of keys of experiments that a condition and a reading repeat. `robots` is a number here.
_SAID_OTHERWISE = ("swarm.informed", "swarm.size", "controller.rule", "reading.")
_NO_KEYS = ("seed", "robots", "reading")
_NOT_SET = "none"  # in --where: the trials that do not set the key


@dataclass(frozen=True)
class Condition:
    """One cell of the grid. `shares`: of the informed robots over `sites`, in their order."""

    rule: str
    robots: int
    informed: float
    shares: tuple[float, ...]
    sites: tuple[str, ...] = ("black", "white")

    @property
    def wanted(self) -> tuple[float, ...]:
        """Robots wanted on each site."""
        return tuple(share * self.robots for share in self.shares)


@dataclass(frozen=True)
class Ending:
    """How one trial ended: robots resting on each site, and nowhere."""

    resting: tuple[int, ...]
    nowhere: int

    def error(self, condition: Condition) -> float:
        """Robots too many or too few on a site, averaged over the sites."""
        wrong = [abs(a - b) for a, b in zip(self.resting, condition.wanted, strict=True)]
        return sum(wrong) / len(wrong)

    @property
    def is_one_aggregate(self) -> bool:
        """Whether the largest site holds at least 90 % of the resting robots."""
        most = max(self.resting)
        return most > 0 and 10 * most >= 9 * sum(self.resting)


@dataclass(frozen=True)
class Conditions:
    """All trials of a data set. `sites` are the names of all sites of all its experiments.

    `progress`: how many trials of the sweep there are, where some are lacking; otherwise "".
    """

    name: str
    sites: tuple[str, ...]
    endings: dict[Condition, list[Ending]] = field(default_factory=dict)
    progress: str = ""

    @staticmethod
    def open(folder: Path, where: Sequence[str] = ()) -> "Conditions":
        """Reads the trials of a sweep's folder; InputError if it is none or has none yet.

        `where`: texts such as controller.beta=1.5, all of which a trial has to meet.
        """
        found = Conditions.by_reading(folder, where)
        if len(found) > 1:
            raise InputError(
                f"{folder}: its trials have {len(found)} readings ({'; '.join(found)}), which do "
                f"not go together; choose one, as by --where 'reading={next(iter(found))}', or use "
                "`python -m tests.truth.against paper`, which takes them one by one"
            )
        return next(iter(found.values()))

    @staticmethod
    def by_reading(folder: Path, where: Sequence[str] = ()) -> "dict[str, Conditions]":
        """The same for each reading of what the paper leaves open, in the order of the data set."""
        table = _read(folder)
        rows = chosen(folder, table, where)
        sites = _sites(table)
        name, progress = about(folder, "name"), _progress(folder, table.num_rows)
        varied = _varied(table)
        firsts: dict[tuple[str, Condition], Row] = {}
        found: dict[str, Conditions] = {}
        for row in rows:
            own = [site for site in sites if row[f"resting_{site}"] is not None]
            condition = Condition(
                row["rule"],
                int(row["robots"]),
                row["informed"],
                tuple(row[f"share_{site}"] for site in own),
                tuple(own),
            )
            _check_alike(folder, varied, firsts.setdefault((row["reading"], condition), row), row)
            ending = Ending(
                tuple(int(row[f"resting_{site}"]) for site in own), int(row["not_resting"])
            )
            of_reading = found.setdefault(
                row["reading"], Conditions(name, sites, progress=progress)
            )
            of_reading.endings.setdefault(condition, []).append(ending)
        return found

    @property
    def rules(self) -> list[str]:
        """The controllers, the paper's own first."""
        return sorted({c.rule for c in self.endings}, key=lambda rule: (rule == "firat", rule))

    @property
    def sizes(self) -> list[int]:
        """The numbers of robots."""
        return sorted({condition.robots for condition in self.endings})

    def where(self, **wanted: Any) -> "dict[Condition, list[Ending]]":
        """The conditions that have these values, sorted by informed share, then by shares."""
        chosen = [
            condition
            for condition in self.endings
            if all(getattr(condition, key) == value for key, value in wanted.items())
        ]
        rules = self.rules
        chosen.sort(key=lambda c: (c.robots, rules.index(c.rule), c.informed, c.sites, c.shares))
        return {condition: self.endings[condition] for condition in chosen}


def _progress(folder: Path, done: int) -> str:
    planned = about(folder, "trials", done)
    return f"{done:,} of the sweep's {planned:,} trials" if done < planned else ""


def _read(folder: Path) -> pa.Table:
    if not (folder / ABOUT).is_file():
        raise InputError(
            f"{folder}: not a sweep's folder (no {ABOUT}); name one that `kilotwin sweep` made"
        )
    try:
        table = read_parquet(folder / TRIALS)
    except FileNotFoundError:
        raise InputError(f"{folder}: no trial is finished yet; go on with the sweep") from None
    except (pa.ArrowInvalid, OSError) as error:
        why = str(error).splitlines()[0]
        raise InputError(
            f"{folder / TRIALS}: damaged ({why}); the sweep's own command makes it anew"
        ) from None
    if "reading" not in table.column_names:
        raise InputError(f"{folder}: an older Kilotwin made it; repeat the sweep")
    _check_columns(folder, table)
    return table


def _check_columns(folder: Path, table: pa.Table) -> None:
    """A table that something else wrote may lack columns, or hold what is no number of robots."""

    def refuse(why: str) -> NoReturn:
        raise InputError(f"{folder / TRIALS}: {why}; the sweep's own command makes it anew")

    names = table.column_names
    sites = _sites(table)
    if not sites and not any(name.startswith("share_") for name in names):
        raise InputError(f"{folder}: its experiments have no sites, which this is about")
    shares = [f"share_{site}" for site in sites]
    for column in ["base", "seed", "rule", "robots", "informed", "not_resting", *shares]:
        if column not in names:
            refuse(f"no column {column}")
    if len(shares) < sum(name.startswith("share_") for name in names):
        refuse("a share_ column without its resting_ column")
    if table.num_rows == 0:
        refuse("no trial in it")
    for row in table.to_pylist():
        if wrong := _wrong_in(row, sites):
            refuse(wrong)


def _wrong_in(row: Row, sites: Sequence[str]) -> str:
    """The fault of an impossible trial; "" if it is possible."""
    own = [
        site
        for site in sites
        if row[f"resting_{site}"] is not None or row[f"share_{site}"] is not None
    ]
    if not own:
        return f"a trial with seed {row['seed']} has no site"
    for column in ["base", "rule", "reading"]:
        if not isinstance(row[column], str):
            return f"{column} is {row[column]!r}, no text"
    for column in ["informed", *(f"share_{site}" for site in own)]:
        if not _is_number(row[column]) or not 0 <= row[column] <= 1:
            return f"{column} is {row[column]!r}, no share from 0 to 1"
    for column in ["robots", "not_resting", *(f"resting_{site}" for site in own)]:
        value, least = row[column], 1 if column == "robots" else 0
        # Others may write whole numbers as 50.0.
        if not _is_number(value) or value % 1 or not least <= value <= row["robots"]:
            return f"{column} is {value!r}, no number of robots"
    return ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _sites(table: pa.Table) -> tuple[str, ...]:
    prefix = "resting_"
    return tuple(c.removeprefix(prefix) for c in table.column_names if c.startswith(prefix))


def _varied(table: pa.Table) -> list[str]:
    """Columns in which trials of one condition and reading must not differ, wherever they stand.

    What others have added to the table is none of them.
    """
    keys = (
        name
        for name in table.column_names
        if name.partition(".")[0] in ExperimentSchema.model_fields and name not in _NO_KEYS
    )
    return ["base", *(key for key in keys if not key.startswith(_SAID_OTHERWISE))]


def chosen(folder: Path, table: pa.Table, where: Sequence[str]) -> list[Row]:
    """The rows of trials.parquet that meet all texts such as controller.beta=1.5."""
    rows: list[Row] = table.to_pylist()
    for text in where:
        column, equals, value = text.partition("=")
        if not equals or column not in table.column_names:
            raise InputError(
                f"--where {text}: not of the form column=value; {folder / TRIALS} has the columns "
                f"{', '.join(table.column_names)}"
            )
        wanted = None if value == _NOT_SET else parse_setting(f"value={value}").value
        values = dict.fromkeys(row[column] for row in rows)
        # Lists are text in the table, and a text may look like a number.
        rows = [row for row in rows if row[column] == wanted or _shown(row[column]) == value]
        if not rows:
            found = ", ".join(map(_shown, values))
            raise InputError(f"--where {text}: no trial has it; {column} is {found}")
    return rows


def _check_alike(folder: Path, varied: Sequence[str], first: Row, row: Row) -> None:
    for column in varied:
        if row[column] != first[column]:
            values = [_shown(one[column]) for one in (first, row)]
            raise InputError(
                f"{folder}: trials that would be counted together differ in {column} "
                f"({' and '.join(values)}); choose some, as by --where {column}={values[0]}"
            )


def _shown(value: Any) -> str:
    if value is None:
        return _NOT_SET
    return str(value).lower() if isinstance(value, bool) else str(value)


def on_site(endings: Iterable[Ending], site: int) -> list[int]:
    """Robots resting on one site, trial by trial."""
    return [ending.resting[site] for ending in endings]


def errors(condition: Condition, endings: Iterable[Ending]) -> list[float]:
    """The error of each trial."""
    return [ending.error(condition) for ending in endings]
