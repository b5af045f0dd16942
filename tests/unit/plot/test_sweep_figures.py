"""Figures of a sweep are drawn of any grid of conditions, holes included."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from kilotwin.errors import InputError
from kilotwin.studies.plot import style
from kilotwin.studies.plot.figures import SWEEP_FIGURES, write_figure
from kilotwin.studies.plot.heat_map import value_labels
from kilotwin.studies.plot.style import MOST_LINES, line_look, trials_note
from kilotwin.studies.plot.sweep import bar_edges, error_panels, quartile_range, site_cells
from kilotwin.studies.sweep.conditions import Condition, Conditions, Ending

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


def drawn(
    figure: str, endings: dict[Condition, list[Ending]], sites: tuple[str, ...] = TWO
) -> Figure:
    trials = Conditions("made up", sites, endings)
    found = style.draw(lambda: SWEEP_FIGURES[figure](trials))
    found.canvas.draw()
    return found


def written_on(artist: Figure | Axes) -> str:
    """All that is written on it, with plain spaces."""
    written = (found.get_text() for found in artist.findobj(Text) if isinstance(found, Text))
    return "\n".join(written).replace("\N{NO-BREAK SPACE}", " ")


def texts(figure: str, endings: dict[Condition, list[Ending]], sites: tuple[str, ...]) -> str:
    return written_on(drawn(figure, endings, sites))


@pytest.mark.parametrize("figure", ["median", "iqr"])
def test_a_map_is_drawn_for_each_site_controller_and_size(figure: str) -> None:
    written = texts(figure, grid(), TWO)
    for rule, robots, site in itertools.product(("simplified", "firat"), (50, 100), TWO):
        assert f"{rule}, N = {robots}\nsite {site}" in written
    assert "share of informed for black" in written
    assert "robots" in written


@pytest.mark.parametrize("figure", ["median", "iqr", "symmetry", "error"])
def test_a_figure_says_that_trials_are_lacking(figure: str) -> None:
    trials = Conditions("made up", TWO, grid() | nobody_informed("firat"), "70 of 80 trials")
    lacking = style.draw(lambda: SWEEP_FIGURES[figure](trials))
    assert "70 of 80 trials" in written_on(lacking)


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


def split_grid(*splits: tuple[float, float]) -> dict[Condition, list[Ending]]:
    return {
        Condition("simplified", 100, informed, shares): [Ending((60, 30), 10), Ending((50, 50), 0)]
        for shares in splits
        for informed in (0.1, 0.2)
    }


def test_every_panel_of_the_error_figure_has_data_and_each_n_one_scale() -> None:
    endings = split_grid(*((n / 10, round(1 - n / 10, 1)) for n in range(8)))
    endings[Condition("simplified", 50, 0.1, (0.5, 0.5))] = [Ending((0, 0), 50), Ending((9, 1), 40)]
    panels = drawn("error", endings).axes
    assert len(panels) == 9
    assert [axes for axes in panels if not axes.has_data()] == []
    assert len({axes.get_ylim() for axes in panels[1:]}) == 1
    assert panels[0].get_ylim() != panels[1].get_ylim()
    below = [axes.get_xlabel() for axes in panels]
    assert below == 3 * [""] + 6 * ["share informed"]
    beside = [axes.get_ylabel().partition("\n")[0] for axes in panels]
    assert beside == ["N = 50", "N = 100", *5 * [""], "N = 100", ""]


def test_few_splits_have_a_column_each_and_many_run_on() -> None:
    few = split_grid((0.5, 0.5), (0.7, 0.3))
    few[Condition("firat", 50, 0.1, (0.7, 0.3))] = []
    assert error_panels(few) == {
        (0, 1): (50, (TWO, (0.7, 0.3))),
        (1, 0): (100, (TWO, (0.5, 0.5))),
        (1, 1): (100, (TWO, (0.7, 0.3))),
    }
    many = split_grid(*((n / 10, 1.0) for n in range(7)))
    many[Condition("firat", 200, 0.1, (0.6, 1.0))] = []
    assert list(error_panels(many)) == [*((0, column) for column in range(6)), (1, 0), (2, 0)]


def test_the_rules_of_the_error_figure_stand_beside_its_panels_and_differ() -> None:
    rules = tuple(f"_rule {number}" for number in range(MOST_LINES))
    figure = drawn("error", grid(rules))
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} == set(rules)
    left = min(line.get_window_extent().x0 for line in legend.get_lines())
    assert max(axes.get_window_extent().x1 for axes in figure.axes) < left
    looks = [line_look(place) for place in range(MOST_LINES)]
    assert len({(look["marker"], look["mfc"]) for look in looks}) == MOST_LINES
    assert len({(look["color"], look["ls"]) for look in looks}) == MOST_LINES
    assert len({(look["color"], look["marker"]) for look in looks}) == MOST_LINES


def test_more_rules_than_can_be_told_apart_are_refused() -> None:
    rules = tuple(f"rule {number:02}" for number in range(MOST_LINES + 1))
    with pytest.raises(InputError, match=r"13 controllers.* tell 12 apart.*--where rule=rule 00"):
        drawn("error", grid(rules))
    uninformed = {c: e for rule in rules[1:] for c, e in nobody_informed(rule).items()}
    drawn("error", grid(rules[:1]) | uninformed)


def test_a_picture_too_large_to_look_at_is_refused() -> None:
    rules = tuple(f"rule {number:02}" for number in range(20))
    with pytest.raises(
        InputError, match=r"117 by 6 inches, and 100 is the most.*--where rule=rule"
    ):
        drawn("median", grid(rules))


@pytest.mark.parametrize(
    ("shares", "labels"),
    [
        ([0.5, 1.0, 0.05, 0.0], ["0.5", "1", "0.05", "0"]),
        ([1 / 3, 0.125], ["0.333", "0.125"]),
        ([0.4318, 0.4319], ["0.4318", "0.4319"]),
        ([0.3, 0.1 + 0.2], ["0.3", "0.3"]),
    ],
)
def test_shares_have_few_digits_but_enough_to_differ(
    shares: list[float], labels: list[str]
) -> None:
    assert [value_labels(shares)[share] for share in shares] == labels


@pytest.mark.parametrize("side", [3, 12, 41])
def test_cells_have_room_for_what_is_written_in_and_beside_them(side: int) -> None:
    shares = [round((n + 1) / (side + 1), 4) for n in range(side)]
    endings = {
        Condition("simplified", 1000, informed, (share, 1 - share)): [
            Ending((123, 877), 0),
            Ending((124, 876), 0),
        ]
        for informed in shares
        for share in shares
    }
    figure = drawn("median", endings)
    axes = figure.axes[0]
    assert len(axes.texts) == (side * side if side <= 40 else 0)
    for ticks in (axes.get_xticklabels(), axes.get_yticklabels(), axes.texts[:side]):
        boxes = [tick.get_window_extent() for tick in ticks]
        assert [a for a, b in itertools.pairwise(boxes) if a.overlaps(b)] == []


def test_the_number_of_trials_is_told_and_cells_without_any() -> None:
    assert trials_note([20, 20], "cell", "range") == "20 trials a cell"
    assert (
        trials_note([20, 1], "cell", "range") == "1 to 20 trials a cell; one trial gives no range"
    )
    assert trials_note([1], "cell") == "1 trial a cell"
    endings = split_grid((0.5, 0.5), (0.7, 0.3))
    assert "2 trials a cell\n" in texts("median", endings, TWO) + "\n"
    assert "2 trials a point" in texts("error", endings, TWO)
    del endings[Condition("simplified", 100, 0.1, (0.5, 0.5))]
    assert "2 trials a cell; 2 cells without trials (pale blue)" in texts("iqr", endings, TWO)


def test_one_trial_has_no_quartile_range_and_no_interval() -> None:
    assert quartile_range([3, 5]) == 1.0
    assert math.isnan(quartile_range([3]))
    one = {Condition("simplified", 100, 0.1, (0.5, 0.5)): [Ending((60, 30), 10)]}
    written = texts("iqr", one, TWO)
    assert written.split("\n").count("\N{EN DASH}") == 2
    assert "1 trial a cell; one trial gives no range (\N{EN DASH})" in written
    figure = drawn("error", one)
    assert "1 trial a point; one trial gives no interval" in written_on(figure)
    (bars,) = figure.axes[0].collections
    assert all(np.isnan(np.asarray(path.vertices)).all() for path in bars.get_paths())


def test_cells_that_differ_in_other_sites_only_are_pooled() -> None:
    endings = {
        Condition("simplified", 100, 0.2, (0.5, 0.3, 0.2), THREE): [Ending((50, 30, 20), 0)],
        Condition("simplified", 100, 0.2, (0.5, 0.2, 0.3), THREE): [Ending((40, 30, 20), 10)],
        Condition("simplified", 50, 0.2, (0.5, 0.2, 0.3), THREE): [Ending((1, 1, 1), 47)],
    }
    assert site_cells(endings, 100, "simplified", THREE, "black") == {(0.2, 0.5): [50, 40]}
    assert site_cells(endings, 100, "simplified", THREE, "red") == {
        (0.2, 0.2): [20],
        (0.2, 0.3): [20],
    }


def test_black_is_the_widest_range_of_pooled_cells() -> None:
    endings = {
        Condition("simplified", 100, 0.2, (0.5, 0.3, 0.2), THREE): [Ending((90, 5, 5), 0)] * 2,
        Condition("simplified", 100, 0.2, (0.5, 0.2, 0.3), THREE): [Ending((10, 5, 5), 80)] * 2,
    }
    scale = drawn("iqr", endings, THREE).axes[-1]
    assert scale.get_ylim() == (0.0, 80.0)


@pytest.mark.parametrize("robots", [1, 3, 30, 40])
def test_up_to_forty_robots_each_number_has_a_bar(robots: int) -> None:
    assert bar_edges(robots) == list(range(robots + 2))


@pytest.mark.parametrize(
    ("robots", "bars", "widths"),
    [
        (50, 17, {3}),
        (100, 20, {5, 6}),  # the paper's: 95 to 100 is the last
        (101, 17, {6}),
        (47, 16, {3}),
        (49, 17, {3, 2}),
        (10_000, 20, {500, 501}),
    ],
)
def test_more_robots_share_bars_of_whole_robots(robots: int, bars: int, widths: set[int]) -> None:
    edges = bar_edges(robots)
    assert len(edges) == bars + 1
    assert {b - a for a, b in itertools.pairwise(edges)} == widths
    assert len({b - a for a, b in itertools.pairwise(edges[:-1])}) == 1
    assert (edges[0], edges[-1]) == (0, robots + 1)


@pytest.mark.parametrize("robots", [1, 3, 30, 50, 100])
def test_bars_hold_every_trial_and_ticks_are_whole_robots(robots: int) -> None:
    endings = [Ending((number, robots - number), 0) for number in range(robots + 1)]
    figure = drawn("symmetry", {Condition("simplified", robots, 0.0, (0.0, 0.0)): endings})
    (axes,) = figure.axes
    bars = [bar for bar in axes.patches if isinstance(bar, Rectangle)]
    assert sum(bar.get_height() for bar in bars) == 2 * (robots + 1)
    assert all(tick == int(tick) for tick in axes.get_xticks())
    told = {50: "in bars of 3; the last: 48 to 50", 100: "in bars of 5; the last: 95 to 100"}
    assert axes.get_xlabel().partition("\n")[2] == told.get(robots, "")


def test_trials_without_anybody_informed_are_one_whatever_the_shares() -> None:
    endings = {
        Condition("simplified", 100, 0.0, (share, 1 - share)): [Ending((90, 5), 5)]
        for share in (0.5, 0.6)
    }
    (axes,) = drawn("symmetry", endings).axes
    assert axes.get_title(loc="left") == "simplified, N = 100: one aggregate in 2 of 2"


def test_an_odd_number_of_groups_leaves_no_empty_panel_behind() -> None:
    rules = ("simplified", "firat", "my own")
    endings = {c: e for rule in rules for c, e in nobody_informed(rule).items()}
    *groups, rest = drawn("symmetry", endings).axes
    assert [axes.get_title(loc="left").partition(",")[0] for axes in groups] == [
        "my own",
        "simplified",
        "firat",
    ]
    assert not rest.axison


def test_long_names_are_wrapped_within_their_panel() -> None:
    long = "a_base_with_" + "a_very_long_" * 8 + "name"
    figure = drawn("symmetry", nobody_informed(long) | nobody_informed("simplified"))
    first, second = (axes.get_tightbbox() for axes in figure.axes)
    assert first is not None
    assert second is not None
    assert not first.overlaps(second)
    figure = drawn("median", grid((long, "simplified")))
    boxes = [axes.get_tightbbox() for axes in figure.axes]
    assert [(a, b) for a, b in itertools.combinations(boxes, 2) if a and b and a.overlaps(b)] == []


def test_sites_of_one_colour_differ_by_hatch() -> None:
    names = tuple(f"site {number}" for number in range(9))
    group = {Condition("simplified", 10, 0.0, (0.0,) * 9, names): [Ending((1,) * 9, 1)]}
    (legend,) = drawn("symmetry", group, names).legends
    looks = {(patch.get_facecolor(), patch.get_hatch()) for patch in legend.get_patches()}
    assert len(looks) == 9
