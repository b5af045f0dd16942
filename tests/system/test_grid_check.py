"""`kilotwin grid check` on an emulated table, and `kilotwin record` on one that is not ready."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from .conftest import Kilotwin
from .served_table import Table
from .test_grid import SMALL

OURS = ["--set", 'swarm.runtime="kilotwin"']
DEAD = ["--set", 'faults.module=[{at_s=0.0, kind="dead", module=[3, 2]}]']

Open = Callable[..., Table]


@pytest.fixture
def open_table(tmp_path: Path, environment: dict[str, str]) -> Iterator[Open]:
    """`open_table("--set", ...)`: a table that waits."""
    tables: list[Table] = []

    def open_table(*words: str) -> Table:
        tables.append(Table(SMALL, tmp_path, environment, "--set", "duration_s=1000", *words))
        return tables[-1]

    yield open_table
    for table in tables:
        table.close()


def lines(told: str) -> dict[str, dict[str, Any]]:
    """The findings of --json, by name."""
    return {finding["what"]: finding for finding in json.loads(told)["findings"]}


@pytest.mark.long
def test_a_missing_module_is_named_and_record_is_refused_until_it_is_forced(
    kilotwin: Kilotwin, tmp_path: Path, open_table: Open
) -> None:
    where = ["--can", open_table(*OURS, *DEAD).bus]
    done = kilotwin("grid", "check", SMALL, *where, *OURS, "--json", "-q", expect=1)
    assert json.loads(done.stdout)["ready"] is False
    found = lines(done.stdout)
    assert found["modules"]["verdict"] == "not ready"
    assert found["modules"]["modules"] == [[3, 2]]
    assert found["modules"]["found"] == "15 of 16 answer; silent: 3-2"
    assert [found[what]["verdict"] for what in ("buses", "firmware", "states")] == ["ready"] * 3
    # Robots on the missing module's cells are not heard.
    assert int(found["robots"]["found"].split()[0]) >= 8
    assert found["batteries"]["verdict"] == "ready"

    out = tmp_path / "recorded"
    words = [SMALL, *where, "--set", "duration_s=2", "--out", out, "-q"]
    done = kilotwin("record", *words, expect=1)
    assert "15 of 16 answer; silent: 3-2" in done.stderr
    assert "or add --force" in done.stderr
    assert not out.exists()
    done = kilotwin("record", *words, "--force", expect=4)
    assert "15 of 16 answer; silent: 3-2" in done.stderr
    assert json.loads((out / "manifest.json").read_text())["status"] == "finished"


@pytest.mark.long
def test_a_module_with_another_configuration_is_named_and_record_puts_it_right(
    kilotwin: Kilotwin, tmp_path: Path, open_table: Open
) -> None:
    table = open_table()
    where = ["--can", table.bus]
    buses = [word for n in range(2) for word in ("--can", f"{table.bus}/can{n}")]
    fresh = kilotwin("grid", "check", SMALL, *where, "--json", "-q")
    assert lines(fresh.stdout)["configuration"]["found"] == "0 hold the experiment's, 16 none"
    kilotwin("grid", "setup", SMALL, *where)
    other = tmp_path / "other.kconf"
    other.write_text("address\nmodule:1-2\n\ndata\n0x01\n")
    kilotwin("grid", "setup", other, *buses, "--size", "4x4")
    done = kilotwin("grid", "check", SMALL, *where)
    rows = {line.split()[0]: line for line in done.stdout.splitlines()}
    assert "15 hold the experiment's, 1 another: 1-2" in rows["configuration"]
    assert "kilotwin grid setup EXP" in rows["configuration"]
    assert "16 of 16 answer" in rows["modules"]
    assert done.stdout.splitlines()[-1] == "ready"
    words = ["--set", "duration_s=2", "--out", tmp_path / "recorded", "-q"]
    told = kilotwin("record", SMALL, *where, *words).stderr
    assert "another" not in told
