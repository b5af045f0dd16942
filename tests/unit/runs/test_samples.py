"""Samples of a run are read in pieces, while it grows and whatever became of it."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.runs.packing import pack
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import MOST_ROWS, RunSamples
from kilotwin.runs.stream_index import StreamIndex
from kilotwin.runs.writer import RunWriter
from kilotwin.units import TICK_S
from kilotwin.view.served_run import ServedRun

from ..conftest import SMALL
from ..known_run import ROBOTS, Begin, samples

ALSO = 'record.also=["motors","battery","messages"]'


def unpack(data: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """As the page reads it."""
    (length,) = struct.unpack_from("<I", data)
    head = json.loads(data[4 : 4 + length])
    assert (4 + length) % 8 == 0
    arrays = {
        name: np.frombuffer(data, dtype=kind, count=size, offset=4 + length + at)
        for name, (kind, at, size) in head["arrays"].items()
    }
    return head, arrays


def test_a_chunk_has_what_the_table_has(begin: Begin) -> None:
    writer = begin()
    for first in range(0, 100, 10):
        writer.add(samples(range(first, first + 10)))
    writer.close(clean=True)
    run = RunSamples(writer.folder, objects=False)
    assert run.refresh() == 100

    head, arrays = unpack(run.chunk(7, 20, 4))

    table = Run.open(writer.folder).robots()
    wanted = np.arange(7, 87, 4)
    assert (head["first"], head["stride"], head["samples"]) == (7, 4, 20)
    for name in ("x_m", "y_m", "led"):
        whole = np.asarray(table[name]).reshape(100, ROBOTS)
        np.testing.assert_array_equal(arrays[name].reshape(20, ROBOTS), whole[wanted])
    heading = np.asarray(table["heading_rad"]).reshape(100, ROBOTS)[wanted]
    apart = arrays["heading_rad"].reshape(20, ROBOTS) / 65536 - heading / (2 * np.pi)
    assert np.abs(apart - np.round(apart)).max() <= 0.5 / 65536 + 1e-7


def test_a_chunk_has_what_was_recorded_besides(begin: Begin) -> None:
    writer = begin("run", ALSO)
    known = samples(range(100), extras=True)
    writer.add(known)
    writer.close(clean=True)
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    _, arrays = unpack(run.chunk(7, 20, 4))
    for name in EXTRA_OF:
        kept = known[name]  # type: ignore[literal-required]
        assert arrays[name].dtype == kept.dtype
        np.testing.assert_array_equal(arrays[name].reshape(20, ROBOTS), kept[7:87:4])


def test_of_real_robots_nothing_is_known_besides(begin: Begin) -> None:
    writer = begin("run", ALSO)
    writer.add(samples([0, 10]))
    writer.close(clean=True)
    table = Run.open(writer.folder).robots()
    assert {table[name].null_count for name in EXTRA_OF} == {2 * ROBOTS}
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    assert unpack(run.chunk(0, 2, 1))[1].keys().isdisjoint(EXTRA_OF)


def test_samples_that_come_while_it_is_open_are_seen_and_torn_ones_are_not(begin: Begin) -> None:
    writer = begin()
    run = RunSamples(writer.folder, objects=False)
    assert run.refresh() == 0
    writer.add(samples([0, 5]))
    assert run.refresh() == 2
    writer.add(samples([10]))
    with (writer.folder / "robots.arrows").open("ab") as stream:
        stream.write(b"\xff\xff\xff\xff\x00\x01\x00\x00half a message")
    assert run.refresh() == 3
    _, arrays = unpack(run.times(1))
    np.testing.assert_array_equal(arrays["time_s"], [5 * TICK_S, 10 * TICK_S])
    np.testing.assert_array_equal(unpack(run.chunk(2, 1, 1))[1]["x_m"], samples([10])["x_m"][0])


def test_a_run_without_a_folder_yet_has_no_samples(tmp_path: Path) -> None:
    assert RunSamples(tmp_path / "none", objects=True).refresh() == 0


def test_a_chunk_ends_with_the_run(begin: Begin) -> None:
    writer = begin()
    writer.add(samples(range(5)))
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    assert unpack(run.chunk(3, 100, 1))[0]["samples"] == 2
    assert unpack(run.chunk(50, 100, 1))[0]["samples"] == 0


def test_a_chunk_is_no_larger_than_said(begin: Begin, monkeypatch: pytest.MonkeyPatch) -> None:
    assert MOST_ROWS >= 1_000_000
    monkeypatch.setattr("kilotwin.runs.samples.MOST_ROWS", 35)
    writer = begin()
    writer.add(samples(range(50)))
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    assert unpack(run.chunk(0, 50, 1))[0]["samples"] == 3  # of 10 robots


def test_curves_of_a_long_run_are_thinned(begin: Begin) -> None:
    writer = begin()
    writer.add(samples(range(0, 1000)))
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    head, arrays = unpack(run.series(100))
    assert (head["rows"], head["stride"]) == (1000, 10)
    whole = Run.open(writer.folder).sites()
    np.testing.assert_allclose(arrays["time_s"], np.asarray(whole["time_s"])[::10])
    np.testing.assert_array_equal(arrays["not_resting"], np.asarray(whole["not_resting"])[::10])


def leds(writer: RunWriter) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Curves of LEDs as the page gets them, and the LEDs of all samples, [samples, robots]."""
    run = RunSamples.of(Run.open(writer.folder))
    arrays = unpack(run.series(100))[1]
    curves = {name: values for name, values in arrays.items() if name.startswith("led_")}
    return curves, np.asarray(Run.open(writer.folder).robots()["led"]).reshape(-1, ROBOTS)


