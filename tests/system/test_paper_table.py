"""The paper's numbers come out of the general machinery as they stand in docs/reproduce.md."""

import json
import re
from pathlib import Path
from statistics import median

import pytest

from kilotwin.studies.plot.effects import STATISTICS
from kilotwin.studies.plot.presets import PRESETS
from kilotwin.studies.sweep.conditions import Conditions, errors
from kilotwin.studies.sweep.results import Results

from .conftest import ROOT, Kilotwin

TEXT = (ROOT / "docs/reproduce.md").read_text()
TABLE = TEXT[TEXT.index("## Five conditions") :]
ROW = re.compile(
    r"^\| 50 \| ([\d.]+), ([\d.]+) \| [\d /]+ \| (.*?) \| (.*?) \| (.*?) \| (.*?) \|$", re.M
)
ROWS = {(row[0], row[1]): row[2:] for row in ROW.findall(TABLE)}
# Seed 1 of experiments/paper/five-conditions.toml, simplified, N = 50, as it was before the paper's
# parameters were a block of their own: robots on black, on white, nowhere; result_hash.
TRIALS = {
    ("0.1", "0.5"): (31, 19, 0, "0f1e833a9ea284e6"),
    ("0.2", "0.6"): (25, 24, 1, "84ea59261aee9e7f"),
    ("0.3", "0.7"): (36, 13, 1, "bcfe097673a38816"),
    ("0.4", "0.9"): (43, 6, 1, "8626515913b50499"),
    ("0.5", "1.0"): (48, 0, 2, "8c97b8b00fccd5f6"),
}


def settings(informed: str, black: str) -> dict[str, str]:
    shares = {"black": float(black), "white": round(1 - float(black), 1)}
    of_sites = {f"swarm.informed_for.{site}": str(share) for site, share in shares.items()}
    return {"swarm.informed": informed, **of_sites}


def check_trial(kilotwin: Kilotwin, folder: Path, condition: tuple[str, str]) -> None:
    words = [w for key, value in settings(*condition).items() for w in ("--set", f"{key}={value}")]
    few = ("--set", "record.robots_count=0", "--set", "record.sample_s=10", "--out", folder)
    done = kilotwin("run", "experiments/paper/simplified-n50.toml", *words, *few, "--json")
    found = json.loads(done.stdout)
    ended = (*found["resting"].values(), found["not_resting"], found["result_hash"])
    assert ended == TRIALS[condition]


def test_a_trial_of_the_paper_ends_as_it_ever_did(kilotwin: Kilotwin, tmp_path: Path) -> None:
    assert set(TRIALS) == set(ROWS)
    check_trial(kilotwin, tmp_path / "run", ("0.4", "0.9"))


@pytest.mark.long
@pytest.mark.parametrize("condition", TRIALS)
def test_a_row_of_the_papers_table_comes_out_as_it_stands(
    condition: tuple[str, str], kilotwin: Kilotwin, tmp_path: Path
) -> None:
    """Twenty trials; medians, ranges and errors by the general figures and by the paper's own."""
    check_trial(kilotwin, tmp_path / "run", condition)
    bases = [str(ROOT / f"experiments/paper/{rule}-n50.toml") for rule in ("simplified", "firat")]
    lines = [f"base = {json.dumps(bases)}", "seeds = 10", 'name = "row"', "[vary]"]
    lines += [f"{key} = [{value}]" for key, value in settings(*condition).items()]
    (tmp_path / "row.toml").write_text("\n".join(lines))
    kilotwin("sweep", tmp_path / "row.toml", "--out", tmp_path / "row", "-q", timeout_s=3000)
    results, conditions = Results.open(tmp_path / "row"), Conditions.open(tmp_path / "row")
    told = []
    for base in ("simplified-n50", "firat-n50"):
        cells = []
        for site in ("black", "white"):
            wanted = PRESETS[f"paper-median-{site}"].wanted
            column = results.metric(str(wanted.metric))
            keys = [str(wanted.panels), str(wanted.y), str(wanted.x)]
            (rows,) = (rows for key, rows in results.groups(keys).items() if key[0] == base)
            ended = results.at_end(rows, column).tolist()
            assert len(ended) == 10
            cells.append(f"{median(ended):g} ({STATISTICS['iqr'](ended):.3g})")
        rule = base.removesuffix("-n50")
        ((cell, endings),) = conditions.where(rule=rule).items()
        wrong = errors(cell, endings)
        told += [" / ".join(cells), f"{sum(wrong) / len(wrong):.1f}"]
    assert tuple(told) == ROWS[condition]
