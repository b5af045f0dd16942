"""The frames that the controller sends and understands, made once: what python-can carries.

What a frame means is said by `kilogrid_modules/protocol`; here are only its ready-made bytes.
"""

from kilotwin.grid.cover import Group
from kilotwin.grid.layout import Module

IDS = 2048
TYPE_MASK = 0x3F
CELL_SHIFT = 6
START, TRACKING, MODULE_DATA = 0x14, 0x11, 0x13
START_BYTES, TRACKING_BYTES, FRAME_BYTES = 2, 8, 8
MOST_RECORDS = 10
HEALTH_PARTS = 2
RUNNING = 7
STOP, IDLE, SETUP, RUN = (bytes([t]).ljust(8, b"\0") for t in (0x02, 0x0B, 0x0C, 0x0D))
TRACKING_REQUEST = b"\x15"


def id_of_group(group: Group) -> int:
    return (0 if group.y is None else group.y + 1) << 6 | (
        0 if group.x is None else group.x + 1
    ) << 1


def id_of_module(module: Module) -> int:
    return id_of_group(Group(*module))


def id_from_module(module: Module) -> int:
    return id_of_module(module) | 1


def module_of_id(identifier: int) -> Module:
    return (identifier >> 1 & 31) - 1, (identifier >> 6) - 1


def forward(message: bytes) -> tuple[bytes, bytes]:
    return bytes([1, 0]) + message[:6], bytes([1, 1]) + message[6:9] + message[9:10] + b"\0\0"


def configuration(data: bytes) -> list[bytes]:
    out = [bytes([0x0F, 0, len(data)]).ljust(8, b"\0")]
    for n in range(0, len(data), 6):
        out.append((bytes([0x10, n // 6]) + data[n : n + 6]).ljust(8, b"\0"))
    return out


def health_request(part: int) -> bytes:
    return bytes([0x13, part])


def health(data: bytes) -> dict[str, int]:
    if data[1] == 0:
        return {
            "State": data[2],
            "ConfigSize": data[3],
            "ConfigCrc": data[4] | data[5] << 8,
            "LostRecords": data[6],
            "RefusedFrames": data[7],
        }
    return {
        "TransmitErrors": data[2],
        "ReceiveErrors": data[3],
        "Uptime": data[4] | data[5] << 8,
        "Version": data[6],
    }


def checksum(data: bytes) -> int:
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc
