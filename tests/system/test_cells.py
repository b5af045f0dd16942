"""Lights of cells of a lab's own module program, recorded and as the page gets them."""

import itertools
from pathlib import Path

import pytest

from kilotwin.runs.reader import Run
from kilotwin.view.served_run import ServedRun

from .conftest import ROOT, Kilotwin

RED, GREEN = 1, 2
# Its top left cell is red from 8.4 s on, before and behind that all are green.
PROGRAM = """
#include "module.h"
#include "moduleLED.h"
static void setup(void) {}
static void loop(void) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        const color_t then = cell == 0 ? RED : LED_OFF;
        set_LED(cell, module_ticks % 512 < 256 ? then : GREEN);
    }
}
int main(void) {
    module_init();
    module_start(setup, loop);
    return 0;
}
"""
TABLE = f"""
name = "lit"
duration_s = 16
[grid]
columns = 2
rows = 1
buses = 1
program = "lit.c"
[swarm]
profile = "kilobot"
program = "{ROOT}/tests/system/programs/reporter.c"
size = 1
"""


@pytest.fixture(scope="module")
def run(kilotwin: Kilotwin, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cells")
    (folder / "lit.c").write_text(PROGRAM)
    (folder / "lit.toml").write_text(TABLE)
    kilotwin("run", folder / "lit.toml", "--out", folder / "run", "-q")
    return folder / "run"


def test_a_row_is_written_when_a_cell_shows_something_else(run: Path) -> None:
    rows = Run.open(run).cells().to_pylist()
    by_cell: dict[int, list[int]] = {row["cell"]: [] for row in rows}
    for row in rows:
        by_cell[row["cell"]].append(row["colour"])
    assert sorted(by_cell) == list(range(8))
    for colours in by_cell.values():
        assert all(one != other for one, other in itertools.pairwise(colours))
    # Cells go row by row from below: the upper left ones are the fifth and the seventh.
    assert {cell for cell, colours in by_cell.items() if RED in colours} == {4, 6}


def test_the_page_gets_what_is_lit_at_a_time(run: Path) -> None:
    served = ServedRun(Run.open(run))
    assert served.scene()["grid"]["recorded"] is True
    shown = {time_s: served.cells(time_s) for time_s in (4.0, 12.0)}
    lit = [{(cell, colour) for cell, colour, _ in cells} for cells in shown.values()]
    assert {(4, RED), (6, RED)} in lit
    assert {(cell, GREEN) for cell in range(8)} in lit
    assert served.cells(-1.0) == []


def test_cells_of_our_program_are_known_without_a_table(kilotwin: Kilotwin, tmp_path: Path) -> None:
    small = "tests/system/grid_small.toml"
    kilotwin("run", small, "--set", "duration_s=1", "--out", tmp_path / "run", "-q", folder=ROOT)
    assert not (tmp_path / "run/cells.arrows").exists()
    served = ServedRun(Run.open(tmp_path / "run"))
    assert served.scene()["grid"]["recorded"] is False
    assert served.cells(1.0) == []
