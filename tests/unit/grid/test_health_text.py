"""`kilotwin grid health`: of all counts those that matter, and what to do about them."""

from kilotwin.table.can.protocol import BusHealth, Health, ModuleState
from kilotwin.table.grid.health_text import counts_text


def health(lost: int = 0, refused: int = 0) -> Health:
    """A module's answer."""
    return Health(ModuleState.IDLE, 4, 0x1234, lost, refused)


def test_counts_that_mean_nothing_are_said_to_mean_nothing() -> None:
    answers = {(x, 0): health() for x in range(3)}
    bus = {module: BusHealth(40, 95, 600 + module[0], 1) for module in answers}
    (line,) = counts_text(answers, bus)
    assert line.startswith("no count matters: no report was lost")


def test_each_count_that_matters_says_what_to_do() -> None:
    answers = {(0, 0): health(lost=7), (1, 0): health(refused=2), (2, 0): health()}
    bus = {
        (0, 0): BusHealth(0, 0, 600, 1),
        (1, 0): BusHealth(96, 0, 600, 1),
        (2, 0): BusHealth(0, 0, 30, 1),
    }
    lines = counts_text(answers, bus)
    assert "module 0-0: 7 reports lost" in lines[0]
    assert "grid.poll_s" in lines[0]
    assert "module 1-0: 2 frames refused" in lines[1]
    assert "module 1-0: 96 CAN errors: see to its plug" in lines[2]
    assert "module 2-0: has power for 30 s, others for 600 s" in lines[3]
    assert lines[4] == "all other counts are of no weight"


def test_a_grid_of_original_modules_has_no_counts() -> None:
    assert counts_text({}, {}) == []
