"""An exported page holds its run itself, keeps to its size, and says what was left out."""

import base64
import json
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin.errors import InputError, RunError
from kilotwin.experiment.schema.record import EXTRA_OF
from kilotwin.runs.reader import Run
from kilotwin.runs.writer import RunWriter
from kilotwin.view import exported_page
from kilotwin.view.exported_page import write_page

from ..known_run import ROBOTS, Begin, samples

PAGE = (
    '<meta charset="utf-8" /><link rel="stylesheet" href="viewer-style.css" />'
    '<script type="module" src="viewer.js"></script><body></body>'
)
TICKS = range(0, 2000, 10)


@pytest.fixture(autouse=True)
def page(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small page, whether or not one was built."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "index.html").write_text(PAGE)
    (folder / "viewer-style.css").write_text("p { color: red }")
    (folder / "viewer.js").write_text('const end = "</script>";')
    monkeypatch.setattr(exported_page, "_PAGE", folder)
    return folder


@pytest.fixture
def written(begin: Begin) -> RunWriter:
    """A run of 200 samples with events and prints."""
    writer = begin()
    writer.add(samples(TICKS))
    writer.add_event({"kind": "crash", "robot": 2, "tick": 10})
    for number in range(1000):
        text = f"throw {number}"
        writer.add_event({"kind": "print", "robot": 2, "tick": 10, "text": text})
    return writer


def held(file: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Head and arrays of the one run in a page."""
    (text,) = re.findall(
        r'<script type="text/plain" class="run">([^<]*)</script>', file.read_text()
    )
    data = zlib.decompress(base64.b64decode(text))
    (length,) = struct.unpack_from("<I", data)
    head = json.loads(data[4 : 4 + length])
    arrays = {
        name: np.frombuffer(data, kind, size, 4 + length + at)
        for name, (kind, at, size) in head["arrays"].items()
    }
    return head, arrays


def summed(differences: np.ndarray, number: int) -> np.ndarray:
    """[robots, samples] of what the page has: low bytes, then high bytes of folded differences."""
    low, high = differences.reshape(2, -1, number).astype(np.int64)
    folded = low + 256 * high
    steps = np.where(folded % 2, -(folded + 1) // 2, folded // 2)
    return np.cumsum(steps, axis=1) % 65536


def test_every_sample_is_in_it_as_it_was_recorded(written: RunWriter, folder: Path) -> None:
    said = write_page([Run.open(written.folder)], folder / "page.html", 1.0)
    head, arrays = held(folder / "page.html")
    truth = samples(TICKS)
    assert (head["scene"]["samples"], head["number"], len(head["events"])) == (200, 1001, 1001)
    np.testing.assert_array_equal(arrays["led"].reshape(ROBOTS, -1).T, truth["led"])
    np.testing.assert_allclose(arrays["time_s"], truth["tick"] * 0.032768)
    for name in ("x_m", "y_m"):
        low, step = arrays[f"{name}.scale"]
        places = low + step * summed(arrays[name], 200)
        np.testing.assert_allclose(places.T, truth[name], atol=step / 2 + 1e-6)
    turns = summed(arrays["heading_rad"], 200).T / 1024
    away = (turns - truth["heading_rad"] / (2 * np.pi) + 0.5) % 1 - 0.5
    assert np.abs(away).max() < 1 / 1000
    assert "all 200 samples, positions to 0.031 mm, all 1,001 events" in said[1]


def test_what_was_recorded_besides_is_in_it_exactly(begin: Begin, folder: Path) -> None:
    writer = begin("run", 'record.also=["motors","battery","messages"]')
    truth = samples(TICKS, extras=True)
    writer.add(truth)
    write_page([Run.open(writer.folder)], folder / "page.html", 1.0)
    head, arrays = held(folder / "page.html")
    assert head["scene"]["also"] == ["motors", "battery", "messages"]
    for name in EXTRA_OF:
        low, step = arrays[f"{name}.scale"]
        numbers = summed(arrays[name], len(TICKS)).T
        np.testing.assert_array_equal(low + step * numbers, truth[name])  # type: ignore[literal-required]


def test_it_keeps_to_its_size_by_leaving_out_samples_and_old_events(
    written: RunWriter, folder: Path
) -> None:
    said = write_page([Run.open(written.folder)], folder / "page.html", 0.012)
    assert (folder / "page.html").stat().st_size <= 12_000
    head, arrays = held(folder / "page.html")
    times = arrays["time_s"]
    assert 2 < len(times) < 200
    assert (times[0], times[-1]) == (0, pytest.approx(1990 * 0.032768))
    number = len(head["events"])
    assert 0 < number < 1001
    assert head["events"][-1]["text"] == "throw 999"
    assert f"{len(times)} of 200 samples (every " in said[1]
    assert f"{number} of 1,001 events" in said[1]


def test_a_size_that_holds_no_two_samples_is_refused_with_one_that_does(
    written: RunWriter, folder: Path
) -> None:
    with pytest.raises(InputError, match=r"--size 0\.002: too small .* name 1 or more"):
        write_page([Run.open(written.folder)], folder / "page.html", 0.002)
    assert not (folder / "page.html").exists()


def test_what_a_run_left_out_is_left_out(begin: Begin, folder: Path) -> None:
    writer = begin("run", 'record.columns=["led"]')
    writer.add(samples(TICKS))
    write_page([Run.open(writer.folder)], folder / "page.html", 1.0)
    assert "x_m" not in held(folder / "page.html")[1]


def test_the_page_is_whole_and_loads_nothing(written: RunWriter, folder: Path) -> None:
    write_page([Run.open(written.folder)], folder / "page.html", 1.0)
    text = (folder / "page.html").read_text()
    assert "<style>p { color: red }</style>" in text
    assert r'const end = "<\/script>";</script>' in text
    assert "default-src 'none'" in text
    assert not re.search(r'(src|href)="', text)


def test_runs_without_samples_and_pages_that_cannot_be_written_are_refused(
    begin: Begin, written: RunWriter, folder: Path, page: Path
) -> None:
    with pytest.raises(InputError, match="no sample was recorded"):
        write_page([Run.open(begin("empty").folder)], folder / "page.html", 1.0)
    with pytest.raises(InputError, match=r"page\.html: cannot be written .*; name another file"):
        write_page([Run.open(written.folder)], folder / "none" / "page.html", 1.0)
    (page / "viewer.js").unlink()
    with pytest.raises(RunError, match="type: make setup"):
        write_page([Run.open(written.folder)], folder / "page.html", 1.0)
