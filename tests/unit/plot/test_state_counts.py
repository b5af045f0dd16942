"""Curves of a program's own states, named or not, of all its robots or some."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from kilotwin.errors import InputError
from kilotwin.runs.reader import Run
from kilotwin.studies.plot.timeline import draw_timeline

from ..conftest import SMALL
from ..known_run import ROBOTS, Begin, samples

SITELESS = SMALL.split("[[site]]", maxsplit=1)[0] + SMALL[SMALL.index("[swarm]") :]


def drawn(begin: Begin, *settings: str) -> Figure:
    """The timeline of two samples: robots 0 to 3 are red, then 0 to 5; the others are dark."""
    writer = begin("run", *settings, text=SITELESS)
    for tick, red in enumerate((4, 6)):
        one = samples([tick])
        one["led"][0] = np.where(np.arange(ROBOTS) < red, 3, 0)
        one["site"][:] = 0
        writer.add(one)
    return draw_timeline(Run.open(writer.folder))


def lines(figure: Figure) -> dict[str, list[int]]:
    """Each curve's label, without the number at its end, and its counts."""
    (axes,) = figure.axes
    return {
        str(line.get_label()).rsplit(" (", maxsplit=1)[0]: np.asarray(line.get_ydata()).tolist()
        for line in axes.lines
    }


def title(figure: Figure) -> str:
    legend = figure.axes[0].get_legend()
    assert legend is not None
    return legend.get_title().get_text()


def test_colours_without_a_name_have_curves(begin: Begin) -> None:
    figure = drawn(begin)
    assert lines(figure) == {"RGB(0,0,0)": [6, 4], "RGB(3,0,0)": [4, 6]}
    assert title(figure) == "robots by state (at the end)"


def test_of_some_robots_those_that_were_recorded_are_counted(begin: Begin) -> None:
    figure = drawn(begin, "record.robots=[0, 4, 9]")
    assert lines(figure) == {"RGB(0,0,0)": [2, 1], "RGB(3,0,0)": [1, 2]}
    assert title(figure) == "3 recorded robots by state (at the end)"


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ('record.columns=["led"]', "left out state, which is needed here; add it"),
        ("record.robots=[]", "chose no robots; let it choose some"),
    ],
)
def test_a_run_with_nothing_to_count_is_refused(setting: str, said: str, begin: Begin) -> None:
    with pytest.raises(InputError, match=said):
        drawn(begin, setting)
