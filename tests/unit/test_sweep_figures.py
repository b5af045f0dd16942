"""Figures of a sweep are drawn of any grid of conditions, holes included."""

import itertools
from pathlib import Path

import pytest
from matplotlib.text import Text

from kilotwin.errors import InputError
from kilotwin.plot import SWEEP_FIGURES, style, write_figure
from kilotwin.sweep.conditions import Condition, Conditions, Ending

TWO, THREE = ("black", "white"), ("black", "white", "red")


def grid(rules: tuple[str, ...] = ("simplified", "firat")) -> dict[Condition, list[Ending]]:
    endings = {}
    for rule, robots, informed, share in itertools.product(
        rules, (50, 100), (0.1, 0.3), (0.5, 0.8, 1.0)
    ):
        condition = Condition(rule, robots, informed, (share, round(1 - share, 1)))
        black = round(robots * share)
        endings[condition] = [Ending((black - n, robots - black), n) for n in range(3)]
    return endings


def nobody_informed(rule: str) -> dict[Condition, list[Ending]]:
    return {Condition(rule, 100, 0.0, (0.0, 0.0)): [Ending((90, 5), 5), Ending((40, 50), 10)]}


def texts(figure: str, endings: dict[Condition, list[Ending]], sites: tuple[str, ...]) -> str:
    """Draws, and returns all that is written on it, with plain spaces."""
    trials = Conditions("made up", sites, endings)
    drawn = style.draw(lambda: SWEEP_FIGURES[figure](trials))
    drawn.canvas.draw()
    written = (found.get_text() for found in drawn.findobj(Text) if isinstance(found, Text))
    return "\n".join(written).replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize("figure", ["median", "iqr"])
def test_a_map_is_drawn_for_each_site_controller_and_size(figure: str) -> None:
    written = texts(figure, grid(), TWO)
    for rule, robots, site in itertools.product(("simplified", "firat"), (50, 100), TWO):
        assert f"{rule}, N = {robots}\nsite {site}" in written
    assert "share of informed for black" in written
    assert "robots" in written


def test_the_median_stands_in_its_cell() -> None:
    one = Condition("simplified", 50, 0.1, (0.5, 0.5))
    written = texts("median", {one: [Ending((20, 3), 27), Ending((41, 3), 6)]}, TWO)
    assert "30.5" in written.split("\n")


def test_arenas_with_other_sites_have_maps_of_their_own() -> None:
    endings = {
        Condition("simplified", 100, 0.2, (0.5, 0.3, 0.2), THREE): [Ending((50, 30, 20), 0)],
        Condition("firat", 100, 0.2, (0.5, 0.5), TWO): [Ending((50, 50), 0)],
    }
    written = texts("median", endings, THREE)
    assert "simplified, N = 100\nsite red of 3" in written
    assert "firat, N = 100\nsite black of 2" in written
    assert written.count("\nsite ") == 5
    assert "wanted: black 0.5, white 0.3,\nred 0.2" in texts("error", endings, THREE)


def test_the_symmetry_figure_counts_runs_with_one_aggregate() -> None:
    written = texts("symmetry", nobody_informed("simplified") | nobody_informed("firat"), TWO)
    assert "simplified, N = 100: one aggregate in 1 of 2" in written
    assert "robots resting on the site at the end" in written


def test_the_error_figure_has_a_panel_per_size_and_split() -> None:
    written = texts("error", grid(), TWO)
    assert written.count("wanted: black 0.8, white 0.2") == 2
    assert "N = 50\nerror (robots per site)" in written


@pytest.mark.parametrize(
    ("figure", "endings", "says"),
    [
        ("median", nobody_informed("firat"), "no trial with informed robots"),
        ("error", nobody_informed("firat"), "no trial with informed robots"),
        ("iqr", nobody_informed("firat"), "no trial with informed robots"),
        ("symmetry", grid(), "no trial with nobody informed"),
    ],
)
def test_what_cannot_be_drawn_is_told(
    figure: str, endings: dict[Condition, list[Ending]], says: str
) -> None:
    with pytest.raises(InputError, match=says):
        texts(figure, endings, TWO)


def test_a_folder_that_is_no_sweep_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a sweep's folder"):
        write_figure("median", tmp_path, tmp_path / "x.png")


def test_the_error_figure_names_rules_that_its_first_panel_lacks() -> None:
    some = {c: e for c, e in grid().items() if c.rule == "firat" or c.shares[0] > 0.5}
    written = texts("error", some, TWO).split("\n")
    assert {"simplified", "firat"} <= set(written)
