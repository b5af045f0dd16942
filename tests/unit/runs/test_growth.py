"""The bound on what programs leave in a run folder."""

import os
from pathlib import Path

import pytest

from kilotwin.session.growth import Growth

PLENTY = 1 << 30


def test_a_folder_within_its_bounds_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "prints").mkdir()
    (tmp_path / "prints/robot-0.log").write_text("one")
    assert Growth(tmp_path, 2, PLENTY).too_much() == ""
    assert Growth(tmp_path / "none", 2, PLENTY).too_much() == ""


def test_files_and_folders_are_counted_at_any_depth(tmp_path: Path) -> None:
    (tmp_path / "a/b/c").mkdir(parents=True)
    growth = Growth(tmp_path, 2, PLENTY)
    assert growth.too_much() == "programs made files in its folder: there are more than 2"


def test_bytes_count_as_they_take_the_disk(tmp_path: Path) -> None:
    with (tmp_path / "hole").open("wb") as file:
        file.truncate(PLENTY)
    growth = Growth(tmp_path, 10, 100_000)
    assert growth.too_much() == ""
    (tmp_path / "full").write_bytes(bytes(200_000))
    assert "programs filled its folder" in growth.too_much()


def test_files_without_a_name_count_while_the_process_has_them_open(tmp_path: Path) -> None:
    with (tmp_path / "gone").open("wb") as file:
        file.write(bytes(200_000))
        file.flush()
        (tmp_path / "gone").unlink()
        assert "programs filled" in Growth(tmp_path, 1000, 100_000).too_much(os.getpid())
    assert Growth(tmp_path, 1000, 100_000).too_much(os.getpid()) == ""


def test_folders_nested_too_deep_to_be_named_are_too_much(tmp_path: Path) -> None:
    at = os.open(tmp_path, os.O_RDONLY)
    for _ in range(30):
        os.mkdir("x" * 250, dir_fd=at)
        inner = os.open("x" * 250, os.O_RDONLY, dir_fd=at)
        os.close(at)
        at = inner
    os.close(at)
    assert "folder that cannot be read" in Growth(tmp_path, 1000, PLENTY).too_much()


def test_while_a_process_runs_looks_are_as_seldom_as_they_are_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kilotwin.session.growth._REST", 1e9)
    growth = Growth(tmp_path, 100, PLENTY)
    assert growth.too_much(os.getpid()) == ""
    for number in range(200):
        (tmp_path / str(number)).touch()
    assert growth.too_much(os.getpid()) == ""
    assert growth.too_much() != ""
