"""Polls modules for robots' reports, many at a time, and finds those that do not answer.

Every `poll_s` a sweep polls each module once. A bus owes at most `poll_window` answers at a time.
An answer is START with a number, then that many reports. A module that owes an answer for longer
than `poll_timeout_s` is passed over; after three times it counts as silent and is polled in one
sweep of ten only, until it answers.

An original module answers in any state, so that the answer does not show a reset. But for 1.2 s
after power-up it answers nothing. If `poll_s` and `poll_timeout_s` are not more than 1.2 s
together, some poll falls into that time and is answered late or not at all: a module that answers
after that may have been reset.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.files.headers import CELLS_PER_MODULE
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.cover import Group
from kilotwin.table.grid.links import Frames, Links

SILENT_AFTER = 3
"""Answers missed in a row."""
_SILENT_SWEEPS = 10  # a silent module is polled in one sweep of so many

_REST, _POLLED, _ANSWERING = 0, 1, 2


@dataclass(frozen=True)
class Answer:
    """An answer of a module that had missed some, or that is watched."""

    module: Module
    missed: int
    """How many answers in a row it had missed."""
    late_s: float
    """Since it was polled last."""
    silent_s: float
    """Since its answer before."""
    records: int
    """How many reports it has."""
    at_s: float = 0.0
    """When it came."""


@dataclass(frozen=True)
class Reports:
    """Reports of robots: when each came to the host, through which module and cell, its bytes."""

    at_s: NDArray[np.float64]  # [k], as all of them
    x: NDArray[np.uint8]
    y: NDArray[np.uint8]
    cell: NDArray[np.uint8]
    data: NDArray[np.uint8]  # [k, 7]

    def __len__(self) -> int:
        return len(self.at_s)

    @staticmethod
    def joined(parts: Sequence["Reports"]) -> "Reports":
        """All of them, one after the other."""
        return Reports(
            *(
                np.concatenate([getattr(part, column.name) for part in parts])
                for column in fields(Reports)
            )
        )


@dataclass
class Counts:
    """Since the begin: polls and their answers, reports; `cut` were announced and did not come."""

    asked: int = 0
    answered: int = 0
    missed: int = 0
    reports: int = 0
    cut: int = 0
    bad_frames: int = 0


class Poller:
    """The polling of all modules on all buses."""

    def __init__(
        self, layout: Layout, links: Links, *, every_s: float, window: int, timeout_s: float
    ) -> None:
        self._links = links
        self._every_s = every_s
        self._window = window
        self._timeout_s = timeout_s
        self.modules: list[Module] = list(layout.modules())
        self.index = {module: number for number, module in enumerate(self.modules)}
        count = len(self.modules)
        self._buses = range(layout.buses)
        # Modules are in order of their rows, so that those of a bus are neighbours.
        ends = np.cumsum([len(layout.modules_of(bus)) for bus in self._buses]).tolist()
        self._of_bus = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        self._ids = [wire.id_of_group(Group(*module)) for module in self.modules]
        self._of_id = np.full(wire.IDS, -1, dtype=np.intp)
        self._of_id[[wire.id_from_module(module) for module in self.modules]] = np.arange(count)
        self._xy = np.array(self.modules, dtype=np.uint8)
        self._state = np.zeros(count, dtype=np.uint8)
        self._since = np.zeros(count)
        self._left = np.zeros(count, dtype=np.int64)
        self._missed = np.zeros(count, dtype=np.int64)
        self._answered_s = np.full(count, -np.inf)
        self._excused_until = np.full(count, -np.inf)
        self._watched = np.zeros(count, dtype=bool)
        self._due: list[list[int]] = [[] for _ in self._buses]  # per bus, the next one last
        self._sweep = 0
        self._next_sweep_s = -np.inf
        self._began_s = -np.inf
        self.on = False
        self.counts = Counts()

    def number_of(self, identifier: int) -> int | None:
        """Which of `modules` sends with a CAN identifier; None if none does."""
        number = int(self._of_id[identifier]) if 0 <= identifier < len(self._of_id) else -1
        return None if number < 0 else number

    @property
    def owing(self) -> bool:
        """Whether a module is polled and has not answered in full, or is still to be polled."""
        return bool(self._state.any()) or any(self._due)

    @property
    def silent(self) -> list[Module]:
        """Modules that have not answered for some time."""
        return [self.modules[number] for number in np.flatnonzero(self._missed >= SILENT_AFTER)]

    @property
    def heard(self) -> list[Module]:
        """Modules that have answered a poll since this one was made."""
        return [self.modules[number] for number in np.flatnonzero(np.isfinite(self._answered_s))]

    @property
    def missing(self) -> bool:
        """Whether a module did not answer its last poll."""
        return bool(self._missed.any())

    def next_sweep_s(self) -> float:
        """When the next sweep is due."""
        return self._next_sweep_s

    def begin(self, now_s: float) -> None:
        """Polls from now on."""
        self.on = True
        self._began_s = self._next_sweep_s = now_s

    def end(self) -> None:
        """Stops polling; answers under way are not waited for."""
        self.on = False
        self.forget()

    def forget(self) -> None:
        """Expects no answers: the host was away, or its polls may be lost."""
        self._state[:] = _REST
        self._watched[:] = False
        self._due = [[] for _ in self._buses]

    def excuse(self, modules: Sequence[Module], until_s: float) -> None:
        """Does not poll these before `until_s`: an order that they carry out takes that long."""
        for module in modules:
            number = self.index[module]
            self._excused_until[number] = until_s
            self._state[number] = _REST

    def watch(self, module: Module, *, on: bool) -> None:
        """Whether each answer of a module is handed on, not only those after missed ones."""
        self._watched[self.index[module]] = on

    def sweep(self, now_s: float, *, all_modules: bool = False) -> None:
        """Begins a sweep now; with silent modules if it is their turn, or with `all_modules`."""
        all_modules = all_modules or self._sweep % _SILENT_SWEEPS == 0
        due = all_modules | (self._missed < SILENT_AFTER)
        due &= (self._state == _REST) & (self._excused_until <= now_s)
        for bus in self._buses:
            here = self._of_bus[bus]
            self._due[bus] = (here.start + np.flatnonzero(due[here])[::-1]).tolist()
        self._sweep += 1
        self._next_sweep_s = max(self._next_sweep_s + self._every_s, now_s)

    def take(self, frames: Frames, now_s: float) -> tuple[Reports | None, list[Answer]]:
        """The reports in frames from modules, and the answers that the controller is to know."""
        incoming = frames[(frames["id"] & 1 == 1) & ~frames["from_host"]]
        if not len(incoming):
            return None, []
        fixed = wire.fixed()
        number = self._of_id[incoming["id"]]
        kind = incoming["data"][:, 0] & fixed.TYPE_MASK
        known = number >= 0
        starts = known & (kind == fixed.START) & (incoming["dlc"] >= fixed.START_BYTES)
        starts &= incoming["data"][:, 1] <= fixed.MOST_RECORDS
        reports = known & (kind == fixed.TRACKING) & (incoming["dlc"] == fixed.TRACKING_BYTES)
        others = known & (kind != fixed.START) & (kind != fixed.TRACKING)
        self.counts.bad_frames += int(len(incoming) - np.count_nonzero(starts | reports | others))
        answers = self._take_starts(number[starts], incoming[starts], now_s)
        if not reports.any():
            return None, answers
        return self._take_reports(number[reports], incoming[reports], now_s), answers

    def _take_starts(
        self, number: NDArray[np.intp], incoming: Frames, now_s: float
    ) -> list[Answer]:
        if not len(number):
            return []
        announced = incoming["data"][:, 1]
        # With long steps late answers come together with those in time.
        polled = self._state[number] == _POLLED
        late_s = incoming["at_s"] - self._since[number]
        self._missed[number[polled & (late_s > self._timeout_s)]] += 1
        # Only the first of several answers in one step is one to the last poll.
        one, first = np.unique(number, return_index=True)
        told = (self._missed[one] > 0) | (self._watched[one] & polled[first])
        answers = [
            Answer(
                self.modules[module],
                int(self._missed[module]),
                float(late_s[index]),
                float(incoming["at_s"][index] - self._answered_s[module]),
                int(announced[index]),
                float(incoming["at_s"][index]),
            )
            for module, index in zip(one[told], first[told], strict=True)
        ]
        self._answered_s[number] = incoming["at_s"]
        self.counts.answered += len(number)
        self._left[number] = announced
        self._state[number] = np.where(announced > 0, _ANSWERING, _REST)
        self._since[number] = now_s
        self._missed[number] = 0
        return answers

    def _take_reports(self, number: NDArray[np.intp], incoming: Frames, now_s: float) -> Reports:
        self.counts.reports += len(number)
        np.subtract.at(self._left, number, 1)
        self._since[number] = now_s
        self._state[number[self._left[number] <= 0]] = _REST
        data = incoming["data"]
        return Reports(
            incoming["at_s"].copy(),
            self._xy[number, 0],
            self._xy[number, 1],
            (data[:, 0] >> wire.fixed().CELL_SHIFT & (CELLS_PER_MODULE - 1)).astype(np.uint8),
            data[:, 1:].copy(),
        )

    def unanswered_s(self, now_s: float) -> dict[Module, float]:
        """Modules that count as silent: time since the last answer, or since polling began."""
        return {
            self.modules[number]: float(now_s - max(self._answered_s[number], self._began_s))
            for number in np.flatnonzero(self._missed >= SILENT_AFTER)
        }

    def step(self, now_s: float) -> None:
        """Polls modules that are due."""
        if self._state.any():
            self._give_up(now_s)
        if self.on and now_s >= self._next_sweep_s and not any(self._due):
            self.sweep(now_s)
        for bus, due in enumerate(self._due):
            if due:
                self._poll(bus, due, now_s)
            if self._links.trouble(bus):
                due.clear()  # or the other buses would wait; the next sweep tries it again

    def _give_up(self, now_s: float) -> None:
        late = (self._state != _REST) & (now_s - self._since > self._timeout_s)
        if not late.any():
            return
        unanswered = late & (self._state == _POLLED)
        self.counts.missed += int(np.count_nonzero(unanswered))
        self.counts.cut += int(self._left[late & (self._state == _ANSWERING)].sum())
        self._missed[unanswered] += 1
        self._state[late] = _REST

    def _poll(self, bus: int, due: list[int], now_s: float) -> None:
        room = self._window - int(np.count_nonzero(self._state[self._of_bus[bus]]))
        wanted = due[: -room - 1 : -1]
        ids = [self._ids[number] for number in wanted]
        asked = wanted[: self._links.send_all(bus, ids, wire.fixed().TRACKING_REQUEST, now_s)]
        if asked:
            del due[-len(asked) :]
            self._state[asked] = _POLLED
            self._since[asked] = now_s
            self.counts.asked += len(asked)
