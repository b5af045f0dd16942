"""A variation of an experiment: who takes part, how long, and what differs; and the ordinary
experiment that it makes of the tables."""

import copy
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

Tables = dict[str, Any]
Path = tuple[str, ...]
Pose = tuple[float, float, float]

LATE = ("late",)
"""The path of an addition that tells one robot to run later than the others."""


@dataclass(frozen=True)
class Put:
    """A key with another value."""

    path: Path
    value: Any


@dataclass(frozen=True)
class Addition:
    """A table more in a list. Where `robot` is not None the table is about that robot, by its index
    in the experiment, and `key` takes its uid, in a list if `listed`."""

    path: Path
    table: tuple[tuple[str, Any], ...]
    robot: int | None = None
    key: str = "robot"
    listed: bool = False

    def of(self, name: str) -> Any:
        """The value of one of the table's keys; None without it."""
        return dict(self.table).get(name)

    def with_value(self, name: str, value: Any) -> "Addition":
        """The same with another value of a key."""
        return replace(self, table=tuple({**dict(self.table), name: value}.items()))


@dataclass(frozen=True)
class Variation:
    """Differences from the experiment as it is; None or () of a key: as there.

    `robots`: indices of those that take part, ascending. `uids`, `poses`: of each robot of the
    experiment, by index.
    """

    seed: int | None = None
    robots: tuple[int, ...] = ()
    duration_s: float | None = None
    uids: tuple[int, ...] = ()
    poses: tuple[Pose, ...] = ()
    puts: tuple[Put, ...] = ()
    additions: tuple[Addition, ...] = ()

    def put(self, path: Path, value: Any) -> "Variation":
        """The same with that value of a key."""
        others = tuple(one for one in self.puts if one.path != path)
        return replace(self, puts=(*others, Put(path, value)))

    def add(self, *additions: Addition) -> "Variation":
        """The same with more tables."""
        return replace(self, additions=(*self.additions, *additions))

    def as_dict(self) -> dict[str, Any]:
        """For a file; only what differs."""
        told = {key: value for key, value in vars(self).items() if value not in (None, ())}
        told |= {"puts": [vars(one) for one in self.puts]} if self.puts else {}
        more = [vars(one) for one in self.additions]
        return told | ({"additions": more} if more else {})

    @staticmethod
    def of(told: dict[str, Any]) -> "Variation":
        """The opposite of as_dict(), after a JSON file or before."""
        kept = dict(told)
        for key in ("robots", "uids"):
            if key in kept:
                kept[key] = tuple(kept[key])
        if "poses" in kept:
            kept["poses"] = tuple((x, y, turn) for x, y, turn in kept["poses"])
        kept["puts"] = tuple(Put(tuple(one["path"]), one["value"]) for one in told.get("puts", ()))
        kept["additions"] = tuple(
            Addition(
                **{
                    **one,
                    "path": tuple(one["path"]),
                    "table": tuple((name, value) for name, value in one["table"]),
                }
            )
            for one in told.get("additions", ())
        )
        return Variation(**kept)


