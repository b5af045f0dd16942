"""Arrays with a head in JSON, as pages in a browser take them without parsing or copying."""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

_BYTES = struct.Struct("<I")
_TURN = 2 * np.pi


def pack(head: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> bytes:
    """The head with the arrays' places, and these.

    The head's length is the first four bytes, little-endian; its `arrays` are name: [type, offset,
    length]. Arrays begin at multiples of 8 from the end of the head.
    """
    places, parts, at = {}, [], 0
    for name, values in arrays.items():
        data = np.ascontiguousarray(values).tobytes()
        places[name] = [values.dtype.name, at, values.size]
        padding = -len(data) % 8
        parts += [data, bytes(padding)]
        at += len(data) + padding
    text = json.dumps({**head, "arrays": places}).encode()
    text += b" " * (-(len(text) + _BYTES.size) % 8)
    return b"".join([_BYTES.pack(len(text)), text, *parts])


def head_of(data: bytes) -> dict[str, Any]:
    """The head alone. ValueError of what pack() did not make."""
    if len(data) < _BYTES.size:
        raise ValueError("no head")
    (length,) = _BYTES.unpack_from(data)
    head = json.loads(data[_BYTES.size : _BYTES.size + length])
    if not isinstance(head, dict):
        raise ValueError("a head that is no object")
    return head


def for_page(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Positions as float32, headings as uint16 in 2^16 parts of a turn, LEDs as bytes; others as
    they are."""
    made = {}
    for name, values in columns.items():
        if name.endswith("heading_rad"):
            turns = np.nan_to_num(values) / _TURN
            made[name] = (np.round((turns - np.floor(turns)) * 65536) % 65536).astype(np.uint16)
        else:
            kind = {"led": np.uint8, "m": np.float32}.get(name.rpartition("_")[2], values.dtype)
            made[name] = values.astype(kind)
    return made
