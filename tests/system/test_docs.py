"""The documents cannot lie: README's example runs as printed, and every link leads somewhere."""

import json
import re
from pathlib import Path

import pytest

from .conftest import ROOT, Kilotwin, block

DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_example_of_the_readme_runs(kilotwin: Kilotwin, tmp_path: Path) -> None:
    readme = (ROOT / "README.md").read_text()
    (tmp_path / "my.c").write_text(block(readme, "c"))
    (tmp_path / "my.toml").write_text(block(readme, "toml"))
    done = kilotwin("run", tmp_path / "my.toml", "--out", tmp_path / "run", "--json")
    result = json.loads(done.stdout)
    assert result["robots"] == 10
    events = (tmp_path / "run/events.jsonl").read_text().splitlines()
    assert [line for line in events if json.loads(line).get("kind") in {"crash", "endless"}] == []
    kilotwin("plot", "map", tmp_path / "run", "-o", tmp_path / "my.png")
    assert (tmp_path / "my.png").stat().st_size > 0


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_files(document: Path) -> None:
    links = re.findall(r"\]\((?!https?://)([^)#]+)", document.read_text())
    assert [link for link in links if not (document.parent / link).exists()] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_files_that_are_named_exist(document: Path) -> None:
    """A path in backquotes that begins with a folder of the tree must be there."""
    folders = "firmware|emulator|host_tools|kilogrid_modules|experiments|tests|docs"
    named = re.findall(rf"`((?:{folders})/[\w./-]*)`", document.read_text())
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_life_of_a_message_names_functions_of_those_files() -> None:
    overview = (ROOT / "docs/code_overview.md").read_text()
    hops = re.findall(r"^\| \d+ \| `([\w/.]+)` \| (.*) \|$", overview, re.MULTILINE)
    assert len(hops) > 10
    for file, what in hops:
        pair = (ROOT / file).parent.glob(f"{Path(file).stem}.*")
        source = "".join(path.read_text() for path in pair)
        names = re.findall(r"`(\w+)(?:\(\))?`", what)
        missing = [name for name in names if not re.search(rf"\b{name}\b", source)]
        assert missing == [], file


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_make_targets_that_are_named_exist(document: Path) -> None:
    targets = set(re.findall(r"^## (\S+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:`|^    )make ([\w-]+)", document.read_text(), re.MULTILINE))
    assert named <= targets