@dataclass(frozen=True)
class Base:
    """The experiment that is hunted: its tables, and its robots by index: the uids with which they
    begin, and how many each of its kinds has."""

    tables: Tables
    uids: tuple[int, ...]
    counts: tuple[int, ...]
    _kinds: tuple[Tables, ...] = field(init=False)

    def __post_init__(self) -> None:
        tables, swarm = self.tables, self.tables["swarm"]
        kinds = tables.get("robots") or [{"program": swarm["program"]}]
        object.__setattr__(self, "_kinds", tuple(kinds))

    @property
    def size(self) -> int:
        """The number of robots."""
        return len(self.uids)

    def varied(self, variation: Variation) -> Tables:
        """The tables of an ordinary experiment: that one, with what differs."""
        tables = copy.deepcopy(self.tables)
        tables.pop("hunt", None)
        uids = variation.uids or self.uids
        there = variation.robots or range(self.size)
        if variation.seed is not None:
            tables["seed"] = variation.seed
        if variation.duration_s is not None:
            tables["duration_s"] = variation.duration_s
            expects = tables.get("expect", [])
            tables["expect"] = [_cut(row, variation.duration_s) for row in expects]
        self._rename(tables, {self.uids[one]: uids[one] for one in there})
        if variation.robots or variation.uids or variation.poses:
            self._pick(tables, variation, there, uids)
        for put in variation.puts:
            table = tables
            for key in put.path[:-1]:
                table = table.setdefault(key, {})
            table[put.path[-1]] = put.value
        late: dict[int, float] = {}
        for one in variation.additions:
            if one.robot is not None and one.robot not in there:
                continue
            added = dict(one.table)
            if one.robot is not None:
                added[one.key] = [uids[one.robot]] if one.listed else uids[one.robot]
            if one.path == LATE:
                late[added[one.key]] = added["at_s"]
            else:
                _list_at(tables, one.path).append(added)
        if "command" not in self.tables and (late or "command" in tables):
            # A [[command]] takes the place of RUN, which all get else.
            orders = tables.get("command", [])
            tables["command"] = [*_runs([uids[one] for one in there], late), *orders]
        return tables

    def _pick(
        self, tables: Tables, variation: Variation, there: Sequence[int], uids: Sequence[int]
    ) -> None:
        """Writes the robots kind by kind, with their poses and uids where these are given."""
        swarm = tables["swarm"]
        for key in ("program", "size", "first_uid"):
            swarm.pop(key, None)
        kinds: list[Tables] = []
        first = 0
        for kind, count in zip(self._kinds, self.counts, strict=True):
            chosen = [one for one in there if first <= one < first + count]
            written = {**copy.deepcopy(kind), "count": len(chosen)}
            poses = written.get("poses")
            if variation.poses:
                written = {key: it for key, it in written.items() if key not in _STARTS}
                written["poses"] = [list(variation.poses[one]) for one in chosen]
            elif isinstance(poses, list):
                written["poses"] = [poses[one - first] for one in chosen]
            own = [uids[one] for one in chosen]
            if own != [self._plain_uid(kinds, index) for index in range(len(own))]:
                written["uids"] = own
                written.pop("first_uid", None)
            elif "first_uid" not in kind:
                written.pop("uids", None)
            first += count
            if chosen:
                kinds.append(written)
        tables["robots"] = kinds

    def _plain_uid(self, before: Sequence[Tables], index: int) -> int:
        """The uid of a robot of which nothing is said."""
        return sum(int(kind["count"]) for kind in before) + index + 1

    def _rename(self, tables: Tables, names: dict[int, int]) -> None:
        """Has tables about single robots name them by their uids now, and drops those about robots
        that do not take part."""
        for key in ("command", "step"):
            if key in tables:
                rows = [row for row in tables[key] if row.get("robot") in (None, *names)]
                tables[key] = [
                    {**row, "robot": names[row["robot"]]} if "robot" in row else row for row in rows
                ]
        faults = tables.get("faults", {}).get("robot")
        if faults is not None:
            for row in faults:
                if "robots" in row:
                    row["robots"] = [names[uid] for uid in row["robots"] if uid in names]
            tables["faults"]["robot"] = [row for row in faults if row.get("robots") != []]


def _cut(expect: Tables, end_s: float) -> Tables:
    """What has to hold throughout a time has to hold throughout what is left of it."""
    left_s = round(end_s - expect.get("after_s", 0.0), 3)
    if not 0 < left_s < expect.get("throughout_s", 0.0):
        return expect
    return {**expect, "throughout_s": left_s}


_STARTS = ("poses", "columns", "formation")


def _list_at(tables: Tables, path: Path) -> list[Tables]:
    table: Any = tables
    for key in path[:-1]:
        table = table.setdefault(key, {})
    found: list[Tables] = table.setdefault(path[-1], [])
    return found


def _runs(uids: Sequence[int], late: dict[int, float]) -> list[Tables]:
    """RUN to each robot: at 0, but for those that get it late."""
    told: list[Tables] = []
    for is_late, stretch in itertools.groupby(sorted(uids), lambda uid: uid in late):
        if is_late:
            told += [{"at_s": late[uid], "send": "run", "robot": uid} for uid in stretch]
            continue
        first, *others = stretch
        whom = {"uid_first": first, "uid_last": others[-1]} if others else {"robot": first}
        told.append({"at_s": 0.0, "send": "run", **whom})
    return told
