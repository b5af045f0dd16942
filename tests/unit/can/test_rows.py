"""Every row of the specification's table of frames (hardware.md 3.2), byte for byte, in C and in
Python."""

import ctypes
from typing import Any

import pytest

from kilotwin.table.can import protocol, transfer

from .c_protocol import Codec

CHUNK: dict[str, int] = {"Sequence": 7, **{f"Byte{i}": 0xA0 + i for i in range(6)}}
IR_FIRST = {"IrPart": 0, **{f"IrData{i}": i + 1 for i in range(6)}}
IR_SECOND = {"IrPart": 1, "IrData6": 7, "IrData7": 8, "IrData8": 9, "IrType": 0x88}
SIZE = {"SizePart": 0, "Pages": 220}
CHECK = {"SizePart": 1, "ImageCrc": 0x1234, "ImageId": 0xDEADBEEF}

# name, signals, the bytes on the wire
TO_MODULE: list[tuple[str, dict[str, int], str]] = [
    ("MODULE_USER", CHUNK, "00 07 A0 A1 A2 A3 A4 A5"),
    ("FORWARD_IR_MESSAGE", IR_FIRST, "01 00 01 02 03 04 05 06"),
    ("FORWARD_IR_MESSAGE", IR_SECOND, "01 01 07 08 09 88 00 00"),
    ("FORWARD_IR_MESSAGE_STOP", {}, "02 00 00 00 00 00 00 00"),
    ("KILO_BOOTPAGE", CHUNK, "03 07 A0 A1 A2 A3 A4 A5"),
    ("KILO_BOOTPAGE_SIZE", SIZE, "04 00 DC 00 00 00 00 00"),
    ("KILO_BOOTPAGE_SIZE", CHECK, "04 01 34 12 EF BE AD DE"),
    ("KILO_BOOTPAGE_NUMBER", {"Page": 219}, "05 00 DB 00 00 00 00 00"),
    ("MODULE_BOOT", {}, "06 00 00 00 00 00 00 00"),
    ("MODULE_BOOTPAGE", CHUNK, "07 07 A0 A1 A2 A3 A4 A5"),
    ("MODULE_BOOTPAGE_SIZE", SIZE, "08 00 DC 00 00 00 00 00"),
    ("MODULE_BOOTPAGE_SIZE", CHECK, "08 01 34 12 EF BE AD DE"),
    ("MODULE_BOOTPAGE_NUMBER", {"Page": 219}, "09 00 DB 00 00 00 00 00"),
    ("MODULE_KILOBOT_SETUP", {}, "0A 00 00 00 00 00 00 00"),
    ("MODULE_IDLE", {}, "0B 00 00 00 00 00 00 00"),
    ("MODULE_SETUP", {}, "0C 00 00 00 00 00 00 00"),
    ("MODULE_RUN", {}, "0D 00 00 00 00 00 00 00"),
    ("MODULE_PAUSE", {}, "0E 00 00 00 00 00 00 00"),
    ("MODULE_CONFIG_SIZE", {"ConfigSize": 48}, "0F 00 30 00 00 00 00 00"),
    ("MODULE_CONFIG_TRANSFER", CHUNK, "10 07 A0 A1 A2 A3 A4 A5"),
    ("KILOBOT_DATA", CHUNK, "12 07 A0 A1 A2 A3 A4 A5"),
    ("MODULE_DATA", {"HealthPart": 1}, "13 01"),
    ("TRACKING_REQ", {}, "15"),
    (
        "MODULE_BOOTPAGE_CRC",
        {"First": 219, "PageCrc0": 0x0102, "PageCrc1": 0x0304, "PageCrc2": 0x0506},
        "16 DB 02 01 04 03 06 05",
    ),
    ("MODULE_BOOT_QUERY", {"First": 0xE0}, "17 E0 00 00 00 00 00 00"),
    (
        "ROBOT_QUERY",
        {"First": 0xE1, "SlotsLog2": 5, "Nonce": 7, "Uid": 0xFFFF},
        "19 E1 05 07 FF FF 00 00",
    ),
    # Boot loaders in the field want 0x9F more.
    ("OLD_MODULE_BOOTPAGE", CHUNK, "A6 07 A0 A1 A2 A3 A4 A5"),
    ("OLD_MODULE_BOOTPAGE_SIZE", SIZE, "A7 00 DC 00 00 00 00 00"),
    ("OLD_MODULE_BOOTPAGE_SIZE", CHECK, "A7 01 34 12 EF BE AD DE"),
    ("OLD_MODULE_BOOTPAGE_NUMBER", {"Page": 219}, "A8 00 DB 00 00 00 00 00"),
    ("OLD_MODULE_IDLE", {}, "AA 00 00 00 00 00 00 00"),
]

