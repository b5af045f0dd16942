"""The order of a log's rows tells how a dispatcher goes round, and how often robots report."""

from pathlib import Path

import numpy as np
import pytest
from tests.truth import dispatcher
from tests.truth.dispatcher import line, polling

from kilotwin.errors import InputError
from kilotwin.table.grid import kilodat
from kilotwin.table.grid.poller import Reports
from kilotwin.units import TICK_S

COLUMNS, ROWS = 10, 20
MODULES = COLUMNS * ROWS


def log(file: Path, round_ticks: float, periods: list[float], *, ticks: int = 30_000) -> Path:
    """A log of robots that stand on modules far apart and report with these periods, polled module
    after module in rounds."""
    rows = []
    for robot, period in enumerate(periods):
        place = MODULES * robot // len(periods)
        for report in np.arange(3.0 * robot, ticks, period):
            turn = np.ceil(report / round_ticks - place / MODULES)
            rows.append(((turn + place / MODULES) * round_ticks, robot, place))
    rows.sort()
    at_ticks, robots, places = (np.array(column) for column in zip(*rows, strict=True))
    data = np.zeros((len(rows), 7), dtype=np.uint8)
    data[:, 0] = robots
    x, y = (places % COLUMNS).astype(np.uint8), (places // COLUMNS).astype(np.uint8)
    writer = kilodat.Writer(file)
    writer.add(Reports(at_ticks * TICK_S, x, y, np.zeros(len(rows), dtype=np.uint8), data))
    writer.close()
    return file


def test_a_round_and_the_robots_intervals_are_found_to_a_fraction_of_a_tick(
    tmp_path: Path,
) -> None:
    periods = [62.0, 63.0, 63.5, 64.3, 65.0, *np.linspace(62.0, 66.0, 35)]
    found = polling(log(tmp_path / "a.kilodat", 20.6, periods))
    assert found.round_ticks == pytest.approx(20.6, rel=0.01)
    assert found.attempts_ticks == pytest.approx(np.array(periods), rel=0.01)
    assert "a round 0.67" in line(tmp_path / "a.kilodat", found)


def test_robots_with_few_reports_have_no_interval(tmp_path: Path) -> None:
    found = polling(log(tmp_path / "a.kilodat", 20.6, [63.0] * 40, ticks=6_000))
    assert len(found.attempts_ticks) == 0
    assert "apart" not in line(tmp_path / "a.kilodat", found)


def test_a_log_that_is_too_short_or_in_another_order_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InputError, match="reports; it takes 200"):
        polling(log(tmp_path / "short.kilodat", 20.6, [63.0], ticks=2_000))
    many = log(tmp_path / "many.kilodat", 20.6, [63.0] * 40)
    head, *rows = many.read_text().splitlines(keepends=True)
    (tmp_path / "backward.kilodat").write_text(head + "".join(reversed(rows)))
    monkeypatch.setattr("sys.argv", ["dispatcher", str(tmp_path / "backward.kilodat")])
    assert dispatcher.main() == 2
    assert "not in the order in which a dispatcher goes round" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["dispatcher", str(many)])
    assert dispatcher.main() == 0
    assert capsys.readouterr().out.startswith("many.kilodat: a round 0.67")
