"""Fenced blocks of documents are what they say: files load, programs compile, code runs, and
commands exist with their options.

What the tests of a document itself run is left to them; NOT_RUN says what nobody runs, and why.
"""

import os
import re
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.lab_file import read_lab
from kilotwin.experiment.programs import find_program
from kilotwin.programs.native.guest import build
from kilotwin.table.environment.poses import read_line

from .conftest import ROOT, SIMPLIFIED, Kilotwin, block

# Whose blocks are run by tests of their own.
RUN_ELSEWHERE = {
    "README.md": "tests/system/test_docs.py",
    "docs/debugging.md": "tests/system/test_debug.py",
    "docs/experiments.md": "tests/unit/experiment/test_docs.py",
    "docs/metrics.md": "tests/system/test_metrics.py",
    "docs/parameters.md": "tests/system/test_parameters.py",
    "docs/porting.md": "tests/port/test_findings_page.py",
    "docs/python_api.md": "tests/unit/runs/test_world.py",
    "docs/testing.md": "tests/unit/testing/test_plugin.py",
    "docs/why.md": "tests/system/test_why.py",
}
# Blocks without a language: commands, whose words test_docs.py looks up, and what they printed.
NOT_RUN = {
    "docs/avr.md": "waits for a second command; tests/system/test_avr.py speaks avr-gdb's protocol",
    "docs/environment.md": "waits for robots, or for another command; "
    "tests/system/test_record_environment.py types both",
    "docs/hunt.md": "shows what a hunt prints; tests/hunt/test_planted.py hunts",
    "docs/lab.md": "wants a programmer, a table or robots; tests/hardware types them there, and "
    "the tests of `flash`, `robots` and `calibrate` at emulated ones",
}
ARENA = "[arena]\ndiameter_m = 1.0\n"
SWARM = '[swarm]\nprofile = "kilobot"\n'
ONE = '[[robots]]\nprogram = "a.c"\ncount = 1\n'
TABLE = '[grid]\ncolumns = 10\nrows = 10\nprogram = "ModuleMain.c"\n'


class Block(NamedTuple):
    """A fenced block: its place, and what is in it."""

    document: str
    number: int
    language: str
    text: str


def blocks() -> list[Block]:
    """Those of documents without tests of their own."""
    found = []
    for file in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        document = file.relative_to(ROOT).as_posix()
        if document in RUN_ELSEWHERE:
            continue
        fenced = re.findall(r"^```(\w*)\n(.*?)^```", file.read_text(), re.MULTILINE | re.DOTALL)
        found += [Block(document, number, *pair) for number, pair in enumerate(fenced)]
    return found


BLOCKS = blocks()
TOML = [block for block in BLOCKS if block.language == "toml"]