USER_DATA = {f"UserData{i}": i + 1 for i in range(7)}
HEALTH = {
    "HealthPart": 0,
    "State": 7,
    "ConfigSize": 4,
    "ConfigCrc": 0x1234,
    "LostRecords": 5,
    "RefusedFrames": 6,
}
BUS_HEALTH = {
    "HealthPart": 1,
    "TransmitErrors": 96,
    "ReceiveErrors": 127,
    "Uptime": 0x0102,
    "Version": 1,
}
TO_HOST: list[tuple[str, dict[str, int], str, Any]] = [
    (
        "MODULE_USER",
        CHUNK,
        "00 07 A0 A1 A2 A3 A4 A5",
        protocol.UserFrame(bytes.fromhex("0007A0A1A2A3A4A5")),
    ),
    (
        "TRACKING_KILOBOT",
        {"Cell": 0, **USER_DATA},
        "11 01 02 03 04 05 06 07",
        protocol.Tracking(0, bytes(range(1, 8))),
    ),
    (
        "TRACKING_KILOBOT",
        {"Cell": 3, **USER_DATA},
        "D1 01 02 03 04 05 06 07",
        protocol.Tracking(3, bytes(range(1, 8))),
    ),
    (
        "KILOBOT_DATA",
        CHUNK,
        "12 07 A0 A1 A2 A3 A4 A5",
        protocol.UserFrame(bytes.fromhex("1207A0A1A2A3A4A5")),
    ),
    (
        "MODULE_DATA",
        HEALTH,
        "13 00 07 04 34 12 05 06",
        protocol.Health(protocol.ModuleState.RUNNING, 4, 0x1234, 5, 6),
    ),
    ("MODULE_DATA", BUS_HEALTH, "13 01 60 7F 02 01 01 00", protocol.BusHealth(96, 127, 0x0102, 1)),
    ("TRACKING_KILOBOT_START", {"Records": 10}, "14 0A", protocol.Records(10)),
    (
        "MODULE_BOOT_REPORT",
        {"First": 32, "Missing": 0x80000001, "LoaderState": 1, "IdLow": 0xEF},
        "18 20 01 00 00 80 01 EF",
        protocol.BootReport(32, 0x80000001, 1, 0xEF),
    ),
    (
        "ROBOT_REPORT",
        {"Cell": 2, "Uid": 0x1234, "Answer": 0xDEADBEEF, "RobotState": 0x14},
        "9A 34 12 EF BE AD DE 14",
        protocol.RobotReport(2, 0x1234, 0xDEADBEEF, 0x14),
    ),
    ("HOST_PRESENT", {}, "1B 00 00 00 00 00 00 00", protocol.HostPresent(bytes(7))),
]


@pytest.mark.parametrize(("name", "signals", "wire"), TO_MODULE)
def test_a_frame_to_modules_is_these_bytes(
    protocol_c: ctypes.CDLL, name: str, signals: dict[str, int], wire: str
) -> None:
    data = bytes.fromhex(wire)
    number = protocol.types_to_module()[name]
    assert protocol.to_module(name, **signals) == data
    assert protocol.read_to_module(data) == {"Type": name, **signals}
    codec = Codec(protocol_c, "to_module")
    assert codec.pack({"Type": number, **signals})[: len(data)] == data
    assert codec.unpack(data, ["Type", *signals]) == {"Type": number, **signals}
    assert protocol_c.kilogrid_dlc_to_module(number) == len(data) == protocol.dlc_to_module(name)


