"""Words that an environment tells robots: sent.arrows in a run folder, or in memory for `World`.

A row per word or message for all; what the program notes goes to events.jsonl.
"""

from collections.abc import Iterator
from typing import Any

import pyarrow as pa

from kilotwin.experiment.spec.overhead import ALL_ROBOTS, DATA_BYTES
from kilotwin.runs.columns import SENT_SCHEMA
from kilotwin.runs.folder import SENT
from kilotwin.runs.writer import RunWriter, Stream
from kilotwin.table.environment.outbox import Sending
from kilotwin.units import ticks

# Rows by the hundred cost less; a kill costs no more than these.
_BATCH = 200


class EnvironmentEvents:
    """Keeps nothing: for sweeps."""

    def sent(self, sending: Sending) -> None:
        """A packet has gone out."""

    def note(self, time_s: float, text: str) -> None:
        """The program has something to say."""

    def close(self) -> None:
        """Ends the files."""


class EnvironmentMemory(EnvironmentEvents):
    """Keeps all of it, for `World`."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.notes: list[tuple[float, str]] = []

    def sent(self, sending: Sending) -> None:
        """Keeps its rows."""
        self.rows += _rows(sending)

    def note(self, time_s: float, text: str) -> None:
        """Keeps it."""
        self.notes.append((time_s, text))


class EnvironmentRecord(EnvironmentEvents):
    """Writes it into the run folder of `writer`, which is closed by its owner."""

    def __init__(self, writer: RunWriter) -> None:
        self._writer = writer
        self._stream = Stream(writer.folder / f"{SENT}.arrows", SENT_SCHEMA)
        self._waiting: list[dict[str, Any]] = []

    def sent(self, sending: Sending) -> None:
        """Keeps its rows until there is a batch of them."""
        self._waiting += _rows(sending)
        if len(self._waiting) >= _BATCH:
            self._flush()

    def note(self, time_s: float, text: str) -> None:
        """Writes it to the events, at once."""
        self.event(time_s, "environment", text)

    def event(self, time_s: float, kind: str, text: str) -> None:
        """Writes any other event."""
        event = {"time_s": round(time_s, 3), "tick": ticks(time_s), "kind": kind, "text": text}
        self._writer.add_event(event)

    def close(self) -> None:
        """Ends the stream."""
        self._flush()
        self._stream.close()

    def _flush(self) -> None:
        if self._waiting:
            self._stream.write(pa.RecordBatch.from_pylist(self._waiting, schema=SENT_SCHEMA))
            self._waiting = []


def _rows(sending: Sending) -> Iterator[dict[str, Any]]:
    for wanted in sending.told:
        word = wanted.word
        yield {
            "time_s": sending.there_s,
            "asked_s": wanted.asked_s,
            "uid": ALL_ROBOTS[1] if word is None else word.uid,
            "type": wanted.message[DATA_BYTES] if word is None else word.type,
            "value": None if word is None else word.value,
            "data": wanted.message[:DATA_BYTES] if word is None else None,
        }
