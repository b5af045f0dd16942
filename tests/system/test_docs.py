"""The documents cannot lie: README's example runs as printed, and every link leads somewhere."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kilotwin.commands import cli

from .conftest import ROOT, SIMPLIFIED, Kilotwin, block

DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

LAB_TESTS = ROOT / "docs/maintaining.md"
HARDWARE = re.compile(r"test_(\d\d)_")


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


def test_make_run_makes_the_picture_of_the_readme(kilotwin: Kilotwin, tmp_path: Path) -> None:
    """And the caption says what came of it. Fonts and edges may differ a little."""
    makefile = (ROOT / "Makefile").read_text()
    (words,) = re.findall(
        r"^\t@.*/kilotwin run \$\(PAPER\)(.*) --out \$\(RUN\) --plots$", makefile, re.M
    )
    assert re.findall(r"^PAPER +:= (\S+)$", makefile, re.M) == [SIMPLIFIED]
    done = kilotwin(
        "run", SIMPLIFIED, *words.split(), "--out", tmp_path / "run", "--plots", "--json"
    )
    result = json.loads(done.stdout)
    came = [result["resting"][site] for site in ("black", "white")]
    readme = " ".join((ROOT / "README.md").read_text().split())
    assert f"this run ended with {came[0]} and {came[1]}" in readme
    made, shown = (
        np.asarray(Image.open(file).convert("RGB").resize((300, 240)), dtype=int)
        for file in (tmp_path / "run/map.png", ROOT / "docs/images/map.png")
    )
    assert np.abs(made - shown).mean() < 1


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


def commands_in(document: Path) -> list[list[str]]:
    """Commands that a document types, as words behind `kilotwin`.

    A line begins with it, or it comes after a prompt or in backquotes.
    """
    text = re.sub(r"\\\n\s*", "", document.read_text())
    lines = re.findall(r"^\s*(?:\$ )?(?:\.venv/bin/)?kilotwin ([^#\n]+)", text, re.MULTILINE)
    return [line.split() for line in lines + re.findall(r"`kilotwin ([^`]+)`", text)]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_commands_that_are_shown_exist_with_their_options(document: Path) -> None:
    for name, *words in commands_in(document):
        if name == "--version":
            continue
        commands = [cli.load(name)]
        if hasattr(commands[0], "commands") and words and re.match(r"[a-z]", words[0]):
            commands = [commands[0].commands[word] for word in words[0].split("|")]
        given = {word.split("=")[0] for word in words if re.match(r"--?[a-zA-Z]", word)}
        for command in commands:
            known = {option for parameter in command.params for option in parameter.opts}
            assert given <= known, (name, words)


def test_most_documents_show_commands() -> None:
    assert sum(len(commands_in(document)) for document in DOCUMENTS) > 250


def test_the_page_of_maintainers_lists_every_hardware_test_and_what_it_proves() -> None:
    proofs = {}
    for file in sorted((ROOT / "tests/hardware").glob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef) and (number := HARDWARE.match(node.name)):
                assert number[1] not in proofs, "numbers are given once"
                proofs[number[1]] = ast.get_docstring(node)
    rows = re.findall(r"^\| (\d\d) \| (.*?) \| .* \|$", LAB_TESTS.read_text(), re.MULTILINE)
    assert dict(rows) == proofs


def test_hardware_tests_are_left_out_unless_they_are_wanted() -> None:
    def collected(*words: str) -> str:
        command = [sys.executable, "-m", "pytest", "tests/hardware", "--collect-only", "-q", *words]
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        return run.stdout.splitlines()[-1]

    tests = len(re.findall(r"^\| \d\d \| ", LAB_TESTS.read_text(), re.MULTILINE))
    assert collected().startswith(f"no tests collected ({tests} deselected)")
    assert collected("--hardware").startswith(f"{tests} tests collected")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_make_targets_that_are_named_exist(document: Path) -> None:
    targets = set(re.findall(r"^## (\S+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:`|^    )make ([\w-]+)", document.read_text(), re.MULTILINE))
    assert named <= targets
