"""Prints of robots, in a file each."""

from pathlib import Path

from kilotwin.runs.prints import Prints


def test_each_robot_has_its_file_with_times(tmp_path: Path) -> None:
    prints = Prints(tmp_path / "prints")
    prints.add(3, 305, "one\ntwo\n")
    prints.add(12, 306, "other\n")
    prints.add(3, 610, "three\n")
    assert (tmp_path / "prints/robot-3.log").read_text() == (
        "[     9.994 s, tick     305] one\n"
        "[     9.994 s, tick     305] two\n"
        "[    19.988 s, tick     610] three\n"
    )
    assert (tmp_path / "prints/robot-12.log").read_text().endswith("] other\n")


def test_a_line_in_parts_has_the_time_of_its_begin(tmp_path: Path) -> None:
    prints = Prints(tmp_path / "prints")
    for tick, part in [(1, "half "), (1, ""), (2, "a line\nand "), (3, "another")]:
        prints.add(0, tick, part)
    assert (tmp_path / "prints/robot-0.log").read_text() == (
        "[     0.033 s, tick       1] half a line\n[     0.066 s, tick       2] and another"
    )


def test_without_prints_there_is_no_folder(tmp_path: Path) -> None:
    Prints(tmp_path / "prints")
    assert list(tmp_path.iterdir()) == []
