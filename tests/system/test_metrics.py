"""docs/metrics.md does what it says: its three programs are measured, run by run and in sweeps."""

import json
import re
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from .conftest import ROOT, Kilotwin

DOCUMENT = (ROOT / "docs/metrics.md").read_text()
PROGRAMS = ("gradient", "synchroniser", "transport")


def blocks(language: str) -> list[str]:
    section = DOCUMENT[DOCUMENT.index("## Three programs") :]
    return re.findall(rf"^```{language}\n(.*?)^```", section, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder per program of the document."""
    folder = tmp_path_factory.mktemp("metrics")
    parts = zip(PROGRAMS, blocks("c"), blocks("toml"), blocks("python"), strict=False)
    for name, program, experiment, analysis in parts:
        (folder / name).mkdir()
        (folder / name / f"{name}.c").write_text(program)
        (folder / name / f"{name}.toml").write_text(experiment)
        (folder / name / "analysis.py").write_text(analysis)
    return folder


def metrics_of(kilotwin: Kilotwin, lab: Path, name: str, *words: str) -> dict[str, Any]:
    out = lab / name / f"run{len(list((lab / name).glob('run*')))}"
    done = kilotwin("run", lab / name / f"{name}.toml", "--out", out, "--json", *words)
    summary = json.loads(done.stdout)
    assert summary["metrics_failed"] == {}
    return {key: metric["value"] for key, metric in summary["metrics"].items()}


def test_each_program_takes_few_lines_to_measure() -> None:
    for experiment, analysis in zip(blocks("toml"), blocks("python"), strict=False):
        metric = experiment[experiment.index("[metric") :] + analysis
        assert len([line for line in metric.splitlines() if line.strip()]) <= 25


def test_a_gradient_reaches_all_and_its_hops_grow_with_its_radius(
    kilotwin: Kilotwin, lab: Path
) -> None:
    found = metrics_of(kilotwin, lab, "gradient")
    assert found["reached"] > 0.9
    assert 0.1 < found["radius"] < 0.4
    assert 2 <= found["hops"] <= 20


def test_a_synchroniser_flashes_together_and_each_robot_has_its_phase(
    kilotwin: Kilotwin, lab: Path
) -> None:
    found = metrics_of(kilotwin, lab, "synchroniser")
    assert found["together"] > 0.7
    (robots,) = (lab / "synchroniser").glob("run*/robots.parquet")
    phases = pq.read_table(robots)["metric_phase"].to_pylist()
    assert len(set(phases)) > 50
    assert max(phases) < 2 * 96


def test_a_transport_moves_its_disc(kilotwin: Kilotwin, lab: Path) -> None:
    found = metrics_of(kilotwin, lab, "transport")
    assert found["away"] > 0.01
    assert found["turns"] > 3
    assert 0 <= found["touching"] <= 30


def test_a_sweep_has_the_metrics_whatever_the_number_of_workers(
    kilotwin: Kilotwin, lab: Path
) -> None:
    (lab / "sweep.toml").write_text(
        'base = "gradient/gradient.toml"\nseeds = 2\nvary.swarm.size = [20, 40]\n'
    )
    for processes in ("1", "2"):
        kilotwin("sweep", lab / "sweep.toml", "-j", processes, "--out", lab / f"s{processes}", "-q")
    trials = pq.read_table(lab / "s1/trials.parquet")
    assert trials.equals(pq.read_table(lab / "s2/trials.parquet"))
    assert pq.read_table(lab / "s1/series.parquet").equals(pq.read_table(lab / "s2/series.parquet"))
    run = metrics_of(kilotwin, lab, "gradient", "--seed", "2", "--set", "swarm.size=20")
    (row,) = (r for r in trials.to_pylist() if r["swarm.size"] == 20 and r["seed"] == 2)
    assert {name: row[f"metric_{name}"] for name in run} == run


def test_a_metric_that_fails_names_its_line_and_costs_itself_alone(
    kilotwin: Kilotwin, lab: Path
) -> None:
    (lab / "gradient/broken.py").write_text(
        "import os\n\n\ndef late(sample):\n"
        "    os.listdir('/')  # the user's own code is not confined\n"
        "    return 1 / (sample.time_s < 10)\n"
    )
    out = lab / "gradient/broken"
    done = kilotwin(
        *("run", lab / "gradient/gradient.toml", "--out", out, "--json"),
        *("--set", "metric.late.function=broken.py:late"),
    )
    summary = json.loads(done.stdout)
    assert list(summary["metrics_failed"]) == ["late"]
    assert "broken.py:6: ZeroDivisionError" in done.stderr
    assert summary["metrics"]["late"]["value"] is None
    assert summary["metrics"]["reached"]["value"] > 0
    column = pq.read_table(out / "sites.parquet")["metric_late"].to_pylist()
    assert column == [1.0] * 10 + [None] * 11
    events = [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]
    assert [event["kind"] for event in events] == ["metric_failed"]


def test_two_variants_are_compared_by_the_document(kilotwin: Kilotwin, lab: Path) -> None:
    """More pull brings the flashes together; equal variants differ by chance alone."""
    (lab / "pull.toml").write_text(
        'base = "synchroniser/synchroniser.toml"\nseeds = 6\n'
        'vary.robots.0.define = [["PULL=8"], ["PULL=9999"]]\n'
    )
    kilotwin("sweep", lab / "pull.toml", "--out", lab / "pull", "-q", "-j", "2")
    sides = ("--a", 'robots.0.define=["PULL=9999"]', "--b", 'robots.0.define=["PULL=8"]')
    both = (lab / "pull", lab / "pull", *sides)
    done = kilotwin("compare", *both, "--metric", "together", "--json")
    (one,) = json.loads(done.stdout)["differences"]
    assert one["trials_a"] == one["trials_b"] == 6
    assert one["difference"]["low"] > 0.1
    assert one["p_corrected"] < 0.05
    done = kilotwin("compare", *both, "--within", "together=0.05", expect=1)
    assert "0.05: outside" in done.stdout
    done = kilotwin("compare", lab / "pull", lab / "pull", "--within", "together=0.5")
    assert "0.5: within" in done.stdout


def test_an_emulated_table_and_its_reports_are_compared_as_cells_saw_them(
    kilotwin: Kilotwin, lab: Path
) -> None:
    words = ("--set", "duration_s=100", "--set", "metric.wide.builtin=spread", "-q")
    kilotwin("run", "experiments/kilogrid/paper-n50.toml", *words, "--out", lab / "table")
    done = kilotwin("compare", lab / "table", lab / "table.kilodat", "--json")
    found = json.loads(done.stdout)
    assert found["sampling"] == ["as its cells saw it"] * 2
    assert "one trial decides nothing" in found["undecided"]
    differences = {one["metric"]: one["difference"]["value"] for one in found["differences"]}
    assert differences.pop("wide") == pytest.approx(0, abs=0.01)
    # Reports of the last second are rounded in a .kilodat.
    assert max(map(abs, differences.values())) <= 3
