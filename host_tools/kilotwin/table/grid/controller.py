"""Drives a grid's modules, and the robots through them: set-up, run, poll, pause, change, idle.

No I/O of its own and no waiting: the caller has the clock and calls `step(now_s)` often, at the
latest at `next_step_s`. An order that takes time is a script, a generator that yields what it waits
for: a moment, all queued frames sent (`_sent`), or a condition. A new order replaces the one under
way. Polling goes on beside it.

Modules read frames one at a time, from two buffers, and do not receive while they send by infrared.
So frames that may be for the same module leave at a pace, and slower where modules are running.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from typing import Any, Protocol

from kilotwin.errors import InputError
from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.experiment.spec.grid_plan import Settings
from kilotwin.experiment.spec.kconf import MOST_BYTES, Content
from kilotwin.experiment.spec.overhead import RESET, RUN, WAKEUP
from kilotwin.table.can.protocol import BusHealth, Health, ModuleState
from kilotwin.table.grid import frames as wire
from kilotwin.table.grid.cover import ALL_MODULES, Group
from kilotwin.table.grid.in_turn import behind, in_turn, is_held, rounds, rounds_of
from kilotwin.table.grid.links import Frames, Links
from kilotwin.table.grid.poller import SILENT_AFTER, Answer, Poller, Reports
from kilotwin.table.grid.resets import ResetVerdict, ResetWatch
from kilotwin.table.grid.silence import SilenceWatch

Wait = float | Callable[[], bool]
Script = Generator[Wait, None, None]
Sending = tuple[Group, wire.Paced]
"""A frame, and the modules that it is for."""
Transfer = tuple[int, Group, list[wire.Paced]]
"""The frames of a configuration, the bus, and the modules that they are for."""

# Besides setup() the end of an infrared frame on each cell, the 70 ms of a step of an idle module.
SETTLE_S = 0.3
"""How long modules need to carry a frame out, setup() of a program with it."""
# A module that begins to run first sends 40 frames by infrared, and answers nothing meanwhile.
_START_S = 0.6
# Between frames to modules that send by infrared: longer than a frame of theirs.
_BUSY_PACE_S = 0.006
# How long an order to pause, or to go on, is repeated on all cells without a break.
_REPEAT_S = 2.0
# Modules that have just been switched on do not receive for so long.
_BOOT_S = 1.3
_ATTEMPTS = 3


class Listener(Protocol):
    """Receives what the grid reports."""

    def reports(self, reports: Reports) -> None:
        """Takes reports of robots, in order of time."""

    def event(self, now_s: float, kind: str, text: str, **more: Any) -> None:
        """Takes an event at `now_s`, of that kind and with a line of text."""


class NoListener:
    """A listener for whom what modules report is of no interest."""

    def reports(self, reports: Reports) -> None:
        """Not kept."""

    def event(self, now_s: float, kind: str, text: str, **more: Any) -> None:
        """Not shown."""


class Controller:
    """The host of one grid."""

    def __init__(
        self, layout: Layout, settings: Settings, links: Links, listener: Listener
    ) -> None:
        self.layout = layout
        self.settings = settings
        self._links = links
        self._listener = listener
        self.poller = Poller(
            layout,
            links,
            every_s=settings.poll_s,
            window=settings.poll_window,
            timeout_s=settings.poll_timeout_s,
        )
        self._queues: list[deque[tuple[int, bytes, float]]] = [deque() for _ in range(layout.buses)]
        self._ready_s = [float("-inf")] * layout.buses
        self._later: list[tuple[float, Callable[[], None]]] = []
        self._script: Script | None = None
        self._wait: Wait = 0.0
        self._now_s = float("-inf")
        self._health: dict[Module, Health] = {}
        self._bus_health: dict[Module, BusHealth] = {}
        self._down: dict[int, str] = {}
        self._left_out: set[int] = set()
        self._resets = ResetWatch()
        self._silence = SilenceWatch()
        self._told_of_pauses = False
        self.configuration: dict[Module, Content] = {}
        self.running = False

    # Orders. Each replaces what is under way. InputError: modules or bytes that cannot be.

    def set_up(self, configuration: Mapping[Module, Content], messages: Sequence[bytes]) -> None:
        """Resets robots and sends them the messages; configures modules."""
        self._begin(self._setting_up(self._checked(configuration), list(messages)))

    def configure(self, configuration: Mapping[Module, Content]) -> None:
        """Configures modules, which then are ready to run; robots are left alone."""
        self._begin(self._configuring(self._checked(configuration)))

    def run(self) -> None:
        """Modules run and send RUN to robots; polling begins."""
        self._begin(self._starting())

    def pause(self) -> None:
        """Robots stop where they are; modules are idle."""
        self._begin(self._pausing())

    def resume(self) -> None:
        """Robots go on where they stopped."""
        self._begin(self._resuming())

    def change(self, configuration: Mapping[Module, Content]) -> None:
        """Configures these modules anew while the others run on."""
        self._begin(self._changing(self._checked(configuration)), at_once=False)

    def send_to_robots(self, message: bytes, hold_s: float) -> None:
        """Modules repeat one message for robots, then are idle."""
        self._begin(self._repeating(message, hold_s))

    def set_idle(self) -> None:
        """Robots and modules stop, whatever they do; the last reports are fetched first."""
        self._begin(self._ending())

    def look(self) -> None:
        """Polls each module once, to see which answer."""
        self._begin(self._looking())

    def request_health(self, modules: Iterable[Module]) -> None:
        """Requests the health of these modules; see `health`."""
        self._begin(self._requesting_health(list(modules)))

    def transmit(self, frames: Mapping[int, Sequence[Sending]], settle_s: float) -> None:
        """Sends frames as they are, by bus, each at its own pace; then waits."""
        self._begin(self._transmitting(frames, settle_s))

    def watch(self) -> None:
        """Polls a grid that runs already."""
        self.running = True
        self.poller.begin(self._now_s)

    def _checked(self, configuration: Mapping[Module, Content]) -> dict[Module, Content]:
        if not isinstance(configuration, Mapping):
            raise InputError(f"{configuration!r} is no configuration; write {{(x, y): bytes, ...}}")
        for module, content in configuration.items():
            if module not in self.poller.index:
                columns, rows = self.layout.columns, self.layout.rows
                what = f"there is no module {module} on a grid of {columns} x {rows}"
                raise InputError(f"{what}; write (x, y), counted from 0")
            several = in_turn(content) if isinstance(content, bytes | tuple) else ()
            if not several or not all(
                isinstance(one, bytes) and 1 <= len(one) <= MOST_BYTES for one in several
            ):
                what = f"module {module} is to be {content!r}"
                raise InputError(f"{what}; a configuration is bytes, 1 to {MOST_BYTES} of them")
        return dict(configuration)

    @property
    def busy(self) -> bool:
        """Whether an order is being carried out."""
        return self._script is not None or self._queued or bool(self._later)

    @property
    def down(self) -> Mapping[int, str]:
        """The buses that do not work, and why."""
        return self._down

    @property
    def queued(self) -> int:
        """Frames that wait to be sent."""
        return sum(map(len, self._queues))

    @property
    def unsent(self) -> list[int]:
        """The buses that have not had all frames of the order."""
        return [bus for bus, queue in enumerate(self._queues) if queue or bus in self._left_out]

    @property
    def silent(self) -> list[Module]:
        """Modules that do not answer, for longer than a program may pause."""
        return self._silence.silent

    @property
    def health(self) -> Mapping[Module, Health]:
        """The last answer of each module to a request for its health."""
        return self._health

    @property
    def bus_health(self) -> Mapping[Module, BusHealth]:
        """The same of their CAN controllers."""
        return self._bus_health

    # Time.

    def step(self, now_s: float) -> None:
        """Receives frames, then sends what is due. `now_s` never goes back."""
        self._notice_absence(now_s)
        self._now_s = now_s
        self._take(self._links.receive(now_s))
        self.poller.step(now_s)
        for module in self._silence.newly_silent(self.poller.unanswered_s(now_s)):
            self._event("module_silent", f"module {module[0]}-{module[1]} does not answer", module)
        self._do_later()
        self._go_on()
        self._send()
        self._look_at_links()

    def next_step_s(self) -> float:
        """When `step` is due at the latest, by the caller's clock; sooner does no harm."""
        if self._queued or self.poller.owing:
            return self._now_s
        times = [at_s for at_s, _ in self._later]
        if self._script is not None:
            times.append(self._now_s if callable(self._wait) else self._wait)
        if self.poller.on:
            times.append(self.poller.next_sweep_s())
        return min(times, default=float("inf"))

    def _notice_absence(self, now_s: float) -> None:
        """Drops polls under way after a gap in stepping: their answers are too late to count."""
        if self.poller.owing and now_s - self._now_s > self.settings.poll_timeout_s:
            self.poller.forget()

    def _do_later(self) -> None:
        due = [what for at_s, what in self._later if at_s <= self._now_s]
        self._later = [entry for entry in self._later if entry[0] > self._now_s]
        for what in due:
            what()

    def _go_on(self) -> None:
        while self._script is not None:
            wait = self._wait
            if not (wait() if callable(wait) else wait <= self._now_s):
                return
            try:
                self._wait = next(self._script)
            except StopIteration:
                self._script = None

    def _begin(self, script: Script, *, at_once: bool = True) -> None:
        """`at_once`: drops frames that are still queued."""
        if at_once:
            self._later.clear()
            self._left_out.clear()
            self._resets.forget()
            for queue in self._queues:
                queue.clear()
        self._script = script
        self._wait = self._now_s

    # Sending.

    @property
    def _queued(self) -> bool:
        return any(self._queues)

    def _sent(self) -> bool:
        """The condition that all queued frames are sent, for scripts."""
        return not self._queued

    def _send(self) -> None:
        for bus, queue in enumerate(self._queues):
            while queue and self._ready_s[bus] <= self._now_s:
                identifier, data, gap_s = queue[0]
                if not self._links.send(bus, identifier, data, self._now_s):
                    self._leave_out(bus)
                    break
                queue.popleft()
                self._ready_s[bus] = self._now_s + gap_s

    def _leave_out(self, bus: int) -> None:
        """Drops the frames of a bus that is down, unless all are: then the order waits."""
        troubles = [self._links.trouble(any_) for any_ in range(self.layout.buses)]
        if troubles[bus] and not all(troubles):
            self._queues[bus].clear()
            self._left_out.add(bus)

    def _queue(self, bus: int, group: Group, frames: Iterable[bytes | wire.Paced]) -> None:
        """Queues frames; a frame of a transfer brings its own pace, and the longest gap counts."""
        identifier = wire.id_of_group(group)
        least_s = max(self.settings.pace_s, _BUSY_PACE_S if self.running else 0.0)
        for frame in frames:
            data, gap_s = (frame, least_s) if isinstance(frame, bytes) else frame
            self._queues[bus].append((identifier, data, max(gap_s, least_s)))

    def _broadcast(self, *frames: bytes | wire.Paced) -> None:
        for bus in range(self.layout.buses):
            self._queue(bus, ALL_MODULES, frames)

    def _to(self, module: Module, *frames: bytes | wire.Paced) -> None:
        self._queue(self.layout.bus_of(module), Group(*module), frames)

    def _transfers(self, wanted: Mapping[Module, Content]) -> list[list[Transfer]]:
        """The frames of each round that leaves these modules with their configurations, by bus."""
        of_bus = []
        for bus in range(self.layout.buses):
            modules = self.layout.modules_of(bus)
            here = {module: wanted[module] for module in modules if module in wanted}
            of_bus.append(rounds(here, modules))
        return [
            [
                (bus, message.group, wire.configuration(message.content))
                for bus, messages in enumerate(of_bus)
                for message in (messages[number] if number < len(messages) else ())
            ]
            for number in range(rounds_of(wanted.values()))
        ]

    def _configure(self, transfers: list[list[Transfer]]) -> Script:
        """Sends them; after each round modules have the time to run setup()."""
        for round_ in transfers:
            for bus, group, frames in round_:
                self._queue(bus, group, frames)
            yield self._sent
            yield self._after(SETTLE_S)

    def _send_again(self, module: Module) -> float:
        """Queues all configurations of one module; returns how long setup() needs in all."""
        contents = in_turn(self.configuration[module])
        for content in contents:
            *frames, final = wire.configuration(content)
            self._to(module, *frames, final._replace(pause_s=SETTLE_S))
        return len(contents) * SETTLE_S

    # Receiving.

    def _take(self, frames: Frames) -> None:
        if not len(frames):
            return
        reports, answers = self.poller.take(frames, self._now_s)
        if reports is not None:
            self._listener.reports(reports)
        for answer in answers:
            module = answer.module
            if self._silence.is_back(module):
                self._event("module_back", f"module {module[0]}-{module[1]} answers again", module)
            if self.running:
                self._judge(answer)
                if answer.missed >= SILENT_AFTER and self._silence.take_late(answer):
                    self._tell_of_pause(answer)
        self._take_health(frames)

    def _take_health(self, frames: Frames) -> None:
        ours = (frames["id"] & 1 == 1) & (frames["data"][:, 0] == wire.fixed().MODULE_DATA)
        for frame in frames[ours & ~frames["from_host"]]:
            sound = wire.read_answer(frame)
            if sound is None:
                self.poller.counts.bad_frames += 1
                continue
            module, answer = sound
            if module in self.poller.index and isinstance(answer, Health):
                self._health[module] = answer
            elif module in self.poller.index and isinstance(answer, BusHealth):
                self._bus_health[module] = answer

    def _judge(self, answer: Answer) -> None:
        """Configures a module again that was reset, as far as its answers show it.

        Modules with our firmware are asked too, since they know (`grid.health`).
        """
        module = answer.module
        if answer.missed and self.settings.health:
            self._health.pop(module, None)
            self._to(module, *wire.fixed().HEALTH_REQUESTS)
            self._at(SETTLE_S, lambda: self._configure_unless_running(module))
        pausing = self._resets.pausing
        verdict = self._resets.take(answer)
        self.poller.watch(module, on=verdict is ResetVerdict.WATCH)
        if verdict is ResetVerdict.RESET:
            self._configure_again(module)
        if self._resets.pausing > pausing == 0:
            self._tell_of_pause(answer)

    def _tell_of_pause(self, answer: Answer) -> None:
        """Reports the first module whose program pauses: others have the same program."""
        module = answer.module
        what = (
            f"module {module[0]}-{module[1]} was not reset and answers {answer.silent_s:.1f} s "
            "after its last answer: its program pauses in loop(). Meanwhile robots' reports wait, "
            "and a module that is reset is configured again some seconds later"
        )
        if not self._told_of_pauses:
            self._event("module_pauses", what, module)
        self._told_of_pauses = True

    def _configure_unless_running(self, module: Module) -> None:
        """A module that has not answered yet is judged by its answers to polls."""
        answer = self._health.get(module)
        if answer is None:
            return
        if answer.state != ModuleState.RUNNING or not self._is_right(module, answer):
            self._configure_again(module)
        else:
            self._leave_alone(module)

    def _leave_alone(self, module: Module) -> None:
        self._resets.forget(module)
        self.poller.watch(module, on=False)

    def _configure_again(self, module: Module) -> None:
        self._leave_alone(module)
        settle_s = SETTLE_S
        if module in self.configuration:
            settle_s = self._send_again(module)
        else:
            self._to(module, wire.fixed().SETUP)
        self.poller.excuse([module], self._now_s + settle_s + _START_S)
        self._at(settle_s, lambda: self._to(module, wire.fixed().RUN))
        self._event(
            "module_configured_again", f"module {module[0]}-{module[1]} is set up again", module
        )

    def _at(self, after_s: float, what: Callable[[], None]) -> None:
        self._later.append((self._now_s + after_s, what))

    def _is_right(self, module: Module, answer: Health) -> bool:
        wanted = self.configuration.get(module)
        return wanted is None or is_held(wanted, answer.config_size, answer.config_crc)

    # Scripts.

    def _after(self, seconds: float) -> float:
        return self._now_s + seconds

    def _repeating(self, message: bytes, hold_s: float) -> Script:
        """Has modules repeat a message. STOP first: halves of two messages would make a third."""
        self.running = False
        self.poller.end()
        self._broadcast(wire.fixed().STOP)
        yield self._sent
        yield self._after(SETTLE_S)
        self._broadcast(*wire.forward(message))
        yield self._sent
        yield self._after(hold_s)
        self._broadcast(wire.fixed().STOP)
        yield self._sent

    def _setting_up(self, configuration: dict[Module, Content], messages: list[bytes]) -> Script:
        settings = self.settings
        yield self._after(_BOOT_S)
        self._event("set_up", f"robots are told {len(messages)} settings, {settings.rounds} times")
        yield from self._repeating(RESET, settings.hold_s)
        for _ in range(settings.rounds):
            for message in messages:
                yield from self._repeating(message, settings.hold_s)
        yield from self._configuring(configuration)

    def _configuring(self, configuration: dict[Module, Content]) -> Script:
        """Configures modules. STOP first: one that sends by infrared has no time for transfers."""
        self.running = False
        self._broadcast(wire.fixed().STOP)
        yield self._sent
        yield self._after(SETTLE_S)
        self.configuration = configuration
        transfers = self._transfers(configuration)
        frames = sum(len(frames) for round_ in transfers for _, _, frames in round_)
        what = f"{len(configuration)} modules are configured by {frames} frames"
        if len(transfers) > 1:
            what += f", one after the other where a module has several ({len(transfers)} at most)"
        self._event("configure", what, frames=frames)
        yield from self._configure(transfers)
        if len(configuration) < len(self.poller.modules):
            self._broadcast(wire.fixed().SETUP)
            yield self._sent
            yield self._after(SETTLE_S)
        yield from self._verifying()

    def _verifying(self) -> Script:
        """Finds modules that do not answer and, with `health`, those with a wrong configuration."""
        yield from self._looking()
        if not self.settings.health:
            return
        for attempt in range(_ATTEMPTS):
            silent = set(self.poller.silent)
            yield from self._requesting_health([m for m in self.poller.modules if m not in silent])
            wrong = [m for m, answer in self._health.items() if not self._is_right(m, answer)]
            if not wrong:
                return
            for module in wrong:
                if attempt < _ATTEMPTS - 1:
                    self._send_again(module)
                else:
                    what = f"module {module[0]}-{module[1]} has another configuration"
                    self._event("module_wrong", what, module)
            yield self._sent
            yield self._after(SETTLE_S)

    def _looking(self) -> Script:
        """Sweeps until each module has answered or counts as silent."""
        for _ in range(SILENT_AFTER):
            self.poller.sweep(self._now_s, all_modules=True)
            yield lambda: not self.poller.owing
            if not self.poller.missing:
                return

    def _requesting_health(self, modules: list[Module]) -> Script:
        for module in modules:
            self._health.pop(module, None)
            self._bus_health.pop(module, None)
            self._to(module, *wire.fixed().HEALTH_REQUESTS)
        yield self._sent
        yield self._after(SETTLE_S)

    def _transmitting(self, frames: Mapping[int, Sequence[Sending]], settle_s: float) -> Script:
        self.running = False
        self.poller.end()
        for bus, sendings in frames.items():
            for group, frame in sendings:
                self._queue(bus, group, [frame])
        yield self._sent
        yield self._after(settle_s)

    def _starting(self) -> Script:
        self._broadcast(wire.fixed().RUN)
        yield self._sent
        self.running = True
        self._event("run", "modules run and tell robots to")
        self.poller.excuse(self.poller.modules, self._after(_START_S))
        self.poller.begin(self._after(_START_S))

    def _pausing(self) -> Script:
        """Pauses robots. IDLE at the end, not STOP, which would also clear what cells send."""
        self.poller.end()
        self._broadcast(*wire.forward(WAKEUP))
        yield self._sent
        self._event("pause", "robots are told to pause")
        yield self._after(_REPEAT_S)
        self._broadcast(wire.fixed().IDLE)
        yield self._sent
        self.running = False

    def _resuming(self) -> Script:
        self._broadcast(*wire.forward(RUN))
        yield self._sent
        self._event("resume", "robots are told to go on")
        yield self._after(_REPEAT_S)
        yield from self._starting()

    def _changing(self, configuration: dict[Module, Content]) -> Script:
        for module, content in configuration.items():
            self.configuration[module] = behind(self.configuration.get(module), content)
        transfers = self._transfers(configuration)
        settle_s = SETTLE_S * len(transfers)
        self.poller.excuse(list(configuration), self._after(settle_s + _START_S))
        self._event("change", f"{len(configuration)} modules get another configuration")
        yield from self._configure(transfers)
        self.poller.excuse(list(configuration), self._after(_START_S))
        # Modules that run already ignore it.
        self._broadcast(wire.fixed().RUN)
        yield self._sent

    def _ending(self) -> Script:
        if self.running:
            # A module polled a moment ago may have answered before its last report came.
            self.poller.on = False
            yield lambda: not self.poller.owing
            self.poller.sweep(self._now_s)
            yield lambda: not self.poller.owing
        self.poller.end()
        yield from self._repeating(WAKEUP, _REPEAT_S)
        self._broadcast(wire.fixed().IDLE)
        yield self._sent
        if not self.unsent:
            self._event("idle", "robots and modules are idle")

    # Reporting.

    def _event(self, kind: str, text: str, module: Module | None = None, **more: Any) -> None:
        if module is not None:
            more["module"] = list(module)
        self._listener.event(self._now_s, kind, text, **more)

    def _look_at_links(self) -> None:
        for bus in range(self.layout.buses):
            trouble = self._links.trouble(bus)
            if trouble and bus not in self._down:
                self._down[bus] = trouble
                rows = self.layout.rows_of(bus)
                what = f"its modules, rows {rows[0]} to {rows[-1]}, are neither polled nor told"
                self._event("bus_down", f"bus {bus} is down ({trouble}): {what} anything", bus=bus)
            elif not trouble and bus in self._down:
                del self._down[bus]
                self._event("bus_up", f"bus {bus} works again", bus=bus)