# The beginning that a part of an experiment file lacks.
BEFORE = {
    "docs/avr.md": (ARENA + SWARM, SWARM + ONE),
    "docs/environment.md": (ARENA + SWARM + ONE,),
    "docs/hunt.md": (ARENA + SWARM + ONE,),
    "docs/kilogrid.md": (SWARM + ONE, SWARM + ONE + TABLE),
    "docs/lab.md": (ARENA + SWARM, SWARM + ONE, None, ARENA + ONE),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with all the files that blocks name."""
    for name in ("gradient.hex", "robot.hex"):
        (tmp_path / name).write_text(":00000001FF\n")
    for name in ("a.c", "ModuleMain.c"):
        (tmp_path / name).write_text("int main(void) { return 0; }\n")
    shutil.copy(ROOT / "experiments/environment/pheromone.py", tmp_path)
    shutil.copy(ROOT / "tests/labs/pheromone/arena.kconf", tmp_path)
    (tmp_path / "lab.toml").write_text(of_lab(2).text.replace("[robot.12]", "[robot.1]"))
    return tmp_path


def of_lab(number: int) -> Block:
    return [block for block in TOML if block.document == "docs/lab.md"][number]


def test_each_block_belongs_to_one_test_or_says_why_to_none() -> None:
    run = {"toml", "python", "c", "json"}
    without = [block for block in BLOCKS if block.language not in run]
    assert {block.language for block in without} == {""}
    assert {block.document for block in without} == set(NOT_RUN)
    text = {file: (ROOT / file).read_text() for file in RUN_ELSEWHERE.values()}
    for document, test in RUN_ELSEWHERE.items():
        assert Path(document).name in text[test], document


@pytest.mark.parametrize("block", TOML, ids=lambda block: f"{Path(block.document).stem}")
def test_parts_of_experiments_are_taken(block: Block, folder: Path) -> None:
    if block.document == "docs/sweeps.md":
        return  # a sweep, which runs below
    number = [other for other in TOML if other.document == block.document].index(block)
    before = BEFORE[block.document][number]
    if before is None:
        (folder / "lab.toml").write_text(block.text)
        assert list(read_lab(folder / "lab.toml").robots)[:1] == [12]
        return
    text = block.text
    if "[swarm]" in text:
        text = text.replace("[swarm]", SWARM)
    (folder / "part.toml").write_text(f"duration_s = 300.0\n{before}\n{text}")
    Experiment.load(folder / "part.toml")


@pytest.mark.long
def test_the_sweep_of_the_page_runs_and_its_table_is_read(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    sweep, code = [block for block in BLOCKS if block.document == "docs/sweeps.md"]
    (tmp_path / "sweep.toml").write_text(sweep.text)
    shutil.copy(ROOT / SIMPLIFIED, tmp_path)
    few = ("--seeds", "1", "--set", "duration_s=1", "--set", "swarm.size=10", "-j", "1")
    kilotwin("sweep", "sweep.toml", *few, "--out", "runs/sweep-paper-grid", folder=tmp_path)
    trials = executed(code, tmp_path)["trials"]
    assert len(trials) == 5 * 2 * 2


def test_the_stream_of_a_run_is_read_as_the_quickstart_does(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (code,) = [block for block in BLOCKS if block.document == "docs/quickstart.md"]
    few = ("--set", "duration_s=1", "--set", "swarm.size=10")
    kilotwin("run", SIMPLIFIED, *few, "--out", tmp_path / "runs/first")
    assert executed(code, tmp_path)["robots"].num_rows >= 10


def executed(code: Block, folder: Path) -> dict[str, Any]:
    """The variables that a block of Python leaves, run in a folder."""
    names: dict[str, Any] = {}
    before = Path.cwd()
    os.chdir(folder)
    try:
        exec(compile(code.text, code.document, "exec"), names)
    finally:
        os.chdir(before)
    return names


def test_the_environment_of_the_page_is_a_class_as_its_program_has_it(folder: Path) -> None:
    (code,) = [b for b in BLOCKS if b.document == "docs/environment.md" and b.language == "python"]
    shown = executed(code, folder)
    real: dict[str, Any] = {}
    exec((ROOT / "experiments/environment/pheromone.py").read_text(), real)
    for name in ("__init__", "step"):
        assert (
            getattr(shown["Pheromone"], name).__code__.co_varnames[:3]
            == (getattr(real["Pheromone"], name).__code__.co_varnames[:3])
        )


def test_the_robots_side_of_an_environment_compiles(tmp_path: Path) -> None:
    shutil.copy(ROOT / "experiments/environment/ark.h", tmp_path)
    text = block((ROOT / "docs/environment.md").read_text(), "c")
    start = "kilo_init(); kilo_message_rx = on_message; kilo_start(loop, loop); return 0;"
    (tmp_path / "robot.c").write_text(
        '#include <kilolib.h>\n#include "ark.h"\n'
        f"{text}static void loop(void) {{}}\nint main(void) {{ {start} }}\n"
    )
    assert build(find_program("robot.c", tmp_path)).file.exists()


def test_the_tracker_s_line_is_read() -> None:
    text = block((ROOT / "docs/environment.md").read_text(), "json")
    (robot,) = read_line(text.encode())
    assert (robot.uid, robot.x_m, robot.led) == (7, 0.10, (0, 3, 0))
