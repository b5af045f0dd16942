"""A serial port of this machine, opened for us alone: pyserial, with errors that say what to do."""

import contextlib
import os
import termios

import serial

from kilotwin.errors import DeviceError
from kilotwin.table.ports.holders import reserved

_BITS_PER_BYTE = 10  # 8N1
# A device that takes nothing for so long hangs.
_WRITE_S = 2.0
# Errors of pyserial for a port that goes while it is used; its own are OSErrors.
_ERRORS = (OSError, TypeError, termios.error)
_UNPLUG = "plug the device in again, then type this again"


class SerialPort:
    """8 data bits, no parity, one stop bit. DeviceError of any method: the port is gone."""

    def __init__(self, port: str, baud: int) -> None:
        """Opens it, and discards what has come before. DeviceError has what to do, in a line."""
        # A name without a folder is a file here, which `reserved` would let through.
        port = port if "/" in port else f"./{port}"
        self.port = port
        self.byte_s = _BITS_PER_BYTE / baud
        """How long a byte takes on the line."""
        # Held for as long as the port is open: it refuses a port that another program has.
        self._reservation = contextlib.ExitStack()
        self._reservation.enter_context(reserved(port))
        try:
            self._serial = serial.Serial(port, baud, timeout=0, write_timeout=_WRITE_S)
            self._serial.reset_input_buffer()
        except (*_ERRORS, ValueError) as error:
            self._reservation.close()
            raise DeviceError(f"{port} cannot be opened: {_reason(error)}; {_UNPLUG}") from None

    def write(self, data: bytes) -> None:
        """Hands all of it to the line."""
        try:
            self._serial.write(data)
        except serial.SerialTimeoutException:
            what = f"{self.port} has taken no byte for {_WRITE_S:.0f} s"
            raise DeviceError(f"{what}: the device hangs; {_UNPLUG}") from None
        except _ERRORS as error:
            raise self._gone(error) from None

    def read(self) -> bytes:
        """Bytes that have come since the last call, maybe none."""
        try:
            data = self._serial.read(max(1, self._serial.in_waiting))
        except _ERRORS as error:
            raise self._gone(error) from None
        return bytes(data)

    def close(self) -> None:
        """Releases the port. What is still to be sent is sent first, unless the port is gone."""
        with contextlib.suppress(*_ERRORS):
            self._serial.flush()
        with contextlib.suppress(*_ERRORS):
            self._serial.close()
        self._reservation.close()

    def _gone(self, error: Exception) -> DeviceError:
        return DeviceError(f"{self.port} is gone ({_reason(error)}); {_UNPLUG}")


def _reason(error: Exception) -> str:
    number = error.args[0] if error.args else None
    if isinstance(number, int):
        return os.strerror(number).lower()
    return str(error).splitlines()[0].lower() if str(error) else type(error).__name__
