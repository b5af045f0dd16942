"""Figures are drawn of whole and of broken runs, and say what they show."""

import errno
import hashlib
import re
import shutil
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from kilotwin.errors import InputError
from kilotwin.plot import write_figure
from kilotwin.plot.style import site_fills, state_colours
from kilotwin.run_folder import close_manifest

from .conftest import BLINK, INFORMED, SMALL, Load, call_kilotwin

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
        "timeline": ["time (s)", "robots (at the end)", "wanted on black: 7"],
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


def test_a_timeline_tells_parts_of_a_second_and_an_equal_wish_once(
    tmp_path: Path, fake_environment: dict[str, str]
) -> None:
    (tmp_path / "small.toml").write_text(SMALL + INFORMED)
    (tmp_path / "blink.c").write_text(BLINK)
    wish = ["swarm.informed=0.5", "swarm.informed_for={black=0.5,white=0.5}", "duration_s=20"]
    words = [
        "run",
        "small.toml",
        "--out",
        "run",
        *(part for key in wish for part in ("--set", key)),
    ]
    call_kilotwin(tmp_path, fake_environment, *words)
    write_figure("timeline", tmp_path / "run", tmp_path / "timeline.svg")
    comments = re.findall(r"<!-- (.*?) -->", (tmp_path / "timeline.svg").read_text())
    assert "wanted on black and white: 5 each" in comments
    assert {"2.5", "7.5"} <= set(comments)
