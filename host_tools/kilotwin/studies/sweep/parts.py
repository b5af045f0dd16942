"""A finished trial's file: an Arrow stream, and behind it the SHA-256 of its bytes.

Readers of Arrow streams stop at the stream's own end, and do not see what follows it.
"""

import hashlib
import json
from pathlib import Path

import pyarrow as pa

from kilotwin.studies.sweep.measure import RESULT, RESULT_KEYS

_SEAL_BYTES = hashlib.sha256().digest_size
_STREAM_END = b"\xff\xff\xff\xff\0\0\0\0"


def sealed(stream: bytes) -> bytes:
    """The file's content."""
    return stream + hashlib.sha256(stream).digest()


def read(file: Path) -> bytes | None:
    """The stream; None if the file is not there, cut, or otherwise damaged."""
    try:
        content = file.read_bytes()
    except OSError:
        return None
    if content == sealed(content[:-_SEAL_BYTES]):
        return content[:-_SEAL_BYTES]
    # A part of a Kilotwin that did not seal yet.
    return content if is_whole(content) else None


def is_whole(content: bytes) -> bool:
    """Whether it is a whole stream with a result."""
    if not content.endswith(_STREAM_END):
        return False
    try:
        table = pa.ipc.open_stream(content).read_all()
        table.validate(full=True)
        return set(json.loads(table.schema.metadata[RESULT])) >= set(RESULT_KEYS)
    except (pa.ArrowException, OSError, TypeError, KeyError, ValueError):
        return False
