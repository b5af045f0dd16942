"""Sites that are drawn, and light that is thrown, as pictures."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.spec.kconf import blocks_of, configurations, parse, to_text
from kilotwin.runs.palette import site_fills

from ..conftest import SMALL, Load

BLACK, RED, WHITE = (0, 0, 0), (214, 39, 40), (255, 255, 255)
PLAIN = (
    SMALL[: SMALL.index("[[site]]")]
    + """
[swarm]
profile = "kilobot"
program = "blink.c"
size = 5
"""
)
FLOOR = """
[floor]
image = "floor.png"
width_m = 0.4
centre_m = [0.1, 0.0]

[floor.legend]
"#000000" = "nest"
"#d62728" = "food"
"#ffffff" = ""
"""
GRID = """
[grid]
columns = 3
rows = 2
buses = 1
"""


@pytest.fixture
def drawn(folder: Path) -> Image.Image:
    """8 x 4 pixels: the upper left four are nest, the lowest row is food. The file is floor.png."""
    image = Image.new("RGB", (8, 4), WHITE)
    for x in range(8):
        image.putpixel((x, 3), RED)
    for x, y in ((0, 0), (1, 0), (0, 1), (1, 1)):
        image.putpixel((x, y), BLACK)
    image.save(folder / "floor.png")
    return image


def floor_of(experiment: Experiment, *points: tuple[float, float]) -> list[int]:
    assert experiment.floor is not None
    x, y = np.array(points).T
    return [int(value) for value in experiment.floor.at(x, y)]


@pytest.mark.usefixtures("drawn")
def test_colours_are_sites_where_the_picture_lies(load: Load) -> None:
    experiment = load(PLAIN + FLOOR)
    assert [site.name for site in experiment.keys.site] == ["nest", "food"]
    # 0.05 m a pixel, from x = -0.1 to 0.3 and y = -0.1 to 0.1.
    points = ((-0.07, 0.07), (0.01, 0.07), (0.2, -0.07), (-0.12, 0.07), (0.2, -0.12))
    assert floor_of(experiment, *points) == [1, 0, 2, 0, 0]
    spec = engine_spec(experiment, ["guest.so"], sample_ticks=32, black_box=None)
    assert spec["sites"] == [{"shape": "picture", "centre_m": [0.0, 0.0]}] * 2
    assert spec["picture"]["columns"] == 8
    assert spec["picture"]["values"][:8] == bytes([2] * 8)  # the lowest row
    assert spec["picture"]["low_m"] == pytest.approx([-0.1, -0.1])
    assert site_fills(experiment.keys) == ["#000000", "#d62728"]


@pytest.mark.usefixtures("drawn")
def test_a_resolved_experiment_means_the_same(load: Load) -> None:
    experiment = load(PLAIN + FLOOR)
    again = load(experiment.to_toml())
    assert again.identity() == experiment.identity()
    assert floor_of(again, (-0.07, 0.07)) == [1]


@pytest.mark.usefixtures("drawn")
def test_drawn_sites_come_after_others_and_may_have_a_table(load: Load) -> None:
    sites = """
[[site]]
name = "round"
centre_m = [0.25, 0.05]
diameter_m = 0.05

[[site]]
name = "food"
shape = "picture"
light = "red"
"""
    experiment = load(PLAIN + sites + FLOOR)
    assert [site.name for site in experiment.keys.site] == ["round", "food", "nest"]
    assert floor_of(experiment, (-0.07, 0.07), (0.2, -0.07)) == [3, 2]


def test_what_is_transparent_is_no_site(load: Load, folder: Path, drawn: Image.Image) -> None:
    image = drawn.convert("RGBA")
    image.putpixel((7, 0), (12, 34, 56, 0))
    image.save(folder / "floor.png")
    assert floor_of(load(PLAIN + FLOOR), (0.28, 0.08)) == [0]


def test_an_unknown_colour_is_named_with_its_pixel(
    load: Load, folder: Path, drawn: Image.Image
) -> None:
    drawn.putpixel((5, 1), (1, 2, 3))
    drawn.save(folder / "floor.png")
    with pytest.raises(InputError, match=r"pixel \(5, 1\) of .*floor.png is #010203, which"):
        load(PLAIN + FLOOR)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("floor.png", "none.png"), "floor.image|'none.png' is not there"),
        (("floor.png", "blink.c"), "blink.c is no picture; take a PNG"),
        (("#d62728", "#d62729"), "no pixel of .*floor.png is #d62729"),
        (("#d62728", "red"), "is no colour of a legend; write it as #rrggbb"),
        (("width_m = 0.4\n", ""), "lacks 'width_m'"),
    ],
)
@pytest.mark.usefixtures("drawn")
def test_mistakes_are_named(load: Load, change: tuple[str, str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        load(PLAIN + FLOOR.replace(*change))


@pytest.mark.usefixtures("drawn")
def test_a_site_in_a_drawn_one_is_refused(load: Load) -> None:
    site = '\n[[site]]\nname = "round"\ncentre_m = [-0.05, 0.05]\ndiameter_m = 0.1\n'
    with pytest.raises(InputError, match=r"pixel \(0, 1\) of .* is site 'nest' and lies in site"):
        load(PLAIN + site + FLOOR)


@pytest.mark.usefixtures("drawn")
def test_sites_that_are_not_drawn_are_refused(load: Load) -> None:
    site = '\n[[site]]\nname = "round"\nshape = "picture"\n'
    with pytest.raises(InputError, match="site 'round' is not drawn"):
        load(PLAIN + site + FLOOR)
    place = 'shape = "circle"\ncentre_m = [-0.5, 0]\ndiameter_m = 0.1'
    with pytest.raises(InputError, match="site 'nest' has a place and is drawn"):
        load(PLAIN + site.replace("round", "nest").replace('shape = "picture"', place) + FLOOR)


@pytest.mark.usefixtures("drawn")
def test_a_grid_takes_its_cells_from_the_picture(load: Load) -> None:
    arena = PLAIN[PLAIN.index("[arena]") : PLAIN.index("[swarm]")]
    floor = FLOOR.replace("[0.1, 0.0]", "[0.0, 0.0]").replace("0.4", "0.32")
    experiment = load(PLAIN.replace(arena, "") + floor + GRID)
    assert experiment.plan is not None
    ((_, cells),) = experiment.plan.site_maps
    # Middles of cells are at +-0.025, 0.075 and 0.125; pixels are 0.04 m wide.
    assert cells.tolist() == [
        [2, 2, 2, 2, 2, 2],
        [0, 0, 0, 0, 0, 0],
        [1, 0, 0, 0, 0, 0],
        [1, 0, 0, 0, 0, 0],
    ]
    text = to_text(blocks_of(experiment.plan.configuration))
    sent = configurations(parse(text), 3, 2)
    assert {module: (data,) for module, data in experiment.plan.configuration.items()} == sent


def test_light_is_as_bright_as_its_picture(load: Load, folder: Path) -> None:
    image = Image.new("L", (4, 2), 0)
    image.putpixel((3, 0), 255)
    image.save(folder / "light.png")
    lit = PLAIN + '\n[light.picture]\nimage = "light.png"\nwidth_m = 0.4\nwhite = 500\n'
    experiment = load(lit)
    spec = engine_spec(experiment, ["guest.so"], sample_ticks=32, black_box=None)["light"]
    assert spec["white"] == 500.0
    assert spec["picture"]["values"] == bytes([0, 0, 0, 0, 0, 0, 0, 255])
    assert load(experiment.to_toml()).identity() == experiment.identity()
