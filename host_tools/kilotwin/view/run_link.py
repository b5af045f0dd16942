"""The viewer's end of the socket to a run that goes on (session/live_link.py)."""

import asyncio
import json
import socket
from typing import Any

from kilotwin.errors import RunError
from kilotwin.runs.packing import head_of
from kilotwin.session.live_link import LENGTH

# Robots' programs run in the process at the other end: what comes is bounded, and data.
_MOST_BYTES = 256 << 20
_PATIENCE_S = 10.0
_CLOSE_S = 2.0  # that a page's wish for close looks holds for those that others asked for
_NO_RUN = "the run is over"


class RunLink:
    """Moments of the run for pages, the same for all that ask before it comes, and their orders."""

    def __init__(self, end: socket.socket) -> None:
        """`end`: connected; open() comes next, in the event loop."""
        self._end = end
        self._opened: tuple[asyncio.StreamWriter, asyncio.Task[None]] | None = None
        self._moment: asyncio.Future[bytes] | None = None
        self._close_until = 0.0  # by the loop's clock
        self._orders = 0
        self._answers: dict[int, asyncio.Future[str]] = {}

    async def open(self) -> None:
        """Begins to listen to the run."""
        reader, writer = await asyncio.open_connection(sock=self._end)
        self._opened = writer, asyncio.create_task(self._read(reader, writer))

    async def moment(self, *, closely: bool = False) -> bytes:
        """The robots as they are when the run looks next, packed; `closely`: with motors, batteries
        and counts of messages, if not in this moment then in the next. RunError when it is over."""
        loop = asyncio.get_running_loop()
        if closely:
            self._close_until = loop.time() + _CLOSE_S
        if self._moment is None:
            close = {"closely": True} if loop.time() < self._close_until else {}
            self._send({"do": "look", **close})
            self._moment = loop.create_future()
        return await asyncio.shield(self._moment)

    async def order(self, order: dict[str, Any]) -> str:
        """Has the run carry it out; why it did not, or "". RunError when it is over."""
        self._orders += 1
        number = self._orders
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._answers[number] = answer
        try:
            self._send({**order, "id": number})
            return await asyncio.wait_for(answer, _PATIENCE_S)
        except TimeoutError:
            return "the run is in the middle of something; it will do that later"
        finally:
            self._answers.pop(number, None)

    async def close(self) -> None:
        """Leaves the run alone."""
        if self._opened is not None:
            _, reading = self._opened
            reading.cancel()
            await asyncio.wait([reading])

    def _send(self, order: dict[str, Any]) -> None:
        if self._opened is None or self._opened[1].done():
            raise RunError(_NO_RUN)
        data = json.dumps(order).encode()
        self._opened[0].write(LENGTH.pack(len(data)) + data)

    async def _read(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                (length,) = LENGTH.unpack(await reader.readexactly(LENGTH.size))
                if length > _MOST_BYTES:
                    return
                self._take(await reader.readexactly(length))
        except (OSError, EOFError, ValueError):
            return  # the run is over, or one of its programs has written here
        finally:
            writer.close()
            self._end_all()

    def _take(self, packed: bytes) -> None:
        head = head_of(packed)
        if "answer" in head:
            answer = self._answers.get(head["answer"])
            if answer is not None and not answer.done():
                answer.set_result(str(head.get("error", "")))
        elif self._moment is not None:
            self._moment.set_result(packed)
            self._moment = None

    def _end_all(self) -> None:
        for answer in self._answers.values():
            if not answer.done():
                answer.set_result(_NO_RUN)
        if self._moment is not None:
            self._moment.set_exception(RunError(_NO_RUN))
            self._moment.exception()  # no page may be waiting any more
            self._moment = None
