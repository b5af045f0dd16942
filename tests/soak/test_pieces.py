"""Every long test belongs to a piece, and docs/soak.md has a line for each."""

import subprocess
import sys

from tests.kept_table import ROOT

from .pieces import PIECES, piece_of
from .run import TABLE


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
    rows = TABLE.rows()
    assert list(rows) == list(PIECES)
    assert [shows for shows, *_ in rows.values()] == [piece.shows for piece in PIECES.values()]
