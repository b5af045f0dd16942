"""A table of docs whose rows are measured one at a time."""

from pathlib import Path

from tests.kept_table import KeptTable

PAGE = """\
# Page

| name | when | figure |
|---|---|---|
| b | 2026-11-01, 1234567 | 7 |
| gone | never | 0 |

Behind it.
"""


def table(folder: Path) -> KeptTable:
    page = folder / "page"
    page.write_text(PAGE)
    return KeptTable(page, ("name", "when", "figure"))


def test_a_row_that_is_measured_comes_in_its_place_and_others_stay(tmp_path: Path) -> None:
    kept = table(tmp_path)
    kept.put("a", ("now", "a | b"), ["a", "b", "c"])
    text = PAGE.replace("| b |", "| a | now | a / b |\n| b |").replace("| gone | never | 0 |\n", "")
    assert kept.page.read_text() == text
    assert kept.rows() == {"a": ("now", "a / b"), "b": ("2026-11-01, 1234567", "7")}


def test_a_row_that_is_measured_again_is_replaced(tmp_path: Path) -> None:
    kept = table(tmp_path)
    kept.put("b", ("now", "8"), ["b"])
    assert kept.rows() == {"b": ("now", "8")}
