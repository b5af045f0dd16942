"""Other hosts on a grid's buses: every frame is seen, so their orders are too.

Two hosts on one table take each other's reports, and one's orders end the other's run. Between
orders a host of ours says that it is there (HOST_PRESENT, docs/wire.md).
"""

import math
import secrets
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from kilotwin.errors import DeviceError
from kilotwin.table.can.address import HOST_ID
from kilotwin.table.can.protocol import FRAME_BYTES, host_present, types_to_module
from kilotwin.table.grid.links import Frames, Links

# Frames that modules' programs may send to one another.
_OF_PROGRAMS = ("MODULE_USER", "KILOBOT_DATA")
_PRESENT_S = 0.2
_PRESENT = "HOST_PRESENT"
# A host says more often than this that it is there.
LISTEN_S = 0.6
_STEP_S = 0.01


class WatchedLinks:
    """Buses as another user of theirs has them, which need not know of it.

    Counts orders that this host did not send, and other hosts that say that they are there.
    `announces`: says so of this host, on all buses, as often as `receive` is called and it is due.
    """

    def __init__(self, links: Links, *, announces: bool = False) -> None:
        self._links = links
        self._announcement = host_present(secrets.token_bytes(FRAME_BYTES - 1))
        self._next_s = -math.inf if announces else math.inf
        self._sent: Counter[tuple[int, int, bytes]] = Counter()
        types = types_to_module()
        self._orders = [number for name, number in types.items() if name not in _OF_PROGRAMS]
        self._names = {number: name for name, number in types.items()}
        self.foreign: Counter[tuple[int, str]] = Counter()
        """How often, by bus and by name of the order's type, or HOST_PRESENT."""

    def __len__(self) -> int:
        return len(self._links)

    def send(self, bus: int, identifier: int, data: bytes, now_s: float) -> bool:
        """As Links has it."""
        sent = self._links.send(bus, identifier, data, now_s)
        if sent:
            self._sent[bus, identifier, bytes(data)] += 1
        return sent

    def send_all(self, bus: int, identifiers: Sequence[int], data: bytes, now_s: float) -> int:
        """As Links has it."""
        count = self._links.send_all(bus, identifiers, data, now_s)
        self._sent.update((bus, identifier, bytes(data)) for identifier in identifiers[:count])
        return count

    def trouble(self, bus: int) -> str | None:
        """As Links has it."""
        return self._links.trouble(bus)

    def receive(self, now_s: float) -> Frames:
        """As Links has it."""
        if now_s >= self._next_s:
            self._announce(now_s)
        frames = self._links.receive(now_s)
        if not len(frames):
            return frames
        self._look(frames)
        present = frames["data"][:, 0] == self._announcement[0]
        hosts = (frames["id"] == HOST_ID) & present
        for frame in frames[hosts]:
            if frame["data"].tobytes() != self._announcement:
                self.foreign[int(frame["bus"]), _PRESENT] += 1
        others: Frames = frames[~hosts]
        return others

    def close(self) -> None:
        """As Links has it."""
        self._links.close()

    def _announce(self, now_s: float) -> None:
        self._next_s = now_s + _PRESENT_S
        for bus in range(len(self._links)):
            if self._links.trouble(bus) is None:
                self._links.send(bus, HOST_ID, self._announcement, now_s)

    def _look(self, frames: Frames) -> None:
        orders = (frames["id"] & 1 == 0) & np.isin(frames["data"][:, 0], self._orders)
        for frame in frames[orders]:
            data = frame["data"][: frame["dlc"]].tobytes()
            key = (int(frame["bus"]), int(frame["id"]), data)
            if frame["from_host"] and self._sent[key] > 0:
                self._sent[key] -= 1
                if not self._sent[key]:
                    del self._sent[key]
            else:
                self.foreign[int(frame["bus"]), self._names[data[0]]] += 1


def refuse_another_host(links: Links, names: Sequence[str]) -> None:
    """Listens for LISTEN_S, and sends nothing; DeviceError if another host gives orders."""
    watched = WatchedLinks(links)
    end_s = time.monotonic() + LISTEN_S
    while (now_s := time.monotonic()) < end_s:
        watched.receive(now_s)
        if watched.foreign:
            raise foreign_order(watched, names, "end that program, or add --takeover")
        time.sleep(_STEP_S)


def foreign_order(links: WatchedLinks, names: Sequence[str], remedy: str) -> DeviceError:
    """The error of a command that has seen one."""
    bus, kind = next(iter(links.foreign))
    return DeviceError(f"--can {names[bus]}: {what_it_does(kind)} ({kind}); {remedy}")


def what_it_does(kind: str) -> str:
    """Deeds of another host, for people."""
    return "another host is there" if kind == _PRESENT else "another host gives orders there"
