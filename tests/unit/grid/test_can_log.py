"""can.log is what candump writes."""

import re
from pathlib import Path

import can
import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kilotwin.table.grid.can_log import CanLog
from kilotwin.table.grid.links import FRAME, Frames

frame = st.tuples(
    st.floats(0, 1e5),
    st.integers(0, 3),
    st.integers(0, 0x7FF),
    st.binary(max_size=8),
)


def frames_of(rows: list[tuple[float, int, int, bytes]]) -> Frames:
    frames = np.zeros(len(rows), dtype=FRAME)
    for index, (at_s, bus, identifier, data) in enumerate(rows):
        frames[index] = (at_s, bus, identifier, len(data), list(data.ljust(8, b"\0")), False)
    return frames


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
@given(st.lists(st.lists(frame, max_size=20), max_size=4))
def test_python_can_reads_it_back(
    tmp_path: Path, batches: list[list[tuple[float, int, int, bytes]]]
) -> None:
    file = tmp_path / "can.log"
    log = CanLog(file, ["can0", "can1", "vcan2", "x"], zero_s=1.7e9)
    for batch in batches:
        log.add(frames_of(batch))
    log.close()
    rows = [row for batch in batches for row in batch]
    with can.CanutilsLogReader(file) as reader:
        messages = list(reader)
    for (at_s, bus, identifier, data), message in zip(rows, messages, strict=True):
        assert abs(message.timestamp - (1.7e9 + at_s)) < 2e-6
        assert message.channel == ["can0", "can1", "vcan2", "x"][bus]
        assert message.arbitration_id == identifier
        assert bytes(message.data) == data


def test_a_line_is_as_candump_writes_it(tmp_path: Path) -> None:
    log = CanLog(tmp_path / "can.log", ["can0"], zero_s=1_700_000_000.0)
    log.add(frames_of([(0.25, 0, 0x43, b"\x14\xab"), (0.5, 0, 0x7FF, b"")]))
    log.flush()
    text = (tmp_path / "can.log").read_text()
    assert text == "(1700000000.250000) can0 043#14AB\n(1700000000.500000) can0 7FF#\n"
    assert all(
        re.fullmatch(r"\(\d{10}\.\d{6}\) \S+ [0-9A-F]{3}#[0-9A-F]*", line)
        for line in text.splitlines()
    )
    log.close()
