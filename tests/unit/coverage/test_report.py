"""Coverage, put together over runs and programs, and told in lines and shares."""

import json
from pathlib import Path

import pytest

from kilotwin.programs.coverage import report
from kilotwin.programs.coverage.lines import Source
from kilotwin.programs.coverage.marks import NOT_TAKEN, RAN, TAKEN, merged, understood

ONE = Source({3: True, 4: False, 5: False, 7: True}, {3: [(True, False)]})
OTHER = Source({4: True, 5: False, 9: False}, {3: [(False, True)], 9: [(False, False)]})


def test_marks_of_several_runs_are_what_any_of_them_ran() -> None:
    assert merged([{2: RAN, 4: TAKEN}, {4: NOT_TAKEN}, {}]) == {2: RAN, 4: TAKEN | NOT_TAKEN}


def test_marks_survive_a_message() -> None:
    marks = [{2: RAN, 300: RAN | TAKEN}, {}]
    told = json.loads(json.dumps([list(of_one.items()) for of_one in marks]))
    assert understood(told) == marks


@pytest.mark.parametrize("told", [[1], [[["a", "b"]]], [[[1, 2, 3]]], 5])
def test_what_are_no_marks_is_refused(told: object) -> None:
    with pytest.raises((TypeError, ValueError)):
        understood(told)  # type: ignore[arg-type]


def test_a_file_of_two_programs_has_the_lines_that_either_ran_and_the_branches_of_both() -> None:
    both = report._both(ONE, OTHER)
    assert both.lines == {3: True, 4: True, 5: False, 7: True, 9: False}
    assert both.branches == {3: [(True, False), (False, True)], 9: [(False, False)]}


def test_shares_count_lines_and_ways_out_of_branches() -> None:
    lines, ways = report.shares({Path("a.c"): ONE, Path("b.c"): OTHER})
    assert lines.text("lines") == "3 of 7 lines (43 %)"
    assert ways.text("ways") == "2 of 6 ways (33 %)"
    assert report.Share(0, 0).text("ways") == "0 of 0 ways"


def test_lines_that_have_not_run_are_named_in_ranges() -> None:
    rows = report.text({Path("long.c"): ONE, Path("b.c"): Source({1: True})}).splitlines()
    assert rows == [
        "  long.c  2 of 4 lines (50 %); not 4-5",
        "  b.c     1 of 1 lines (100 %)",
    ]


def test_the_report_is_written_for_other_tools(tmp_path: Path) -> None:
    file = tmp_path / "my.c"
    file.write_text("\n".join(f"line {number};" for number in range(1, 11)))
    told = report.written({file: ONE}, tmp_path / "coverage")
    assert (told["lines"], told["branches"]) == ([2, 4], [1, 2])
    lcov = (tmp_path / "coverage" / report.LCOV).read_text()
    rows = [row.split(",")[:2] for row in lcov.splitlines() if row.startswith("DA:")]
    assert rows == [["DA:3", "1"], ["DA:4", "0"], ["DA:5", "0"], ["DA:7", "1"]]
    (page,) = (tmp_path / "coverage").glob("index.my.c.*.html")
    assert page.read_text().count("uncoveredLine") >= 2
