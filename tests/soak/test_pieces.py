"""Every long test belongs to a piece, and docs/soak.md has a line for each."""

import subprocess
import sys

from .pieces import PIECES, piece_of
from .run import ROOT, TABLE, row, with_row


def test_every_long_test_belongs_to_a_piece_and_every_piece_has_one() -> None:
    command = [sys.executable, "-m", "pytest", "-q", "--collect-only", "-m", "long"]
    done = subprocess.run(
        [*command, "-p", "no:cacheprovider", "tests"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    tests = [line for line in done.stdout.splitlines() if "::" in line]
    assert len(tests) > 50, done.stdout + done.stderr
    assert [test for test in tests if piece_of(test) is None] == []
    # The tests of SocketCAN in this kernel are collected only where it is.
    assert set(map(piece_of, tests)) == set(PIECES)


def test_the_table_has_a_line_for_each_piece() -> None:
    lines = [line for line in TABLE.read_text().splitlines() if line.startswith("| ")]
    assert {line.split(" | ")[0].removeprefix("| ") for line in lines[1:]} == set(PIECES)


def test_a_piece_that_passes_changes_its_own_line_alone() -> None:
    names = list(PIECES)[:3]
    text = "# Soak\n\n" + "\n".join(map(row, names[:2])) + "\n"
    passed = row(names[0], "2026-11-25", "abc1234", "7 min")
    assert with_row(text, names[0], passed) == text.replace(row(names[0]), passed)
    assert with_row(text, names[2], row(names[2])) == text + row(names[2]) + "\n"
