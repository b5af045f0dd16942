"""docs/metrics.md does what it says: its files are written down, and its commands are typed."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from .conftest import ROOT, Kilotwin

DOCUMENT = (ROOT / "docs/metrics.md").read_text()
PROGRAMS = ("gradient", "synchroniser", "transport")
FILE = re.compile(r"^```\w+\n((?://|#) (\S+\.\w+)\n.*?)^```", re.MULTILINE | re.DOTALL)
FILES = {name: text for text, name in FILE.findall(DOCUMENT)}
SECTIONS: dict[str, str] = dict(
    re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", DOCUMENT, re.MULTILINE | re.DOTALL)
)


def lines_of(text: str) -> list[list[str]]:
    """The shell lines of a part of the page, as words behind `kilotwin`."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    typed = [shlex.split(line, comments=True) for block in blocks for line in block.splitlines()]
    assert typed
    assert {words[0] for words in typed} == {"kilotwin"}
    return [words[1:] for words in typed]


def part_about(program: str) -> str:
    part = SECTIONS["Three programs"].split("\nA **")
    return next(text for text in part if text.startswith(program))


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the page's commands are typed."""
    folder = tmp_path_factory.mktemp("metrics")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    (folder / "experiments").symlink_to(ROOT / "experiments")
    return folder


def metrics_of(kilotwin: Kilotwin, lab: Path, name: str, *words: str) -> dict[str, Any]:
    out = lab / name / f"run{len(list((lab / name).glob('run*')))}"
    done = kilotwin("run", lab / name / f"{name}.toml", "--out", out, "--json", *words)
    summary = json.loads(done.stdout)
    assert summary["metrics_failed"] == {}
    return {key: metric["value"] for key, metric in summary["metrics"].items()}


def test_every_block_is_a_file_or_commands_or_part_of_a_file() -> None:
    whole = re.findall(r"^```(\w*)\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    others = [text for language, text in whole if language != "sh" and text not in FILES.values()]
    assert len(others) == 1  # the first one, which shows what a metric is
    words = {line for line in others[0].splitlines() if "meaning" not in line}
    assert words <= set(FILES["gradient/gradient.toml"].splitlines()) | {""}
    assert not re.findall(r"^    kilotwin", DOCUMENT, re.MULTILINE)


@pytest.mark.parametrize("program", PROGRAMS)
def test_each_program_takes_few_lines_to_measure(program: str) -> None:
    experiment = FILES[f"{program}/{program}.toml"]
    metric = experiment[experiment.index("[metric") :]
    (sweep,) = (
        text
        for name, text in FILES.items()
        if name.startswith(program) and text.count("seeds =") == 1
    )
    written = metric + sweep + FILES[f"{program}/analysis.py"]
    lines = [line for line in written.splitlines() if line.strip() and not line.startswith("#")]
    assert len(lines) <= 25
    for kind in ("builtin", "function", "variable"):
        assert kind in metric


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


def test_a_variable_is_read_at_thousands_of_samples(kilotwin: Kilotwin, lab: Path) -> None:
    """The engine stands still at each; what it may go at most between them once grew for ever."""
    words = ("--set", "record.sample_s=0.04", "--set", "duration_s=80", "--set", "swarm.size=2")
    found = metrics_of(kilotwin, lab, "gradient", *words, "--set", "record.robots_count=0")
    assert found["hops"] is not None


def test_two_variants_are_compared_by_the_document(kilotwin: Kilotwin, lab: Path) -> None:
    """More pull brings the flashes together; equal variants differ by chance alone."""
    sweep, plot, compare = lines_of(part_about("synchroniser"))
    kilotwin(*sweep, "-q", "-j", "2", folder=lab)
    kilotwin(*plot, folder=lab)
    done = kilotwin(*compare, "--metric", "together", "--json", folder=lab)
    (one,) = json.loads(done.stdout)["differences"]
    assert one["trials_a"] == one["trials_b"] == 6
    assert one["difference"]["low"] > 0.1
    assert one["p_corrected"] < 0.05
    done = kilotwin(*compare, "--within", "together=0.05", expect=1, folder=lab)
    assert "0.05: outside" in done.stdout
    both = ("compare", "runs/sweep-pull", "runs/sweep-pull")
    done = kilotwin(*both, "--within", "together=0.5", folder=lab)
    assert "0.5: within" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize("program", ["gradient", "transport"])
def test_the_commands_of_a_program_run(program: str, kilotwin: Kilotwin, lab: Path) -> None:
    sweep, plot, compare = lines_of(part_about(program))
    kilotwin(*sweep, "-q", folder=lab)
    kilotwin(*plot, folder=lab)
    assert (lab / f"{program}.png").stat().st_size > 1000
    found = json.loads(kilotwin(*compare, "--json", folder=lab).stdout)
    assert not found.get("undecided")
    assert {one["trials_a"] for one in found["differences"]} == {6}


@pytest.mark.long
def test_the_other_commands_run_one_after_the_other(kilotwin: Kilotwin, lab: Path) -> None:
    for section in ("Figures", "A against B", "The best values, and the keys that matter"):
        for words in lines_of(SECTIONS[section]):
            kilotwin(*words, folder=lab)
            if "-o" in words:
                assert (lab / words[words.index("-o") + 1]).stat().st_size > 1000


def test_the_walkthrough_runs_shortened(kilotwin: Kilotwin, lab: Path) -> None:
    (search,) = lines_of(SECTIONS["A walkthrough"])
    short = ("--set", "duration_s=60", "--points", "2", "--repeats", "1", "--confirm", "0")
    found = json.loads(kilotwin(*search, *short, "--json", folder=lab).stdout)
    assert len(found["tried"]) == 2
    assert all(0 <= one["means"][0] <= 25 for one in found["tried"])


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
