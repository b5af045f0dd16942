"""The page gets all that stands still in the picture, from any experiment."""

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from PIL import Image

from kilotwin.experiment.colours import led_byte
from kilotwin.metrics.values import MetricValues
from kilotwin.runs.columns import SENT_SCHEMA, TRACKING_SCHEMA
from kilotwin.runs.reader import Run
from kilotwin.runs.scene import scene_of
from kilotwin.runs.writer import Stream
from kilotwin.view.served_run import ServedRun

from ..conftest import GRID, INFORMED, SMALL
from ..known_run import ROBOTS, Begin, samples


def test_sites_states_and_informed_robots_are_in_it(begin: Begin) -> None:
    scene = scene_of(Run.open(begin("run", "swarm.informed=0.5", text=SMALL + INFORMED).folder))
    assert scene["arena"] == {"circle": [0.0, 0.0, 2.0]}
    assert scene["sites"][1] == {"name": "white", "colour": "#ffffff", "circle": [1.0, 0.0, 0.5]}
    assert scene["informed"] == [[0, 4, 1], [4, 5, 2]]


def test_an_led_has_its_states_name_and_colour(begin: Begin) -> None:
    text = SMALL + "\n[states]\nasleep = [0, 0, 0]\nawake = [0, 3, 0]\n"
    scene = scene_of(Run.open(begin(text=text).folder))
    states, green = scene["states"], led_byte(0, 3, 0)
    assert states["names"][: states["known"]] == ["asleep", "awake"]
    assert states["of_led"][green] == 1
    assert scene["leds"][green] == "#00ff00"
    assert len(states["of_led"]) == len(scene["leds"]) == 64


def test_obstacles_and_objects_are_outlines(begin: Begin) -> None:
    text = (
        SMALL
        + """
[[obstacle]]
shape = "rectangle"
centre_m = [0.0, 1.0]
width_m = 0.2
height_m = 0.1

[[object]]
diameter_m = 0.3
pose = [0.0, -1.0, 0.0]
mass_kg = 0.01
"""
    )
    scene = scene_of(Run.open(begin(text=text).folder))
    (obstacle,) = scene["obstacles"]
    np.testing.assert_allclose(
        sorted(obstacle["polygon"]), [[-0.1, 0.95], [-0.1, 1.05], [0.1, 0.95], [0.1, 1.05]]
    )
    assert scene["objects"] == [[{"circle": [0.0, 0.0, pytest.approx(0.15)]}]]


def test_a_grid_has_the_site_of_each_cell_and_its_walls(begin: Begin) -> None:
    grid = scene_of(Run.open(begin(text=GRID).folder))["grid"]
    assert (grid["columns"], grid["rows"], grid["cell_m"]) == (4, 6, 0.05)
    ((at_s, cells),) = grid["maps"]
    assert at_s == 0
    assert len(cells) == 8 * 12
    assert cells.count(1) == 2 * 4
    assert len(grid["walls"]) == 8 * 12 - 6 * 10


def test_a_grid_that_a_kconf_configures_has_no_walls_of_ours(begin: Begin, folder: Path) -> None:
    (folder / "floor.kconf").write_text("address\nx:0-3\ndata\n1\n1\n1\n1\n")
    scene = scene_of(Run.open(begin("run", "grid.configuration=floor.kconf", text=GRID).folder))
    assert scene["grid"]["walls"] == []


def test_sites_that_are_drawn_are_a_picture(begin: Begin, folder: Path) -> None:
    picture = Image.new("RGBA", (4, 2), (0, 0, 0, 0))
    picture.putpixel((0, 0), (0, 0, 0, 255))
    picture.save(folder / "floor.png")
    text = SMALL.split("[[site]]", maxsplit=1)[0] + SMALL[SMALL.index("[swarm]") :]
    text += '\n[floor]\nimage = "floor.png"\nwidth_m = 4.0\n[floor.legend]\n"#000000" = "dark"\n'
    floor = scene_of(Run.open(begin(text=text).folder))["floor"]
    drawn = Image.open(io.BytesIO(base64.b64decode(floor["png"])))
    assert drawn.size == (4, 2)
    assert [drawn.getpixel((0, 0))[3], drawn.getpixel((1, 0))[3]] == [255, 0]  # type: ignore[index]
    np.testing.assert_allclose(floor["box"], [-2, -1, 2, 1])


def test_light_is_a_picture_brighter_near_a_lamp(begin: Begin) -> None:
    lamp = "\n[[light.source]]\nat_m = [1.0, 0.5]\npeak = 900\nhalf_m = 0.2\n"
    light = scene_of(Run.open(begin(text=SMALL + lamp).folder))["light"]
    assert light["box"] == [-2, -2, 2, 2]
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(light["png"]))))
    cover = pixels[::-1, :, 3]  # the lowest row first
    row, column = np.unravel_index(cover.argmax(), cover.shape)
    assert (column * 4 / 160 - 2, row * 4 / 160 - 2) == pytest.approx((1.0, 0.5), abs=0.03)
    half = round((1.2 + 2) * 40)
    assert (cover[row, half] / cover.max()) ** 2 == pytest.approx(0.5, abs=0.05)
    assert scene_of(Run.open(begin("dark").folder))["light"] is None


