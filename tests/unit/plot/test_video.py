"""A video shows the run: robots where they were recorded, at the times that were asked for."""

from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from kilotwin.errors import InputError, RunError
from kilotwin.runs.folder import add_to_manifest
from kilotwin.runs.palette import state_colours
from kilotwin.runs.reader import Run
from kilotwin.runs.sampling import DECISION_S
from kilotwin.studies.plot.video import Film, write_video

from ..conftest import SMALL
from ..known_run import Begin, samples

STATES = "\n[states]\nasleep = [0, 0, 0]\nawake = [0, 3, 0]\n"
SECOND = 31  # ticks, nearly


def quiet(_: float) -> None:
    """Progress that is not shown."""


@pytest.fixture
def run(begin: Begin) -> Run:
    """Ten robots asleep that go along a line, one behind the other, for 20 s."""
    writer = begin(text=SMALL + STATES)
    for number in range(21):
        one = samples([number * SECOND])
        one["x_m"][0] = np.linspace(-1.8, 0.0, 10) + 0.05 * number
        one["y_m"][0] = -0.8
        one["led"][0] = 0
        writer.add(one)
    writer.close(clean=True)
    return Run.open(writer.folder)


def frames(file: Path) -> list[np.ndarray]:
    """Pictures of a GIF."""
    with Image.open(file) as gif:
        made = []
        for number in range(getattr(gif, "n_frames", 1)):
            gif.seek(number)
            made.append(np.asarray(gif.convert("RGB")))
        return made


def middle_of_robots(frame: np.ndarray) -> float:
    """The column in the middle of what is drawn in the colour of the first state."""
    blue = np.abs(frame.astype(int) - (0xCC, 0x79, 0xA7)).sum(axis=2) < 40
    table = blue[:, : round(0.74 * frame.shape[1])]
    assert table.any()
    return float(np.nonzero(table)[1].mean())