@pytest.mark.parametrize(("name", "signals", "wire", "meaning"), TO_HOST)
def test_a_frame_to_the_host_is_these_bytes(
    protocol_c: ctypes.CDLL, name: str, signals: dict[str, int], wire: str, meaning: object
) -> None:
    data = bytes.fromhex(wire)
    number = protocol.types_to_host()[name]
    assert protocol.read_to_host(data) == meaning
    readable = {**signals, "State": "RUNNING"} if "State" in signals else signals
    assert protocol.signals_to_host(data) == {"Type": name, **readable}
    codec = Codec(protocol_c, "to_host")
    assert codec.pack({"Type": number, **signals})[: len(data)] == data
    assert codec.unpack(data, ["Type", *signals]) == {"Type": number, **signals}
    assert protocol_c.kilogrid_dlc_to_host(number) == len(data)


def test_the_table_has_every_frame_of_the_dbc() -> None:
    assert {name for name, *_ in TO_MODULE} == set(protocol.types_to_module())
    assert {name for name, *_ in TO_HOST} == set(protocol.types_to_host())


def test_states_and_types_are_those_of_the_dbc() -> None:
    state = protocol.database().get_message_by_name("ToHost").get_signal_by_name("State")
    assert {s.value: s.name for s in protocol.ModuleState} == {
        number: str(name) for number, name in (state.choices or {}).items()
    }


@pytest.mark.parametrize("name", sorted(set(protocol.types_to_host())))
def test_a_frame_to_the_host_that_is_too_short_is_an_error_in_c_and_python(
    protocol_c: ctypes.CDLL, name: str
) -> None:
    number = protocol.types_to_host()[name]
    least: int = protocol_c.kilogrid_least_dlc_to_host(number)
    for length in range(9):
        data = bytes([number, *bytes(7)])[:length]
        if length >= least:
            protocol.read_to_host(data)
        else:
            with pytest.raises(protocol.FrameError):
                protocol.read_to_host(data)


@pytest.mark.parametrize(
    ("wire", "reason"),
    [("", "1 to 8"), ("14 0B 00 00 00 00 00 00 00", "1 to 8"), ("13 02" + 6 * "00", "2")],
)
def test_a_frame_that_no_module_sends_is_an_error(wire: str, reason: str) -> None:
    with pytest.raises(protocol.FrameError, match=reason):
        protocol.read_to_host(bytes.fromhex(wire))


def test_unlisted_types_go_to_whoever_knows_them() -> None:
    for number in set(range(64)) - set(protocol.types_to_host().values()):
        assert protocol.read_to_host(bytes([number, 9])) == protocol.UserFrame(bytes([number, 9]))
        assert protocol.signals_to_host(bytes([number, 9])) == {"Type": number}


def test_a_frame_that_cannot_be_written_says_why() -> None:
    for name, signals in (
        ("MODULE_DANCE", {}),
        ("MODULE_CONFIG_SIZE", {}),
        ("MODULE_CONFIG_SIZE", {"ConfigSize": 49}),
        ("MODULE_CONFIG_SIZE", {"ConfigSize": -1}),
        ("KILO_BOOTPAGE_NUMBER", {"Page": 220}),
    ):
        with pytest.raises(protocol.FrameError, match=name):
            protocol.to_module(name, **signals)


def test_an_infrared_message_is_two_frames() -> None:
    frames = [frame.data.hex(" ").upper() for frame in transfer.infrared(bytes(range(1, 10)), 0x88)]
    assert frames == [wire for name, _, wire in TO_MODULE if name == "FORWARD_IR_MESSAGE"]
