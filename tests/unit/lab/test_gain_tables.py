"""Tables of readings at known distances, and the distances that robots make of them."""

import pytest

from kilotwin.files.headers import GAIN_DISTANCES_MM
from kilotwin.table.lab.gain_tables import (
    GainTables,
    errors_mm,
    fitted,
    mean_of,
    reach_mm,
    tables_of,
)
from kilotwin.table.links.robot_link import Gains

LOW = tuple(900 - 60 * entry for entry in range(14))
HIGH = tuple(1023 if entry < 5 else 1000 - 70 * (entry - 5) for entry in range(14))


def readings(low: tuple[int, ...], high: tuple[int, ...]) -> dict[int, list[Gains]]:
    """One at each distance of the tables."""
    return {mm: [Gains(*gains)] for mm, *gains in zip(GAIN_DISTANCES_MM, low, high, strict=True)}


def low_of(low: list[int]) -> tuple[int, ...]:
    """The low gain's table, of these readings."""
    tables = fitted(readings(tuple(low), HIGH))
    assert tables is not None
    return tables.low


def test_distances_are_those_of_the_tables() -> None:
    assert GAIN_DISTANCES_MM == (33, 38, 43, 48, 53, 58, 63, 68, 73, 78, 83, 88, 93, 98)


def test_readings_without_noise_are_the_tables() -> None:
    assert fitted(readings(LOW, HIGH)) == GainTables(LOW, HIGH)


def test_stray_readings_do_not_count() -> None:
    strayed = {
        mm: [*some * 6, Gains(1023, 1023), Gains(0, 0)] for mm, some in readings(LOW, HIGH).items()
    }
    assert fitted(strayed) == GainTables(LOW, HIGH)


def test_neighbours_that_rise_become_their_mean() -> None:
    low = [*LOW]
    low[6], low[7] = 420, 520
    assert low_of(low)[6:8] == (470, 470)
    low[5] = 460
    assert low_of(low)[5:8] == (467, 467, 467)


def test_tables_tell_the_distances_that_they_were_made_at() -> None:
    tables = GainTables(LOW, HIGH)
    for mm, some in readings(LOW, HIGH).items():
        assert tables.estimates_mm(some) == [mm]
    assert not errors_mm(tables, readings(LOW, HIGH)).any()


def test_an_error_is_above_0_if_the_estimate_is_too_far() -> None:
    tables = GainTables(LOW, HIGH)
    weak = {40: [tables.entry(3)]}
    assert list(errors_mm(tables, weak)) == [8]


def test_one_table_for_all_is_the_mean() -> None:
    brighter = GainTables(tuple(gain + 11 for gain in LOW), HIGH)
    assert mean_of([GainTables(LOW, HIGH), brighter]).low[0] == 906


@pytest.mark.parametrize("erased", [Gains(0xFFFF, 0xFFFF), Gains(900, 0xFFFF)])
def test_an_erased_eeprom_holds_no_tables(erased: Gains) -> None:
    tables = GainTables(LOW, HIGH)
    entries = [tables.entry(index) for index in range(14)]
    assert tables_of(entries) == tables
    assert tables_of([*entries[:13], erased]) is None


def test_entries_beyond_the_partners_reach_go_on_falling() -> None:
    low = tuple(round(900 * 0.8**entry) for entry in range(14))
    high = tuple(min(5 * gain, 1023) for gain in low)
    near = {mm: some for mm, some in readings(low, high).items() if mm <= 83}
    assert reach_mm(near) == 83
    tables = fitted(near)
    assert tables is not None
    assert tables.low[:11] == low[:11]
    assert tables.low[11:] == pytest.approx(low[11:], abs=1)
    assert tables.high[11:] == pytest.approx(high[11:], abs=4)


@pytest.mark.parametrize("lost", [33, 58, 78])
def test_tables_that_lack_a_near_distance_are_none(lost: int) -> None:
    gap = {mm: [] if mm == lost else some for mm, some in readings(LOW, HIGH).items()}
    assert fitted(gap) is None