def write(stream: Stream, schema: pa.Schema, rows: list[list[Any]]) -> None:
    """Adds rows, each as a batch."""
    for row in rows:
        columns = [pa.array([value], kind) for value, kind in zip(row, schema.types, strict=True)]
        stream.write(pa.record_batch(columns, schema=schema))


def test_a_robot_has_its_variables_and_the_words_it_was_told(begin: Begin) -> None:
    text = SMALL + '\n[metric.seen]\nvariable = "count"\nper_robot = true\n'
    writer = begin(text=text)
    values = np.arange(2.0 * ROBOTS).reshape(2, ROBOTS)
    values[0, 3] = np.nan
    writer.add(samples([0, 1000]), MetricValues({"seen": values.sum(axis=1)}, {"seen": values}))
    sent = Stream(writer.folder / "sent.arrows", SENT_SCHEMA)
    told = [[1.0, 0.9, 3, 7, 42, None], [2.0, 2.0, 4, 7, 43, None]]
    write(sent, SENT_SCHEMA, told)
    sent.close()
    served = ServedRun(Run.open(writer.folder))
    assert served.robot(2)["words"] == [[1.0, 7, 42]]
    assert served.robot(2)["metrics"] == {"metric_seen": [(0, 2), (32.768, 12)]}
    assert served.robot(3)["metrics"] == {"metric_seen": [(32.768, 13)]}


def _module(x: int, y: int, errors: int) -> Any:
    """As the engine tells of one."""
    names = {"x": x, "y": y, "state": "running", "can": "active", "tec": errors, "rec": 0}
    return {**names, "frames_refused": 0, "frames_missed": 3}


def test_a_module_has_its_events_its_counters_and_its_reports(begin: Begin) -> None:
    writer = begin("run", 'record.also=["modules"]', text=GRID)
    stream = Stream(writer.folder / "tracking.arrows", TRACKING_SCHEMA)
    where = [(1, 2, 0), (3, 5, 1), (1, 2, 3)]
    rows: list[list[Any]] = [
        [float(at), at, 0.0, 0.0, *place, "seen", b"1234567"] for at, place in enumerate(where)
    ]
    write(stream, TRACKING_SCHEMA, rows)
    stream.close()
    writer.add_event({"kind": "module_silent", "tick": 5, "text": "gone", "module": [1, 2]})
    writer.add_event({"kind": "module_silent", "tick": 5, "text": "gone", "module": [2, 1]})
    for tick, errors in ((0, 0), (61, 0), (122, 8)):
        writer.add_modules(tick, [_module(1, 2, errors), _module(2, 1, 100)])
    module = ServedRun(Run.open(writer.folder)).module(1, 2)
    assert [event["module"] for event in module["events"]] == [[1, 2]]
    assert module["number"] == 2
    assert module["reports"] == [[0.0, 0, 0, "seen"], [2.0, 2, 3, "seen"]]
    assert [round(row.pop(0), 2) for row in module["counters"]] == [0, 4]
    assert module["counters"] == [["running", "active", errors, 0, 0, 3] for errors in (0, 8)]
    with pytest.raises(KeyError):
        ServedRun(Run.open(writer.folder)).module(4, 0)


def test_a_run_says_how_far_it_is_and_that_it_ended(begin: Begin) -> None:
    writer = begin()
    served = ServedRun(Run.open(writer.folder))
    at_first = {"status": "running", "samples": 0, "first_s": 0.0, "last_s": 0.0, "coarse": ""}
    assert served.state() == at_first
    writer.add(samples([0, 1000]))
    assert served.state()["samples"] == 2
    assert served.state()["last_s"] == pytest.approx(32.768)
    (writer.folder / "manifest.json").write_text('{"status": "finished"}')
    assert served.state()["status"] == "finished"


def test_of_a_grids_reports_each_robots_last_one_is_told(begin: Begin) -> None:
    writer = begin(text=GRID)
    stream = Stream(writer.folder / "tracking.arrows", TRACKING_SCHEMA)
    heard = [(1.0, 3, 0.025), (2.0, 1, 0.075), (3.0, 3, -0.025), (9.0, 1, 0.125)]
    for number, (time_s, robot, x_m) in enumerate(heard):
        write(stream, TRACKING_SCHEMA, [[time_s, robot, x_m, 0.0, 1, 2, 3, "seen", b"1234567"]])
        served = ServedRun(Run.open(writer.folder))
        assert len(served.reports(100.0)) == len({robot for _, robot, _ in heard[: number + 1]})
    stream.close()
    assert served.reports(0.5) == []
    told = served.reports(5.0)
    assert [row[:2] for row in told] == [[2.0, 1], [3.0, 3]]
    assert told[1][2:] == [pytest.approx(-0.025), 0.0, 1, 2, 3]
    assert ServedRun(Run.open(begin("other").folder)).reports(1.0) == []
