"""Figures are drawn of whole and of broken runs, and say what they show."""

import errno
import hashlib
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from kilotwin.errors import InputError
from kilotwin.runs import palette
from kilotwin.runs.folder import close_manifest
from kilotwin.runs.palette import site_fills, state_colours
from kilotwin.runs.reader import Run
from kilotwin.studies.plot import style
from kilotwin.studies.plot.figures import RUN_FIGURES, write_figure

from ..conftest import BLINK, INFORMED, SMALL, Load, call_kilotwin

MAGIC = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory, fake_environment: dict[str, str]) -> Path:
    """A finished run of the small experiment; not to be changed."""
    folder = tmp_path_factory.mktemp("plots")
    (folder / "small.toml").write_text(SMALL + INFORMED)
    (folder / "blink.c").write_text(BLINK)
    words = ["run", "small.toml", "--out", "run", "--set", "swarm.informed=0.5"]
    call_kilotwin(folder, fake_environment, *words)
    return folder / "run"


@pytest.mark.parametrize("kind", list(MAGIC))
@pytest.mark.parametrize("figure", ["map", "timeline"])
def test_a_figure_is_of_the_kind_its_name_says(
    figure: str, kind: str, run_folder: Path, tmp_path: Path
) -> None:
    target = tmp_path / "pictures" / f"{figure}.{kind}"
    write_figure(figure, run_folder, target)
    assert target.read_bytes().startswith(MAGIC[kind])


@pytest.mark.parametrize("kind", list(MAGIC))
def test_the_same_run_gives_the_same_file(kind: str, run_folder: Path, tmp_path: Path) -> None:
    def digest() -> str:
        write_figure("map", run_folder, tmp_path / f"map.{kind}")
        return hashlib.sha256((tmp_path / f"map.{kind}").read_bytes()).hexdigest()

    assert digest() == digest()


@pytest.mark.parametrize("figure", ["map", "timeline"])
def test_axes_have_names_and_units(figure: str, run_folder: Path, tmp_path: Path) -> None:
    write_figure(figure, run_folder, tmp_path / "figure.svg")
    comments = re.findall(r"<!-- (.*?) -->", (tmp_path / "figure.svg").read_text())
    wanted = {
        "map": ["x (m)", "y (m)", "informed (5)", "site black", "small, seed 1, at 60 s"],
        "timeline": ["time (s)", "robots (at the end)", "wanted"],
    }[figure]
    assert [text for text in wanted if text not in comments] == []


def test_a_run_killed_before_its_first_sample_cannot_be_drawn(
    run_folder: Path, tmp_path: Path
) -> None:
    killed = tmp_path / "run"
    shutil.copytree(run_folder, killed)
    (killed / "robots.arrows").write_bytes(b"")
    (killed / "sites.arrows").write_bytes(b"")
    close_manifest(killed, "interrupted", 130)
    for figure in ("map", "timeline"):
        with pytest.raises(InputError, match="no sample was recorded"):
            write_figure(figure, killed, tmp_path / "figure.png")


def test_a_picture_needs_a_known_suffix(run_folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"end the name in .png, .svg or .pdf"):
        write_figure("map", run_folder, tmp_path / "map.bmp")


def test_a_picture_that_cannot_be_written_is_named(run_folder: Path) -> None:
    with pytest.raises(InputError, match=r"-o /proc/map.png: cannot be written"):
        write_figure("map", run_folder, Path("/proc/map.png"))


def test_a_site_has_its_own_colour_or_its_names_or_one_of_the_palette(load: Load) -> None:
    keys = load(SMALL, "site.0.colour=#ABCDEF", "site.1.name=nest").keys
    assert site_fills(keys) == ["#abcdef", "#e69f00"]
    assert site_fills(load().keys) == ["#000000", "#ffffff"]


def test_states_without_a_name_show_as_their_led() -> None:
    colours = state_colours(["resting", "RGB(3,0,0)", "RGB(0,0,0)", "busy"])
    assert colours["RGB(3,0,0)"] == "#ff0000"
    assert colours["RGB(0,0,0)"] == "#000000"
    assert len(set(colours.values())) == 4


