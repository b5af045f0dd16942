"""What is recorded changes no result, and a run with little recorded is verified all the same."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from kilotwin.experiment.schema.record import EXTRA_OF

from .conftest import Kilotwin

FEW = (
    *("--set", 'record.columns=["x_m","y_m"]'),
    *("--set", "record.robots_share=0.1"),
    *("--set", "record.robots_s=20"),
    *("--set", "record.precision_m=0.001"),
    *("--set", 'record.also=["messages","motors","battery"]'),
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


DRIVER = """
#include <kilolib.h>
static message_t out;
static uint32_t begin;
static message_t *send(void) { return kilo_ticks - begin > 40 ? &out : 0; }
static void setup(void) {
    begin = kilo_ticks;
    out.crc = message_crc(&out);
}
static void loop(void) {
    uint32_t since = kilo_ticks - begin;
    uint8_t drives = since > 40 && since < 80;
    set_motors(drives ? 70 : 0, drives ? 60 : 0);
}
int main(void) { kilo_init(); kilo_message_tx = send; kilo_start(setup, loop); return 0; }
"""
ALONE = """
name = "alone"
duration_s = 4
[arena]
shape = "circle"
diameter_m = 4
[swarm]
profile = "kilobot"
[battery]
hours = 0.001
[record]
sample_s = 1
also = ["motors", "battery", "messages"]
"""
CPUS = ("native", "translated", "avr")


@pytest.mark.long
def test_motors_battery_and_messages_of_native_translated_and_chip_are_alike(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "driver.c").write_text(DRIVER)
    group = '[[robots]]\nprogram = "driver.c"\ncount = 1\ncpu = "{}"\nposes = [[{}, 0, 0]]\n'
    groups = "".join(group.format(cpu, place) for place, cpu in enumerate(CPUS, start=-1))
    (tmp_path / "alone.toml").write_text(ALONE + groups)
    kilotwin("run", tmp_path / "alone.toml", "--no-twin", "-q", "--out", tmp_path / "run")
    rows = pq.read_table(tmp_path / "run" / "robots.parquet")
    found = {name: np.asarray(rows[name]).reshape(5, 3).astype(int) for name in EXTRA_OF}
    for robot in range(3):  # at 0, 1, 2, 3 and 4 s
        assert found["left_duty"][:, robot].tolist() == [0, 0, 70, 0, 0]
        assert found["right_duty"][:, robot].tolist() == [0, 0, 60, 0, 0]
    assert found["sent"][1].tolist() == [0, 0, 0]
    assert found["sent"][4].min() >= 3
    assert np.ptp(found["sent"], axis=1).max() <= 1
    assert found["received"].max() == 0
    # They were switched on one by one, and begin to drive within three ticks.
    assert np.ptp(found["battery"], axis=1).max() <= 7
    assert np.ptp(found["battery"][3:], axis=1).max() <= 2
    assert np.all(np.diff(found["battery"][:, 0]) < 0)
