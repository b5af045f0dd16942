"""The checksum of kilolib's messages, which also guards configurations and images."""

import binascii

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_BEGIN = 0xFFFF


def message_crc(data: bytes) -> int:
    """CRC-16/MCRF4XX of any number of bytes (hardware.md 1.5).

    firmware/kilolib/core/message_crc.c computes the same. It is the CRC of the standard library
    with the bits of every byte, and of the result, in the other order.
    """
    crc = binascii.crc_hqx(data.translate(_REVERSED), _BEGIN)
    return int(f"{crc:016b}"[::-1], 2)