def test_a_picture_that_cannot_be_written_leaves_the_old_one(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill_the_disk(self: Figure, target: Path, **_: object) -> None:
        target.write_text("<half a pict")
        raise OSError(errno.ENOSPC, "No space left on device")

    target = tmp_path / "map.svg"
    target.write_text("the old one")
    monkeypatch.setattr(Figure, "savefig", fill_the_disk)
    with pytest.raises(InputError, match="no space left on device"):
        write_figure("map", run_folder, target)
    assert target.read_text() == "the old one"
    assert list(tmp_path.iterdir()) == [target]


def run_of(folder: Path, environment: dict[str, str], text: str, *settings: str) -> Run:
    (folder / "small.toml").write_text(text)
    (folder / "blink.c").write_text(BLINK)
    words = [part for key in settings for part in ("--set", key)]
    call_kilotwin(folder, environment, "run", "small.toml", "--out", "run", *words)
    return Run.open(folder / "run")


def crowded(width_m: float, height_m: float, sites: int) -> str:
    """The small experiment in a rectangle, with so many sites side by side, a share for each."""
    places = "".join(
        f"""
[[site]]
name = "site {number} of many"
shape = "rectangle"
centre_m = [{(number + 0.5) * width_m / sites - width_m / 2}, 0.0]
width_m = {width_m / sites}
height_m = {height_m / 2}
"""
        for number in range(sites)
    )
    head, swarm = SMALL[: SMALL.index("[arena]")], SMALL[SMALL.index("[swarm]") :]
    arena = f'[arena]\nshape = "rectangle"\nwidth_m = {width_m}\nheight_m = {height_m}\n'
    shares = [f'"site {number} of many" = {1 / sites}\n' for number in range(sites)]
    informed = "informed = 0.5\n[swarm.informed_for]\n" + "".join(shares) + "[controller]\n"
    return head + arena + places + swarm + informed


def legend_of(figure: Figure) -> Legend:
    legend = figure.axes[0].get_legend()
    assert legend is not None
    return legend


def dotted(axes: Axes) -> dict[str, float]:
    """How high the dotted lines are, by colour."""
    lines = [line for line in axes.lines if line.get_linestyle() == ":"]
    return {str(line.get_color()): float(np.asarray(line.get_ydata())[0]) for line in lines}


def drawn(figure: str, run: Run) -> Figure:
    found = style.draw(lambda: RUN_FIGURES[figure](run))
    found.canvas.draw()
    return found


def test_a_timeline_tells_parts_of_a_second_and_wishes_beside_the_lines(
    tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    wish = ["swarm.informed=0.5", "swarm.informed_for={black=0.5,white=0.5}", "duration_s=20"]
    figure = drawn("timeline", run_of(tmp_path, fake_environment, SMALL + INFORMED, *wish))
    (axes,) = figure.axes
    assert {"2.5", "7.5"} <= {label.get_text() for label in axes.get_xticklabels()}
    assert list(axes.texts) == []
    legend = [
        text.get_text().replace("\N{NO-BREAK SPACE}", " ") for text in legend_of(figure).texts
    ]
    assert [re.sub(r"\(\d+", "(n", text) for text in legend] == [
        "resting on black (n, wanted 5)",
        "resting on white (n, wanted 5)",
        "not resting (n)",
        "wanted",
    ]
    assert dotted(axes) == {palette.OUTLINE: 5.0}


def test_wishes_that_differ_have_their_sites_colours(run_folder: Path) -> None:
    (axes,) = drawn("timeline", Run.open(run_folder)).axes
    assert dotted(axes) == {"#000000": 7.0, "#ffffff": 3.0}


def test_a_timeline_without_anybody_informed_wants_nothing(
    tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    figure = drawn("timeline", run_of(tmp_path, fake_environment, SMALL))
    assert not any("wanted" in text.get_text() for text in legend_of(figure).texts)


def test_the_informed_ring_and_the_outline_leave_a_small_robot_its_colour(
    tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    settings = ["swarm.informed=0.5", "arena.diameter_m=100"]
    figure = drawn("map", run_of(tmp_path, fake_environment, SMALL + INFORMED, *settings))
    discs = [c for c in figure.axes[0].collections if isinstance(c, EllipseCollection)]
    rings, robots, rims = discs
    assert np.asarray(rings.get_offsets()).shape == (5, 2)
    assert np.asarray(robots.get_offsets()).shape == (10, 2)
    assert rings.zorder <= robots.zorder  # so the robots are drawn over their rings
    ring, robot, rim = (np.asarray(of.get_widths())[0] for of in discs)
    assert ring > robot == rim
    left, right = figure.axes[0].transData.transform([(0.0, 0.0), (robot, 0.0)])[:, 0]
    points = (right - left) * 72 / figure.dpi
    assert np.asarray(robots.get_linewidth()) < 0.1 * points
    assert np.asarray(rims.get_linewidth()) < 0.2 * points


def test_a_map_of_robots_large_enough_has_its_usual_outline(run_folder: Path) -> None:
    figure = drawn("map", Run.open(run_folder))
    _, robots, _ = (c for c in figure.axes[0].collections if isinstance(c, EllipseCollection))
    assert np.asarray(robots.get_linewidth()) == 0.5


@pytest.mark.parametrize(
    ("width_m", "height_m", "where"),
    [(3.0, 3.0, "right"), (1.0, 3.0, "right"), (9.0, 1.0, "below")],
)
def test_a_legend_of_many_stays_within_its_map(
    width_m: float, height_m: float, where: str, tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    run = run_of(tmp_path, fake_environment, crowded(width_m, height_m, 30))
    figure = drawn("map", run)
    (axes,) = figure.axes
    legend, x_axis = legend_of(figure).get_window_extent(), axes.xaxis.get_tightbbox()
    assert x_axis is not None
    if where == "right":
        assert legend.x0 > axes.get_window_extent().x1
        assert legend.height < axes.get_window_extent().height
    else:
        assert legend.y1 < x_axis.y0
        assert legend.width < x_axis.width


def test_a_legend_of_few_stands_beside_a_flat_map(
    tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    figure = drawn("map", run_of(tmp_path, fake_environment, crowded(4.0, 1.5, 2)))
    assert legend_of(figure).get_window_extent().x0 > figure.axes[0].get_window_extent().x1


@pytest.mark.parametrize("figure", ["map", "timeline"])
def test_sites_of_one_colour_and_long_names_can_be_told(
    figure: str, tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    name = "a name as long as " + "labs like to give them, " * 5
    run = run_of(tmp_path, fake_environment, crowded(4.0, 4.0, 15), f'name="{name}"')
    found = drawn(figure, run)
    (axes,) = found.axes
    assert "\n" in axes.get_title(loc="left")
    if figure == "map":
        patches = [p for p in axes.patches if p.get_facecolor() != to_rgba(palette.FLOOR)]
        looks = {(patch.get_facecolor(), patch.get_hatch()) for patch in patches}
    else:
        looks = {(line.get_color(), str(vars(line)["_dash_pattern"])) for line in axes.lines[:15]}
    assert len(looks) == 15
    assert legend_of(found).get_window_extent().height < axes.get_window_extent().height


def test_words_are_wrapped_to_a_width_in_inches() -> None:
    assert style.wrapped("one two three four", 10) == "one two three four"
    assert style.wrapped("one two three four", style.letters(13)) == "one two three\nfour"
    assert style.wrapped("one two\N{NO-BREAK SPACE}six", 0.1) == "one\ntwo\N{NO-BREAK SPACE}six"


def test_a_colour_that_comes_again_looks_another_way() -> None:
    ways = ["plain", "hatched"]
    assert style.repeats(["a", "b", "a", "a"], ways) == ["plain", "plain", "hatched", "plain"]


def test_a_long_legend_has_columns() -> None:
    line = style.LEGEND_LINE
    assert style.legend_columns(["a"] * 4, 4.1 * line) == 1
    assert style.legend_columns(["a"] * 4 + ["two\nlines"], 4.1 * line) == 2
    assert style.legend_columns(["a", "b"], 0.1) == 2
