"""`kilotwin run --coverage` names the lines of a robot's program that ran, in any robot."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import Kilotwin

PROGRAM = """\
#include <kilolib.h>
#include "colours.h"
void setup(void) {
    if (kilo_uid == 2) set_color(RED);
    if (kilo_uid == 99)
        set_color(GREEN);
}
static uint8_t number(void) {
    switch (kilo_ticks & 3) {
    case 0: return 1;
    case 1: return 0;
    default: return 7;
    }
}
void loop(void) {
    static uint8_t seen;
    if (kilo_ticks > 20 && number() == 0) seen++;
    if (kilo_ticks > 1000)
        set_color(GREEN);
}
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""
EXPERIMENT = """\
duration_s = {duration_s}
[arena]
diameter_m = 1.0
[swarm]
profile = "kilobot"
program = "lines.c"
size = {size}
"""
GRID = "[grid]\ncolumns = 2\nrows = 1\nbuses = 1"


@pytest.fixture
def covered(kilotwin: Kilotwin, tmp_path: Path) -> Callable[..., dict[str, object]]:
    """Runs the program; what --json says."""
    (tmp_path / "lines.c").write_text(PROGRAM)
    (tmp_path / "colours.h").write_text("#define RED RGB(1, 0, 0)\n#define GREEN RGB(0, 1, 0)\n")

    def run(size: int, *options: str, duration_s: int = 3) -> dict[str, object]:
        experiment = tmp_path / "lines.toml"
        experiment.write_text(EXPERIMENT.format(size=size, duration_s=duration_s))
        done = kilotwin(
            "run", str(experiment), "--json", "--out", str(tmp_path / f"run{size}"), *options
        )
        assert done.returncode == 0, done.stderr
        return dict(json.loads(done.stdout))

    return run


def lines_of(folder: Path) -> dict[int, bool]:
    lcov = (folder / "coverage/coverage.info").read_text()
    rows = [row[3:].split(",")[:2] for row in lcov.splitlines() if row.startswith("DA:")]
    return {int(line): count != "0" for line, count in rows}


def test_lines_that_any_robot_ran_are_told_whatever_the_number_of_robots(
    covered: Callable[..., dict[str, object]], tmp_path: Path
) -> None:
    few, many = covered(3, "--coverage"), covered(40, "--coverage")
    lines = lines_of(tmp_path / "run3")
    assert lines == lines_of(tmp_path / "run40")
    # None is number 99, three seconds are 91 ticks, and kilo_start() does not come back.
    assert {line for line, ran in lines.items() if not ran} == {6, 19, 25}
    assert {4, 5, 9, 18} <= lines.keys()
    for told in (few, many):
        assert "lines.c" in str(told["coverage"])
    assert "colours.h" not in str(few["coverage"]), "it has no instructions"


def test_a_run_is_the_same_with_and_without_coverage(
    covered: Callable[..., dict[str, object]],
) -> None:
    with_it = covered(3, "--coverage")
    without = covered(4, "--set", "swarm.cpu=translated", "--set", "swarm.size=3")
    assert with_it["result_hash"] == without["result_hash"]


def test_scenarios_put_together_what_all_their_runs_ran(
    covered: Callable[..., dict[str, object]], kilotwin: Kilotwin, tmp_path: Path
) -> None:
    covered(3)  # writes the program
    expects = '[[expect]]\nshare = "failed == 0"\nat_least = 0.1\nruns = 3\n'
    (tmp_path / "scenario.toml").write_text(EXPERIMENT.format(size=2, duration_s=3) + expects)

    def lines(processes: int) -> dict[int, bool]:
        folder = tmp_path / f"by{processes}"
        words = ("-j", str(processes), "--coverage", str(folder / "coverage"))
        done = kilotwin("test", str(tmp_path / "scenario.toml"), *words)
        assert "lines.c  " in done.stdout, done.stderr
        return lines_of(folder)

    assert lines(1) == lines(2)
    assert not lines(1)[6]


def test_native_programs_of_robots_and_modules_have_lines_by_their_blocks(
    covered: Callable[..., dict[str, object]], kilotwin: Kilotwin, tmp_path: Path
) -> None:
    native = ("--set", "swarm.cpu=native", "--no-twin")
    few, many = (covered(size, "--coverage", *native) for size in (3, 20))
    lines = lines_of(tmp_path / "run3")
    assert lines == lines_of(tmp_path / "run20")
    assert {line for line, ran in lines.items() if not ran} == {6, 19, 25}
    assert "0 of 0 ways out of branches" in str(few["coverage"])
    plain = covered(4, *native, "--set", "swarm.size=3")
    assert few["result_hash"] == plain["result_hash"] != many["result_hash"]

    on_grid = (tmp_path / "lines.toml").read_text().replace("[arena]\ndiameter_m = 1.0", GRID)
    (tmp_path / "grid.toml").write_text(on_grid)
    run = tmp_path / "grid"
    kilotwin("run", tmp_path / "grid.toml", "--coverage", *native, "--out", run, "--json")
    lcov = (run / "coverage/coverage.info").read_text()
    sites = lcov.partition("sites.c\n")[2].partition("end_of_record")[0]
    assert re.search(r"^DA:\d+,1", sites, re.MULTILINE)
    assert re.search(r"^DA:\d+,0", sites, re.MULTILINE)


def test_robots_on_a_chip_are_refused(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (tmp_path / "lines.c").write_text(PROGRAM)
    of_two = 'program = "lines.c"\nsize = 2\n'
    text = EXPERIMENT.format(size=2, duration_s=3).replace(of_two, "")
    kind = '[[robots]]\nprogram = "lines.c"\ncpu = "avr"\ncount = 2\n'
    (tmp_path / "chip.toml").write_text(text + kind)
    done = kilotwin("run", tmp_path / "chip.toml", "--coverage", expect=2)
    assert 'set it to "translated" or "native"' in done.stderr
