"""A table in a page of docs whose rows are measured one at a time: each tells when and at which
commit, and rows that are not measured anew stay as they are.
"""

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class KeptTable:
    """The table of `page` that has these columns. A row's first cell is its name."""

    page: Path
    columns: tuple[str, ...]

    def rows(self) -> dict[str, tuple[str, ...]]:
        """Rows by name, each without it."""
        begin, end = self._place()
        lines = self.page.read_text().splitlines()[begin + 2 : end]
        cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
        return {name: tuple(others) for name, *others in cells}

    def put(self, name: str, cells: Sequence[str], order: Sequence[str]) -> None:
        """Writes one row; rows stand in `order`, and one that it lacks goes."""
        assert len(cells) == len(self.columns) - 1
        rows = {**self.rows(), name: tuple(cell.replace("|", "/") for cell in cells)}
        begin, end = self._place()
        made = [self._line((each, *rows[each])) for each in order if each in rows]
        lines = self.page.read_text().splitlines()
        lines[begin + 2 : end] = made
        self.page.write_text("\n".join(lines) + "\n")

    def _line(self, cells: Sequence[str]) -> str:
        return f"| {' | '.join(cells)} |"

    def _place(self) -> tuple[int, int]:
        """Lines of its head and behind its last row."""
        lines = self.page.read_text().splitlines()
        begin = lines.index(self._line(self.columns))
        end = begin
        while end < len(lines) and lines[end].startswith("|"):
            end += 1
        return begin, end


def now(*, but: KeptTable) -> str:
    """Date and commit, as rows give them: "2026-11-25, 056f8d6".

    "+" behind it: the tree differs from the commit in more than the page of that table.
    """
    head = subprocess.check_output(["git", "rev-parse", "--short=7", "HEAD"], cwd=ROOT, text=True)
    page = but.page.relative_to(ROOT)
    changed = ["git", "status", "--porcelain", "--", ".", f":!{page}"]
    mark = "+" if subprocess.check_output(changed, cwd=ROOT) else ""
    return f"{datetime.now(UTC):%Y-%m-%d}, {head.strip()}{mark}"
