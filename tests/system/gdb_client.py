"""As much of gdb's remote protocol as a test needs to hold a robot, look at it and let it go."""

import socket
import time
from types import TracebackType

_SRAM = 0x800000  # where gdb and ELF files have the AVR's data space


class GdbClient:
    """A connection to the port that `kilotwin run --gdb` opens."""

    def __init__(self, port: int, limit_s: float = 600) -> None:
        """Waits until a server listens there."""
        end = time.monotonic() + limit_s
        while True:
            try:
                self._socket = socket.create_connection(("127.0.0.1", port), timeout=limit_s)
                return
            except ConnectionRefusedError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.02)

    def __enter__(self) -> "GdbClient":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self._socket.close()

    def ask(self, command: str) -> str:
        """Sends a packet; the answer's text."""
        checksum = sum(command.encode()) % 256
        self._socket.sendall(f"${command}#{checksum:02x}".encode())
        return self.answer()

    def answer(self) -> str:
        """The next packet that comes."""
        while self._byte() != b"$":
            pass
        text = b""
        while (byte := self._byte()) != b"#":
            text += byte
        checksum = self._byte() + self._byte()
        assert int(checksum, 16) == sum(text) % 256
        self._socket.sendall(b"+")
        return text.decode()

    def byte_at(self, address: int) -> int:
        """A variable of one byte; `address` as avr-nm prints it."""
        return int(self.ask(f"m{address | _SRAM:x},1"), 16)

    def program_counter(self) -> int:
        """In bytes."""
        return int.from_bytes(bytes.fromhex(self.ask("p22")), "little")

    def _byte(self) -> bytes:
        byte = self._socket.recv(1)
        assert byte, "the connection was closed"
        return byte
