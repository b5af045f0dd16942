"""What is recorded changes no result, and a run with little recorded is verified all the same."""

import json
from pathlib import Path

import pyarrow.parquet as pq

from .conftest import Kilotwin

FEW = (
    *("--set", 'record.columns=["x_m","y_m"]'),
    *("--set", "record.robots_share=0.1"),
    *("--set", "record.robots_s=20"),
    *("--set", "record.precision_m=0.001"),
)


def test_the_result_is_the_same_whatever_is_recorded(kilotwin: Kilotwin, tmp_path: Path) -> None:
    words = ("experiments/paper/simplified-n50.toml", "--set", "duration_s=100", "--json")
    whole = json.loads(kilotwin("run", *words, "--out", tmp_path / "whole").stdout)
    few = json.loads(kilotwin("run", *words, *FEW, "--out", tmp_path / "few").stdout)
    assert few["result_hash"] == whole["result_hash"]
    sites = [pq.read_table(tmp_path / name / "sites.parquet") for name in ("whole", "few")]
    assert sites[0].equals(sites[1])
    assert (whole["record"]["rows"], few["record"]["rows"]) == (11 * 50, 6 * 5)
    rows = [pq.read_table(tmp_path / name / "robots.parquet").num_rows for name in ("whole", "few")]
    assert rows == [11 * 50, 6 * 5]
    done = json.loads(kilotwin("run", "--verify", tmp_path / "few", "--json").stdout)
    assert (done["same"], done["rows_compared"]) == (True, 6 * 5)
    found = json.loads(kilotwin("check-run", tmp_path / "few", "--json").stdout)
    assert (found["state"], found["rows"]["robots"]) == ("whole", 6 * 5)


def test_a_run_that_records_no_robot_is_verified_by_its_hash(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    words = ("experiments/paper/simplified-n50.toml", "--set", "duration_s=30", "-q")
    kilotwin("run", *words, "--set", "record.robots_count=0", "--out", tmp_path / "run")
    done = json.loads(kilotwin("run", "--verify", tmp_path / "run", "--json").stdout)
    assert (done["same"], done["rows_compared"]) == (True, 0)
    assert done["result_hash"] == done["result_hash_now"]
