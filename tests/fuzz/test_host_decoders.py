"""The host's decoders take any frame: they read it or raise the one error that callers expect."""

import contextlib

from hypothesis import given, settings
from hypothesis import strategies as st

from kilotwin.can import address, protocol


@settings(max_examples=1000, deadline=None, database=None)
@given(data=st.binary(max_size=9))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    with contextlib.suppress(protocol.FrameError):
        read = protocol.read_to_host(data)
        if isinstance(read, protocol.Tracking):
            assert len(read.data) == 7
            assert 0 <= read.cell <= 3
        elif isinstance(read, protocol.UserFrame):
            assert read.data == data
    for readable in (protocol.read_to_module, protocol.signals_to_host):
        with contextlib.suppress(protocol.FrameError):
            assert "Type" in readable(data)


@settings(deadline=None, database=None)
@given(identifier=st.integers(-(2**40), 2**40) | st.integers(0, 0x7FF))
def test_any_identifier_is_read_or_refused(identifier: int) -> None:
    with contextlib.suppress(ValueError):
        assert address.to_id(address.from_id(identifier)) == identifier