def test_without_states_there_are_curves_of_each_led_that_is_shown(begin: Begin) -> None:
    writer = begin()
    for first in range(0, 500, 50):
        more = samples(range(first, first + 50))
        more["led"] &= 0x0F  # 16 of 64
        writer.add(more)
    curves, shown = leds(writer)
    assert set(curves) == {f"led_{led}" for led in range(16)}
    for led in range(16):
        np.testing.assert_array_equal(curves[f"led_{led}"], (shown[::5] == led).sum(axis=1))


def test_of_many_robots_some_samples_stand_for_those_after_them(
    begin: Begin, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kilotwin.runs.samples._MOST_COUNTED", 34 * ROBOTS)
    writer = begin()
    writer.add(samples(range(100)))
    curves, shown = leds(writer)
    for led in range(64):
        counted = (shown[::3] == led).sum(axis=1)
        wanted = np.repeat(counted, 3)[:100]
        np.testing.assert_array_equal(curves.get(f"led_{led}", np.zeros(100)), wanted)


def test_with_states_there_are_no_curves_of_leds(begin: Begin) -> None:
    writer = begin(text=SMALL + "\n[states]\nawake = [0, 3, 0]\n")
    writer.add(samples(range(10)))
    assert leds(writer)[0] == {}


def test_a_robots_history_has_each_change_of_its_led(begin: Begin) -> None:
    writer = begin()
    shown = [3, 3, 0, 0, 48, 3]
    for tick, led in enumerate(shown):
        one = samples([tick])
        one["led"][0, 4] = led
        writer.add(one)
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    assert run.history(4) == [
        (round(tick * TICK_S, 3), led) for tick, led in [(0, 3), (2, 0), (4, 48), (5, 3)]
    ]


def test_states_stand_for_leds_where_these_were_not_recorded(begin: Begin) -> None:
    columns = 'record.columns=["x_m", "y_m", "state"]'
    text = SMALL + "\n[states]\nasleep = [0, 0, 0]\nawake = [0, 3, 0]\n"
    writer = begin("run", columns, "record.robots=[2, 7]", text=text)
    shown = [12, 12, 0]
    for tick, led in enumerate(shown):
        one = samples([tick])
        one["led"][0, 7] = led
        writer.add(one)
    run = ServedRun(Run.open(writer.folder))
    assert run.scene()["recorded"] == [2, 7]
    _, arrays = unpack(run.samples.chunk(0, 3, 1))
    assert "heading_rad" not in arrays
    assert arrays["led"].reshape(3, 2)[:, 1].tolist() == shown
    assert [led for _, led in run.robot(7)["history"]] == [12, 0]
    with pytest.raises(KeyError):
        run.robot(3)


def test_robots_recorded_less_often_than_counts_have_their_own_times(begin: Begin) -> None:
    writer = begin("run", "record.robots_s=20")
    for tick in range(0, 2000, 305):
        writer.add(samples([tick]))
    writer.close(clean=True)
    run = RunSamples(writer.folder, objects=False)
    run.refresh()
    wanted = np.unique(np.asarray(Run.open(writer.folder).robots()["time_s"]))
    assert 2 < len(wanted) < 7
    np.testing.assert_allclose(unpack(run.times(0))[1]["time_s"], wanted)


def test_the_index_has_the_rows_of_each_batch(begin: Begin) -> None:
    writer = begin()
    for ticks in ([0], [1, 2, 3], [4, 5]):
        writer.add(samples(ticks))
    writer.close(clean=True)
    index = StreamIndex(writer.folder / "robots.arrows")
    index.refresh()
    assert [(batch.row, batch.rows) for batch in index.batches] == [(0, 10), (10, 30), (40, 20)]
    assert index.names == Run.open(writer.folder).robots().schema.names
    with pytest.raises(KeyError, match="nonsense"):
        index.read(index.batches[0], ["tick", "nonsense"])


@pytest.mark.parametrize("kept", range(0, 400, 7))
def test_a_stream_cut_anywhere_is_read_up_to_its_last_whole_batch(kept: int, begin: Begin) -> None:
    writer = begin()
    writer.add(samples([0]))
    file = writer.folder / "robots.arrows"
    whole = file.stat().st_size
    data = file.read_bytes()
    file.write_bytes(data[: max(0, whole - kept)])
    index = StreamIndex(file)
    index.refresh()
    assert index.rows == (ROBOTS if kept == 0 else 0)


def test_arrays_of_an_answer_begin_where_a_page_can_read_them() -> None:
    sizes = {"a": np.arange(3, dtype=np.uint8), "b": np.arange(5.0), "c": np.zeros(0, np.float32)}
    head, arrays = unpack(pack({"said": 1}, sizes))
    assert head["said"] == 1
    assert all(at % 8 == 0 for _, at, _ in head["arrays"].values())
    for name, values in sizes.items():
        np.testing.assert_array_equal(arrays[name], values)
