"""A sweep's trials, sorted by what the paper varies: controller, N, and who is informed."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from kilotwin.errors import InputError
from kilotwin.sweep.data_set import ABOUT, TRIALS, about


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
    """All trials of a data set. `sites` are the names of all sites of all its experiments."""

    name: str
    sites: tuple[str, ...]
    endings: dict[Condition, list[Ending]] = field(default_factory=dict)

    @staticmethod
    def open(folder: Path) -> "Conditions":
        """Reads the trials of a sweep's folder; InputError if it is none or has none yet."""
        found = Conditions.by_reading(folder)
        if len(found) > 1:
            raise InputError(
                f"{folder}: its trials have {len(found)} readings ({'; '.join(found)}), which do "
                "not go together; `kilotwin compare paper` takes them one by one"
            )
        return next(iter(found.values()))

    @staticmethod
    def by_reading(folder: Path) -> "dict[str, Conditions]":
        """The same for each reading of what the paper leaves open, in the order of the data set."""
        if not (folder / ABOUT).is_file():
            raise InputError(
                f"{folder}: not a sweep's folder (no {ABOUT}); name one that `kilotwin sweep` made"
            )
        try:
            table = pq.read_table(folder / TRIALS)
        except FileNotFoundError:
            raise InputError(f"{folder}: no trial is finished yet; go on with the sweep") from None
        except pa.ArrowInvalid as error:
            raise InputError(f"{folder / TRIALS}: damaged ({error}); repeat the sweep") from None
        if "reading" not in table.column_names:
            raise InputError(f"{folder}: an older Kilotwin made it; repeat the sweep")
        prefix = "resting_"
        sites = tuple(c.removeprefix(prefix) for c in table.column_names if c.startswith(prefix))
        name = about(folder, "name")
        found: dict[str, Conditions] = {}
        for row in table.to_pylist():
            own = [site for site in sites if row[f"resting_{site}"] is not None]
            condition = Condition(
                row["rule"],
                row["robots"],
                row["informed"],
                tuple(row[f"share_{site}"] for site in own),
                tuple(own),
            )
            ending = Ending(tuple(row[f"resting_{site}"] for site in own), row["not_resting"])
            of_reading = found.setdefault(row["reading"], Conditions(name, sites))
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


def on_site(endings: Iterable[Ending], site: int) -> list[int]:
    """Robots resting on one site, trial by trial."""
    return [ending.resting[site] for ending in endings]


def errors(condition: Condition, endings: Iterable[Ending]) -> list[float]:
    """The error of each trial."""
    return [ending.error(condition) for ending in endings]
