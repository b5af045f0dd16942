"""Packets of gdb's remote serial protocol, from and to bytes; the ones that we need, no more."""

from dataclasses import dataclass, field

INTERRUPT = "interrupt"
"""Ctrl-C in gdb, which comes between packets, as a text that no packet has."""

_ESCAPE, _ESCAPED = 0x7D, 0x20
_MUST_ESCAPE = frozenset(b"}$#*")
_MOST_BYTES = 1 << 16


def framed(text: str) -> bytes:
    """A packet with its checksum. The text is ASCII, as all that we send is."""
    escaped = bytearray()
    for byte in text.encode("ascii", "replace"):
        escaped += bytes([_ESCAPE, byte ^ _ESCAPED]) if byte in _MUST_ESCAPE else bytes([byte])
    return b"$%b#%02x" % (bytes(escaped), sum(escaped) % 256)


@dataclass
class Reader:
    """Takes bytes as they come, and gives packets.

    `acknowledges`: each is answered by + or -, until gdb says that it need not be.
    """

    acknowledges: bool = True
    _bytes: bytearray = field(default_factory=bytearray)

    def feed(self, data: bytes) -> tuple[list[str], bytes]:
        """The packets that are whole now, and what is to be answered at once."""
        self._bytes += data
        packets: list[str] = []
        answers = b""
        while self._bytes:
            first = self._bytes[0]
            if first == 0x03:
                del self._bytes[0]
                packets.append(INTERRUPT)
            elif first != ord("$"):
                del self._bytes[0]
            else:
                end = self._bytes.find(b"#")
                if end < 0 or len(self._bytes) < end + 3:
                    if len(self._bytes) > _MOST_BYTES:
                        self._bytes.clear()
                    break
                body, checksum = bytes(self._bytes[1:end]), bytes(self._bytes[end + 1 : end + 3])
                del self._bytes[: end + 3]
                right = checksum.lower() == b"%02x" % (sum(body) % 256)
                if right:
                    packets.append(_unescaped(body))
                if self.acknowledges:
                    answers += b"+" if right else b"-"
        return packets, answers


def _unescaped(body: bytes) -> str:
    out = bytearray()
    bytes_left = iter(body)
    for byte in bytes_left:
        out.append(next(bytes_left, _ESCAPED) ^ _ESCAPED if byte == _ESCAPE else byte)
    return out.decode("latin-1")


def numbers(text: str, count: int) -> list[int]:
    """`count` hexadecimal numbers with commas between them; ValueError if it is something else."""
    parts = text.split(",")
    if len(parts) != count:
        raise ValueError(f"'{text}': must be {count} numbers")
    return [int(part, 16) for part in parts]
