"""The C made from the DBC is current, compiles for the module, and means the same as the DBC."""

import ctypes
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.programs.image.flags import avr_words
from kilotwin.table.can import protocol

from .c_protocol import Codec, Transfer
from .conftest import INCLUDES, MADE, PROTOCOL, SOURCES, WARNINGS

NAMES = ["ToModule", "ToHost"]


def test_the_installed_c_is_what_the_dbc_makes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, PROTOCOL / "generate.py", tmp_path], check=True)
    for name in ("kilogrid_can.h", "kilogrid_can.c"):
        made, installed = (tmp_path / name).read_text(), (MADE / name).read_text()
        assert made == installed, "kilogrid.dbc has changed: make setup"


def test_a_python_without_cantools_is_told_which_has_it(tmp_path: Path) -> None:
    bare = [sys.executable, "-I", "-S", str(PROTOCOL / "generate.py"), str(tmp_path)]
    done = subprocess.run(bare, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "has no cantools, which makes C of the DBC; take .venv/bin/python" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="no avr-gcc here")
def test_the_protocol_compiles_for_the_module_without_a_warning(tmp_path: Path) -> None:
    for source in SOURCES:
        flags = [*avr_words("AVR_CHIP"), *avr_words("AVR_DIALECT"), *WARNINGS, *INCLUDES]
        command = ["avr-gcc", *flags, "-c"]
        subprocess.run([*command, source, "-o", tmp_path / f"{source.stem}.o"], check=True)


def test_a_module_keeps_its_transfers_in_the_memory_that_the_header_says() -> None:
    header = (PROTOCOL / "transfer.h").read_text()
    assert f"{ctypes.sizeof(Transfer)} bytes there" in header


def signals_of(message: str, kind: int) -> list[list[str]]:
    """The signals that frames of a type have, one list for each value of a part."""
    layouts = []
    for part in (0, 1):
        names = []
        for signal in protocol.database().get_message_by_name(message).signals:
            if signal.multiplexer_signal is None:
                names.append(signal.name)
                continue
            chosen = kind if signal.multiplexer_signal == "Type" else part
            owner = protocol.database().get_message_by_name(message)
            parent = owner.get_signal_by_name(signal.multiplexer_signal)
            of_type = parent.name == "Type" or kind in (parent.multiplexer_ids or ())
            if of_type and chosen in (signal.multiplexer_ids or ()):
                names.append(signal.name)
        if names not in layouts:
            layouts.append(names)
    return layouts


@pytest.mark.parametrize("message", NAMES)
@given(data=st.binary(min_size=8, max_size=8), draw=st.data())
def test_c_and_python_read_every_frame_alike(
    protocol_c: ctypes.CDLL, message: str, data: bytes, draw: st.DataObject
) -> None:
    kinds = protocol.types_to_module() if message == "ToModule" else protocol.types_to_host()
    kind = draw.draw(st.sampled_from(sorted(kinds.values())))
    first = kind if message == "ToModule" else data[0] & 0xC0 | kind
    part = draw.draw(st.sampled_from([0, 1])) if data[1] > 1 else data[1]
    data = bytes([first, part]) + data[2:]
    dbc = protocol.database().get_message_by_name(message)
    read = dbc.decode(data, decode_choices=False, scaling=False)
    assert isinstance(read, dict)
    codec = Codec(protocol_c, "to_module" if message == "ToModule" else "to_host")
    assert codec.unpack(data, list(read)) == read
    assert codec.pack({name: int(str(value)) for name, value in read.items()}) == dbc.encode(
        read, strict=False
    )


@pytest.mark.parametrize("message", NAMES)
def test_c_and_python_write_every_frame_alike(protocol_c: ctypes.CDLL, message: str) -> None:
    codec = Codec(protocol_c, "to_module" if message == "ToModule" else "to_host")
    kinds = protocol.types_to_module() if message == "ToModule" else protocol.types_to_host()
    dbc = protocol.database().get_message_by_name(message)

    @given(draw=st.data())
    def check(draw: st.DataObject) -> None:
        kind = draw.draw(st.sampled_from(sorted(kinds.values())))
        names = draw.draw(st.sampled_from(signals_of(message, kind)))
        signals = {"Type": kind}
        for name in names:
            if name != "Type":
                signal = dbc.get_signal_by_name(name)
                signals[name] = draw.draw(st.integers(0, int(signal.maximum or 0)))
        for name in ("IrPart", "HealthPart", "SizePart"):
            if name in signals:
                signals[name] = int(any(n in signals for n in ("IrType", "Version", "ImageId")))
        written = codec.pack(signals)
        assert written == dbc.encode(signals)
        assert codec.unpack(written, list(signals)) == signals

    check()
