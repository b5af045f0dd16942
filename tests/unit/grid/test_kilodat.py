"""`.kilodat`: what is written is read again, and a lab's file is understood."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kilotwin.errors import InputError
from kilotwin.experiment.spec.serials import read_serials
from kilotwin.table.grid import kilodat
from kilotwin.table.grid.poller import Reports

rows = st.tuples(
    st.integers(0, 30),
    st.integers(0, 30),
    st.integers(0, 3),
    st.floats(0, 1e6),
    st.binary(min_size=7, max_size=7),
)


def reports_of(rows: list[tuple[int, int, int, float, bytes]]) -> Reports:
    x, y, cell = (np.array([row[n] for row in rows], dtype=np.uint8) for n in range(3))
    data = np.frombuffer(b"".join(row[4] for row in rows), dtype=np.uint8).reshape(-1, 7)
    return Reports(np.array([row[3] for row in rows], dtype=float), x, y, cell, data)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(rows, max_size=20))
def test_what_is_written_is_read_again(
    tmp_path: Path, written: list[tuple[int, int, int, float, bytes]]
) -> None:
    file = tmp_path / "a.kilodat"
    writer = kilodat.Writer(file, {7: "2066/3"})
    for part in (written[:7], written[7:]):
        writer.add(reports_of(part))
    writer.close()
    for (x, y, cell, time_s, data), report in zip(written, kilodat.read(file), strict=True):
        assert (report.x, report.y, report.cell, report.data) == (x, y, cell, data)
        assert report.serial == ("2066/3" if data[0] & 0x7F == 7 else str(data[0] & 0x7F))
        assert 0 <= time_s - report.time_s < kilodat.UNIT_S + 1e-6


def test_the_file_is_the_labs(tmp_path: Path) -> None:
    file = tmp_path / "a.kilodat"
    writer = kilodat.Writer(file)
    writer.add(reports_of([(3, 14, 2, 10.5, bytes([0x85, 1, 2, 3, 4, 5, 6]))]))
    writer.flush()
    assert file.read_bytes() == (
        b"modulex\tmoduley\tc\ttimestamp\tkilobot_sn\tdata0\tdata1\tdata2\tdata3\tdata4\tdata5\tdata6\n"
        b"3\t14\t2\t10\t5\t133\t1\t2\t3\t4\t5\t6\n"
    )
    writer.close()


def test_a_line_that_is_no_report_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.kilodat"
    file.write_text("modulex\tmoduley\n1\t2\t3\n")
    with pytest.raises(InputError, match=r"a\.kilodat:2: '1\t2\t3' is no report"):
        kilodat.read(file)


def test_a_report_has_a_serial_and_at_least_one_byte(tmp_path: Path) -> None:
    file = tmp_path / "a.kilodat"
    file.write_text("1\t2\t3\t4\t2066/3\t255\n")
    assert [(one.serial, one.data) for one in kilodat.read(file)] == [("2066/3", b"\xff")]
    file.write_text("1\t2\t3\t4\t2066/3\n")
    with pytest.raises(InputError, match="is no report"):
        kilodat.read(file)


def test_serials_are_looked_up_by_the_low_bits_of_the_id(tmp_path: Path) -> None:
    file = tmp_path / "kilobot_ids"
    file.write_text("# serial, id\n9001\t129\n9002\t2\n")
    assert read_serials(file) == {1: "9001", 2: "9002"}
    file.write_text("9001\t129\n9002\t1\n")
    with pytest.raises(InputError, match=":2: id 1 has the low 7 bits of another"):
        read_serials(file)
    file.write_text("kilobot_sn\tkilobot_id\n2066/3\t48\n01087\t6\n")
    assert read_serials(file) == {48: "2066/3", 6: "01087"}
    file.write_text("2066/3\t48\nkilobot_sn\tkilobot_id\n")
    with pytest.raises(InputError, match=":2: 'kilobot_sn\tkilobot_id' is not a serial and an id"):
        read_serials(file)
    file.write_text("9001 x\n")
    with pytest.raises(InputError, match=":1: '9001 x' is not a serial and an id"):
        read_serials(file)
