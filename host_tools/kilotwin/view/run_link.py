"""The viewer's end of the socket to a run that goes on (runs/live_link.py)."""

import asyncio
import json
import socket
from typing import Any

from kilotwin.errors import RunError
from kilotwin.runs.live_link import LENGTH
from kilotwin.runs.packing import head_of

# Robots' programs run in the process at the other end: what comes is bounded, and data.
_MOST_BYTES = 256 << 20
_NO_RUN = "the run is over"


class RunLink:
    """Moments of the run for pages. All that ask before one comes get the same."""

    def __init__(self, end: socket.socket) -> None:
        """`end`: connected; open() comes next, in the event loop."""
        self._end = end
        self._writer: asyncio.StreamWriter | None = None
        self._reading: asyncio.Task[None] | None = None
        self._moment: asyncio.Future[bytes] | None = None

    async def open(self) -> None:
        """Begins to listen to the run."""
        reader, self._writer = await asyncio.open_connection(sock=self._end)
        self._reading = asyncio.create_task(self._read(reader))

    async def moment(self) -> bytes:
        """The robots as they are when the run looks next, packed. RunError when it is over."""
        if self._moment is None:
            self._send({"do": "look"})
            self._moment = asyncio.get_running_loop().create_future()
        return await asyncio.shield(self._moment)

    async def close(self) -> None:
        """Leaves the run alone."""
        if self._reading is not None:
            self._reading.cancel()
            await asyncio.wait([self._reading])

    def _send(self, order: dict[str, Any]) -> None:
        if self._reading is None or self._reading.done() or self._writer is None:
            raise RunError(_NO_RUN)
        data = json.dumps(order).encode()
        self._writer.write(LENGTH.pack(len(data)) + data)

    async def _read(self, reader: asyncio.StreamReader) -> None:
        try:
            while True:
                (length,) = LENGTH.unpack(await reader.readexactly(LENGTH.size))
                if length > _MOST_BYTES:
                    return
                self._take(await reader.readexactly(length))
        except (OSError, EOFError, ValueError):
            return  # the run is over, or one of its programs has written here
        finally:
            self._end_all()

    def _take(self, packed: bytes) -> None:
        head_of(packed)
        if self._moment is not None:
            self._moment.set_result(packed)
            self._moment = None

    def _end_all(self) -> None:
        if self._writer is not None:
            self._writer.close()
        if self._moment is not None:
            self._moment.set_exception(RunError(_NO_RUN))
            self._moment.exception()  # no page may be waiting any more
            self._moment = None
