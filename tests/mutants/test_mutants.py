"""The faults that `make mutants` plants are in the code, one at a time, and always the same."""

from pathlib import Path

import pytest

from .mutations import mutations
from .run import SHARES, faults_of, key, reasons, sample
from .targets import TARGETS, missing
from .workshop import ROOT

C = """\
// a < b in a comment
static int larger(int a, int b) { return a > b ? a : b; }
int f(const char *text, int n) {
    std::vector<int> list;
    if (n < 3 && text[0] == '<') return 7;
    text = "a + b";
    g(n);
    return !n;
}
"""
C_FAULTS = [
    "if (n <= 3 && text[0] == '<') return 7;",
    "if (n < 3 || text[0] == '<') return 7;",
    "if (n < 3 && text[0] != '<') return 7;",
    "if (n < 6 && text[0] == '<') return 7;",
    "if (n < 3 && text[1] == '<') return 7;",
    "if (n < 3 && text[0] == '<') return 14;",
    "(void)0;",
    "return n;",
]
PYTHON = """\
def f(a: int | None = 0) -> int:
    \"\"\"a < b\"\"\"
    if a is not None and not a:
        call(a + 1)
    return max(a, 2)
"""
PYTHON_FAULTS = [
    "if a is not None or not a:",
    "if a is None and not a:",
    "if a is not None and a:",
    "call(a - 1)",
    "call(a + 2)",
    "pass",
    "return max(a, 4)",
]


@pytest.mark.parametrize(
    ("name", "text", "faults"), [("a.cpp", C, C_FAULTS), ("a.py", PYTHON, PYTHON_FAULTS)]
)
def test_faults_are_in_the_code_and_change_one_place(
    name: str, text: str, faults: list[str], tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    found = mutations(tmp_path, name)
    assert set(faults) <= {fault.after for fault in found}
    for fault in found:
        before, after = text.split("\n"), fault.of(text).split("\n")
        changed = [i for i, line in enumerate(after, 1) if line != before[i - 1]]
        assert changed == [fault.line]
        assert after[fault.line - 1].strip() == fault.after
        assert "a < b" not in fault.text


def test_what_gives_the_same_is_not_planted(tmp_path: Path) -> None:
    (tmp_path / "a.cpp").write_text(C)
    assert not [f for f in mutations(tmp_path, "a.cpp") if "larger" in f.text and f.old == ">"]


def test_every_file_of_the_list_is_there_and_has_faults() -> None:
    assert missing(ROOT) == []
    for target in TARGETS:
        assert mutations(ROOT, target.file), target.file


def test_the_sample_is_always_the_same_and_a_larger_one_has_it_in_it() -> None:
    faults = faults_of(TARGETS)
    small, large = sample(faults, 40, 1), sample(faults, 160, 1)
    assert small == sample(faults, 40, 1)
    assert set(map(key_of, small)) <= set(map(key_of, large))
    assert {target.group for target, _ in small} == set(SHARES)


def key_of(fault: object) -> str:
    return repr(fault)


def test_every_survivor_with_a_reason_is_still_a_fault_that_can_be_planted() -> None:
    planted = {key(fault) for group in faults_of(TARGETS).values() for _, fault in group}
    assert set(reasons()) <= planted
    assert all(len(reason) > 20 for reason in reasons().values())
