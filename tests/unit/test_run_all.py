"""`make test` runs each test that is not long once, in one of its pools."""

from pathlib import Path

import pytest
from tests.run_all import POOLS, Count, read_failures, read_junit


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize("waits", [False, True])
def test_a_test_is_in_one_pool_or_is_long(long: bool, waits: bool) -> None:
    # As a Python expression `pytest -m` reads what it is given, of marks for names.
    marks = {"long": long, "waits": waits}
    chosen = [pool for pool, (marked, _) in POOLS.items() if eval(marked, dict(marks))]
    assert chosen == ([] if long else ["waits" if waits else "computes"])


def test_what_did_not_run_well_is_no_pass(tmp_path: Path) -> None:
    """ctest says disabled, pytest says errors."""
    report = tmp_path / "report.xml"
    assert read_junit(report) == Count(0, 0, 0)
    report.write_text(
        '<testsuites><testsuite tests="9" failures="1" errors="2" skipped="1"/>'
        '<testsuite tests="3" failures="0" disabled="1"/></testsuites>'
    )
    assert read_junit(report) == Count(passed=7, failed=3, skipped=2)


def test_failures_are_named_with_the_first_line_of_why(tmp_path: Path) -> None:
    """As pytest writes them (a failed test, a broken fixture), and as ctest does."""
    report = tmp_path / "report.xml"
    assert read_failures(report) == []
    report.write_text(
        '<testsuite><testcase classname="tests.unit.test_x" name="test_a"/>'
        '<testcase classname="tests.unit.test_x" name="test_b[1]">'
        '<failure message="assert 1 == 2&#10; +  where">at length</failure></testcase>'
        '<testcase classname="tests.unit.test_x" name="test_c"><error message="no room"/>'
        "</testcase>"
        '<testcase classname="grid.host" name="grid.host"><failure message=""/></testcase>'
        "</testsuite>"
    )
    assert read_failures(report) == [
        "tests.unit.test_x::test_b[1]: assert 1 == 2",
        "tests.unit.test_x::test_c: no room",
        "grid.host: ",
    ]
