"""One host a table: a second one is refused, or spoils the first one's record, which says so."""

import json
import signal
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from .conftest import KILOTWIN, ROOT, Kilotwin
from .served_table import Table
from .test_grid import SMALL, wait_for_run

pytestmark = pytest.mark.waits


@pytest.fixture
def table(tmp_path: Path, environment: dict[str, str]) -> Iterator[Table]:
    opened = Table(SMALL, tmp_path, environment, "--set", "duration_s=1000")
    yield opened
    opened.close()


def buses(table: Table) -> list[str]:
    """As `kilotwin grid` names them without an experiment."""
    each = [word for n in range(2) for word in ("--can", f"{table.bus}/can{n}")]
    return [*each, "--size", "4x4"]


def test_a_second_host_is_refused_and_one_that_takes_over_spoils_the_record(
    kilotwin: Kilotwin, environment: dict[str, str], tmp_path: Path, table: Table
) -> None:
    out = tmp_path / "recorded"
    words = ["--can", table.bus, "--set", "duration_s=60", "--out", out, "-q"]
    with subprocess.Popen(
        [KILOTWIN, "record", SMALL, *map(str, words)],
        cwd=ROOT,
        env=environment,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    ) as first:
        wait_for_run(out)
        tries = [
            ("record", SMALL, "--can", table.bus, "--out", tmp_path / "second"),
            ("grid", "pause", *buses(table)),
            ("grid", "ls", *buses(table)),
        ]
        with ThreadPoolExecutor() as pool:
            refused = list(pool.map(lambda words: kilotwin(*words, expect=3), tries))
        assert not (tmp_path / "second").exists()
        for done in refused:
            assert "another host" in done.stderr
            assert "add --takeover" in done.stderr
        events = (out / "events.jsonl").read_text()
        assert "foreign_order" not in events
        kilotwin("grid", "pause", "--takeover", *buses(table))
        _, said = first.communicate(timeout=240)
    assert first.returncode == 4, said
    assert "the record is spoiled" in said
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["spoiled"] == "another host was on the table"
    assert manifest["status"] == "finished"
    orders = {order["order"] for order in manifest["summary"]["grid"]["foreign_orders"]}
    assert "MODULE_IDLE" in orders
    kinds = [json.loads(line)["kind"] for line in (out / "events.jsonl").read_text().splitlines()]
    assert "foreign_order" in kinds


def test_a_host_is_seen_before_its_run_begins_while_it_gives_no_orders(
    environment: dict[str, str], tmp_path: Path, table: Table
) -> None:
    """Set-up of original modules ends some seconds before t = 0."""
    out = tmp_path / "recorded"
    words = ["--can", table.bus, "--set", "duration_s=1000", "--set", "grid.health=false"]
    with subprocess.Popen(
        [KILOTWIN, "record", SMALL, *map(str, [*words, "--out", out, "-q"])],
        cwd=ROOT,
        env=environment,
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    ) as first:
        seen = set()
        while not (out / "events.jsonl").exists():
            assert first.poll() is None
            time.sleep(0.01)
        began = False
        while not began:
            began = '"kind": "run"' in (out / "events.jsonl").read_text()
            done = subprocess.run(
                [KILOTWIN, "grid", "ls", *buses(table)],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            assert first.poll() is None
            seen.add((done.returncode, "another host" in done.stderr))
        first.send_signal(signal.SIGINT)
    assert seen == {(3, True)}
    assert json.loads((out / "manifest.json").read_text()).get("spoiled") is None


def test_a_host_joins_only_a_table_that_runs_its_experiment(
    kilotwin: Kilotwin, tmp_path: Path, table: Table
) -> None:
    late = ["--set", "grid.poll_timeout_s=5"]  # no answer is, on a busy machine
    words = ["--can", table.bus, "--join", "--set", "duration_s=3", *late, "-q"]
    done = kilotwin("record", SMALL, *words, "--out", tmp_path / "idle", expect=3)
    assert "none of the modules runs; leave --join out" in done.stderr
    assert not (tmp_path / "idle").exists()
    kilotwin("grid", "setup", SMALL, "--can", table.bus)
    kilotwin("grid", "run", *buses(table))
    other = ["--set", "site.0.width_m=0.2"]
    done = kilotwin("record", SMALL, *words, *other, "--out", tmp_path / "other", expect=3)
    assert "runs with another configuration than this experiment's" in done.stderr
    kilotwin("record", SMALL, *words, "--out", tmp_path / "joined")
    assert json.loads((tmp_path / "joined/manifest.json").read_text())["status"] == "finished"