def test_robots_go_where_the_run_says(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "run.gif"
    said = write_video(run, file, Film(speed=5, width_px=480), quiet)
    pictures = frames(file)
    assert len(pictures) == int(20 * SECOND * 0.032768 / 5 * 25) + 1
    assert f"{len(pictures)} frames of 480 x 360" in said
    moved = middle_of_robots(pictures[-1]) - middle_of_robots(pictures[0])
    pixel_m = 4 * 1.04 / (480 * 0.7)  # the arena with its margin, in the axes' width
    pixel_m = max(pixel_m, 4 * 1.04 / (360 * 0.87))
    assert moved * pixel_m == pytest.approx(1.0, abs=0.05)
    half = middle_of_robots(pictures[len(pictures) // 2]) - middle_of_robots(pictures[0])
    assert half == pytest.approx(moved / 2, abs=2)


def test_a_video_says_when_robots_change_their_led_between_its_samples(
    run: Run, tmp_path: Path
) -> None:
    assert "colours" not in write_video(run, tmp_path / "a.gif", Film(speed=5, width_px=480), quiet)
    still = frames(tmp_path / "a.gif")[0]
    add_to_manifest(run.folder, {"summary": {DECISION_S: 0.4}})
    run = Run.open(run.folder)
    said = write_video(run, tmp_path / "b.gif", Film(speed=5, width_px=480), quiet)
    assert "colours and places are known each 10 s only" in said
    below = slice(round(0.95 * still.shape[0]), None)
    assert not np.array_equal(frames(tmp_path / "b.gif")[0][below], still[below])
    said = write_video(run, tmp_path / "c.gif", Film(speed=250, width_px=480), quiet)
    assert "colours" not in said  # a frame is 10 s


def many(names: list[str]) -> str:
    """[states] with these names: the first is the LED's byte 0, the next 1, ..."""
    rows = (f"{name} = [{k % 4}, {k // 4 % 4}, {k // 16}]\n" for k, name in enumerate(names))
    return "\n[states]\n" + "".join(rows)


def coloured(begin: Begin, names: list[str], name: str = "small") -> Run:
    """Two samples of ten robots, one in each of the states and the others in the first."""
    writer = begin("run", f"name={name}", text=SMALL + many(names))
    for number in range(2):
        one = samples([number * SECOND])
        one["x_m"][0] = np.linspace(-1.8, 1.8, 10)
        one["y_m"][0] = 0.8
        one["led"][0] = [k if k < len(names) else 0 for k in range(10)]
        writer.add(one)
    writer.close(clean=True)
    return Run.open(writer.folder)


def test_every_frame_of_a_gif_has_the_colours_of_all_states(begin: Begin, tmp_path: Path) -> None:
    names = ["walking", "entering", "resting", "leaving", "avoiding", "lost", "found"]
    run = coloured(begin, names)
    write_video(run, tmp_path / "run.gif", Film(speed=1, width_px=360), quiet)
    for frame in frames(tmp_path / "run.gif"):
        legend = frame[:, round(0.74 * frame.shape[1]) :].reshape(-1, 3).astype(int)
        for name, colour in state_colours(names).items():
            off = np.abs(legend - np.round(255 * np.array(to_rgb(colour)))).max(axis=1)
            assert off.min() <= 2, name
        white = (legend == 255).all(axis=1)
        assert white.mean() > 0.8


@pytest.mark.parametrize(
    "names",
    [
        ["avoiding_an_obstacle_that_is_close_ahead", "at_rest"],
        [f"state_{number}" for number in range(40)],
    ],
)
@pytest.mark.parametrize("width_px", [160, 960])
def test_heading_and_legend_are_whole(
    names: list[str], width_px: int, begin: Begin, tmp_path: Path
) -> None:
    run = coloured(
        begin, names, "an experiment whose name says all that is in it and goes on for long"
    )
    write_video(run, tmp_path / "run.gif", Film(speed=1, width_px=width_px), quiet)
    (frame, *_) = frames(tmp_path / "run.gif")
    margin = max(1, width_px // 160)
    assert (frame[:, -margin:] > 200).all()
    assert (frame[-margin:] > 200).all()
    right = frame[:, round(0.75 * width_px) :]
    dots = [
        (
            np.abs(right.astype(int) - np.round(255 * np.array(to_rgb(colour)))).max(axis=2) < 60
        ).any()
        for colour in state_colours(names).values()
    ]
    assert all(dots)


def test_the_same_run_gives_the_same_frames(run: Run, tmp_path: Path) -> None:
    for name in ("one.gif", "two.gif"):
        write_video(run, tmp_path / name, Film(speed=20, width_px=320, trails=True), quiet)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()


def test_a_zoom_begins_in_the_middle_and_ends_with_the_whole_table(
    run: Run, tmp_path: Path
) -> None:
    write_video(run, tmp_path / "near.gif", Film(speed=20, width_px=320, zoom_m=0.5), quiet)
    write_video(run, tmp_path / "whole.gif", Film(speed=20, width_px=320), quiet)
    near, whole = frames(tmp_path / "near.gif"), frames(tmp_path / "whole.gif")
    table = slice(60, 200), slice(30, 200)
    assert (near[0][table] == near[0][100, 100]).all()  # the robots are at the lower edge
    assert not (whole[0][table] == near[0][100, 100]).all()
    same = [np.array_equal(*pair) for pair in zip(near, whole, strict=True)]
    assert not any(same[: len(same) // 2])
    assert all(same[-len(same) // 5 + 1 :])


@pytest.mark.parametrize("zoom_m", [0, -1, 4.5])
def test_a_zoom_that_the_table_has_no_room_for_is_refused(zoom_m: float, run: Run) -> None:
    with pytest.raises(InputError, match=f"--zoom {zoom_m:g}: .* than the table has, 4"):
        write_video(run, run.folder / "x.gif", Film(zoom_m=zoom_m), quiet)
    assert not (run.folder / "x.gif").exists()


@pytest.mark.parametrize(("suffix", "magic"), [("mp4", b"ftyp"), ("webm", b"\x1a\x45\xdf\xa3")])
def test_a_video_is_of_the_kind_that_its_name_says(
    suffix: str, magic: bytes, run: Run, tmp_path: Path
) -> None:
    file = tmp_path / "films" / f"run.{suffix}"
    parts: list[float] = []
    write_video(run, file, Film(speed=40, width_px=320), parts.append)
    assert magic in file.read_bytes()[:12]
    assert parts == sorted(parts)
    assert 0.8 < parts[-1] < 1
    assert [other.name for other in file.parent.iterdir()] == [file.name]


def test_without_a_speed_it_takes_half_a_minute_and_never_less_than_real_time(
    run: Run, tmp_path: Path
) -> None:
    assert "at 1 times real time" in write_video(
        run, tmp_path / "run.gif", Film(to_s=2, width_px=160), quiet
    )


@pytest.mark.parametrize(
    ("film", "said"),
    [
        (Film(from_s=30), "--from 30 --to 20.* recorded from 0 s to 20 s; name a part"),
        (Film(from_s=5, to_s=5), "name a part of that"),
        (Film(from_s=-1), "name a part of that"),
    ],
)
def test_a_part_that_the_run_has_not_is_refused(film: Film, said: str, run: Run) -> None:
    with pytest.raises(InputError, match=said):
        write_video(run, run.folder / "x.gif", film, quiet)
    assert not (run.folder / "x.gif").exists()


def test_another_kind_of_file_is_refused_with_those_that_there_are(run: Run) -> None:
    with pytest.raises(InputError, match=r"end the name in \.mp4, \.webm or \.gif"):
        write_video(run, Path("run.avi"), Film(), quiet)


@pytest.mark.parametrize("left_out", ["x_m", "y_m"])
def test_a_run_without_places_is_refused_as_a_map_of_it_is(
    left_out: str, begin: Begin, tmp_path: Path
) -> None:
    columns = ", ".join(f'"{name}"' for name in ("x_m", "y_m", "led") if name != left_out)
    writer = begin("placeless", f"record.columns=[{columns}]")
    writer.add(samples([0, 100]))
    with pytest.raises(InputError, match=f"left out {left_out}, which is needed here; add it"):
        write_video(Run.open(writer.folder), tmp_path / "x.gif", Film(), lambda _: None)


def test_a_video_that_the_disk_has_no_room_for_leaves_the_one_that_was_there(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # An encoder that may write 4 KiB stands for a full disk.
    encoder = tmp_path / "ffmpeg"
    real = imageio_ffmpeg.get_ffmpeg_exe()
    encoder.write_text(f"#!/bin/sh\ntrap '' XFSZ\nulimit -f 8\nexec {real} \"$@\"\n")
    encoder.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(encoder))
    target = tmp_path / "run.mp4"
    target.write_bytes(b"the one before")
    with pytest.raises(RunError, match=r"-o .*run\.mp4: ffmpeg cannot encode it \(.*too large"):
        write_video(run, target, Film(speed=2, width_px=960), quiet)
    assert target.read_bytes() == b"the one before"
    assert sorted(file.name for file in tmp_path.iterdir() if "run.mp4" in file.name) == ["run.mp4"]
