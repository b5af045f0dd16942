"""Prints of robots, in a file each."""

from pathlib import Path

from kilotwin.experiment.schema.record import Record
from kilotwin.runs.prints import PrintLimit, Prints


def test_each_robot_has_its_file_with_times(tmp_path: Path) -> None:
    prints = Prints(tmp_path / "prints")
    prints.add(3, 305, "one\ntwo\n")
    prints.add(12, 306, "other\n")
    prints.write()
    prints.add(3, 610, "three\n")
    prints.write()
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
        prints.write()
    assert (tmp_path / "prints/robot-0.log").read_text() == (
        "[     0.033 s, tick       1] half a line\n[     0.066 s, tick       2] and another"
    )


def test_without_prints_there_is_no_folder(tmp_path: Path) -> None:
    Prints(tmp_path / "prints").write()
    assert list(tmp_path.iterdir()) == []


def test_prints_beyond_the_limits_are_counted_by_robot_and_module() -> None:
    limit = PrintLimit(Record(sample_s=1, prints_per_robot=2, prints=4))
    printed = [("robot", 1), ("robot", 1), ("robot", 1), ("robot", 1), ("module", (2, 3))]
    printed += [("robot", 5), ("robot", 6)]
    events = [
        {"kind": "print", "tick": tick, who: number, "text": "x"}
        for tick, (who, number) in enumerate(printed)
    ]
    admitted = [limit.admits(event) for event in events]
    assert admitted == [True, True, False, False, True, True, False]
    first, second = limit.left_out()
    assert (first["robot"], first["tick"], first["kind"]) == (1, 2, "left_out")
    assert first["text"].startswith("2 more prints are left out")
    assert (second["robot"], second["tick"]) == (6, 6)
    assert second["text"].startswith("1 more prints are left out")


def test_all_prints_are_kept_within_the_limits() -> None:
    limit = PrintLimit(Record(sample_s=1, prints_per_robot=1, prints=1))
    assert limit.admits({"kind": "print", "tick": 0, "robot": 0, "text": "x"})
    assert list(limit.left_out()) == []
