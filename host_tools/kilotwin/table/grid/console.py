"""A grid at the end of CAN buses, for one order at a time: what `kilotwin grid` does."""

import re
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

from kilotwin.errors import DeviceError, InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec import kconf
from kilotwin.experiment.spec.engine import config_differences
from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.experiment.spec.grid_plan import Settings
from kilotwin.experiment.spec.overhead import COMMANDS, DATA_BYTES, message
from kilotwin.files.headers import MOST_PER_BUS
from kilotwin.table.can.buses import BusName, OpenBus, close_all, name_all, open_all
from kilotwin.table.can.protocol import ModuleState
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.clock import Clock, WallClock
from kilotwin.table.grid.controller import Controller
from kilotwin.table.grid.foreign_orders import WatchedLinks, refuse_another_host
from kilotwin.table.grid.health_text import counts_text
from kilotwin.table.grid.poller import Reports

_STEP_S = 0.001
_SIZE = re.compile(r"(\d{1,2})x(\d{1,2})")
_DEFAULT_SIZE = "10x20"
_USER = "user"

Note = Callable[[str], None]


class Console:
    """A controller with buses and a clock; each method returns when its order is done."""

    def __init__(self, layout: Layout, settings: Settings, buses: Sequence[OpenBus]) -> None:
        self._layout = layout
        self._buses = buses
        self._answers = all(bus.answers for bus in buses)
        self._note: Note = lambda _: None
        links = WatchedLinks(
            CanLinks([b.bus for b in buses], echoes=[b.echoes for b in buses]),
            announces=self._answers,
        )
        self._controller = Controller(layout, settings, links, self)
        self._clock = WallClock()
        self._controller.step(self._clock.now_s())

    @staticmethod
    def open(
        names: Sequence[str],
        size: str | None,
        experiment: Experiment | None,
        *,
        takeover: bool = False,
    ) -> "Console":
        """On buses as `--can` names them; InputError or DeviceError if that cannot be.

        Not where another host gives orders, unless for `takeover`.
        """
        if experiment is None:
            layout, bus_names = named_grid(names, size)
            return Console(layout, Settings(), open_alone(bus_names, takeover))
        if experiment.plan is None:
            raise InputError(f"{experiment.origin.source}: no [grid]; add it")
        layout, settings = experiment.plan.layout, experiment.plan.settings
        if size is not None and _parse_size(size) != (layout.columns, layout.rows):
            what = f"{experiment.origin.source} has {layout.columns}x{layout.rows}"
            raise InputError(f"--size {size}: {what}; leave --size out, or change [grid]")
        bus_names = name_all(names, layout.buses, (layout.columns, layout.rows))
        return Console(layout.on_buses(len(bus_names)), settings, open_alone(bus_names, takeover))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        close_all(self._buses)

    @property
    def silent(self) -> list[Module]:
        """Modules that do not answer."""
        return self._controller.poller.silent

    def look(self) -> list[Module]:
        """Polls all modules; returns those that do not answer."""
        self._controller.look()
        self._finish()
        return self.silent

    def presence(self) -> dict[str, Any]:
        """Findings of `look`."""
        here = [m for m in self._layout.modules() if m not in self.silent]
        return {
            "modules": [list(m) for m in here],
            "silent": [list(m) for m in self.silent],
            "known": self._answers,
        }

    def presence_text(self) -> str:
        """Findings of `look` as a map: the highest row first."""
        if not self._answers:
            count = self._layout.columns * self._layout.rows
            return f"a dispatcher does not say which modules answer; {count} are taken to be there"
        silent = set(self.silent)
        lines = [
            f"{y:2} " + " ".join("." if (x, y) not in silent else "-" for x in range(columns))
            for columns in [self._layout.columns]
            for y in reversed(range(self._layout.rows))
        ]
        lines.append("   " + " ".join(str(x % 10) for x in range(self._layout.columns)))
        there = self._layout.columns * self._layout.rows - len(silent)
        lines.append(f"{there} modules answer, {len(silent)} do not (-)")
        return "\n".join(lines)

    def health(self) -> list[dict[str, Any]]:
        """The health of those modules that answer."""
        self._controller.request_health([m for m in self._layout.modules() if m not in self.silent])
        self._finish()
        bus = self._controller.bus_health
        return [
            {
                "module": list(module),
                **asdict(answer),
                "state": ModuleState(answer.state).name,
                **(asdict(bus[module]) if module in bus else {}),
            }
            for module, answer in sorted(self._controller.health.items())
        ]

    def health_text(self) -> str:
        """The same as text: modules per state, and the counts that matter."""
        if not self._answers:
            return "health is not known: a dispatcher passes on no answers"
        answers = self._controller.health
        states: dict[str, int] = {}
        for answer in answers.values():
            name = ModuleState(answer.state).name
            states[name] = states.get(name, 0) + 1
        lines = [f"{count} modules are {name}" for name, count in sorted(states.items())]
        mute = self._layout.columns * self._layout.rows - len(self.silent) - len(answers)
        if mute:
            lines.append(f"{mute} modules answer polls, but not for their health (original ones)")
        if self.silent:
            lines.append(f"{len(self.silent)} modules do not answer: {_names(self.silent)}")
        lines += counts_text(answers, self._controller.bus_health)
        return "\n".join(lines)

    def set_up(self, experiment: Experiment, note: Note) -> dict[str, Any]:
        """Robots and modules of an experiment."""
        assert experiment.plan is not None
        self._note = note
        configuration = experiment.plan.configuration
        self._controller.set_up(configuration, config_differences(experiment))
        return self._set_up(len(configuration))

    def configure(self, file: Path, note: Note) -> dict[str, Any]:
        """The modules that a .kconf file names."""
        self._note = note
        blocks = kconf.read(file)
        wanted = kconf.configurations(blocks, self._layout.columns, self._layout.rows, str(file))
        self._controller.configure(wanted)
        return self._set_up(len(wanted))

    def run(self) -> None:
        """Modules run and send RUN to robots."""
        self._controller.resume()
        self._finish()

    def pause(self) -> None:
        """Robots stop where they are."""
        self._controller.pause()
        self._finish()

    def idle(self) -> None:
        """Robots and modules stop."""
        self._controller.set_idle()
        self._finish()

    def send(self, what: bytes, hold_s: float) -> None:
        """One message for robots."""
        self._controller.send_to_robots(what, hold_s)
        self._finish()

    def reports(self, reports: Reports) -> None:
        """Reports are not shown."""

    def event(self, now_s: float, kind: str, text: str, **more: Any) -> None:
        """Notes the step that is under way."""
        self._note(text)

    def _set_up(self, modules: int) -> dict[str, Any]:
        self._finish()
        return {"modules": modules, "silent": [list(module) for module in self.silent]}

    def _finish(self) -> None:
        carry_out(self._controller, self._clock, [bus.name for bus in self._buses])


def open_alone(names: Sequence[BusName], takeover: bool) -> list[OpenBus]:
    """The buses, opened, on which no other host gives orders, unless for `takeover`."""
    buses = open_all(names)
    if takeover:
        return buses
    links = CanLinks([b.bus for b in buses], echoes=[b.echoes for b in buses])
    try:
        refuse_another_host(links, [str(name) for name in names])
    except BaseException:
        links.close()
        raise
    return buses


def named_grid(names: Sequence[str], size: str | None) -> tuple[Layout, list[BusName]]:
    """A grid by --can and --size, which is 10x20 if not given; InputError if it cannot be."""
    size = size or _DEFAULT_SIZE
    columns, rows = _parse_size(size)
    whole = len(names) == 1 and names[0].startswith("socketcand:") and "/" not in names[0]
    # As many buses as the real table has, or as a smaller one needs.
    buses = min(4, rows) if whole else len(names)
    if buses > rows:
        named = "one bus is" if buses == 1 else f"{buses} buses are"
        what = f"{named} named, but each has whole rows"
        raise InputError(f"--size {size}: {what}; name {rows} at most, or another size")
    bus_names = name_all(names, buses, (columns, rows))
    layout = Layout(columns, rows, buses)
    if bus_names[0].size is not None:
        return layout, bus_names  # a dispatcher has as many buses as it needs
    most = max(len(layout.modules_of(bus)) for bus in range(buses))
    if most > MOST_PER_BUS:
        what = f"{most} modules on a bus, but {MOST_PER_BUS} are the most"
        raise InputError(f"--size {size}: {what}; name more buses, or another size")
    return layout, bus_names


def carry_out(controller: Controller, clock: Clock, bus_names: Sequence[str]) -> None:
    """Steps the controller until its order is done; DeviceError if a bus does not work."""
    controller.step(clock.now_s())
    while controller.busy and len(controller.down) < len(bus_names):
        clock.sleep(_STEP_S)
        controller.step(clock.now_s())
    if controller.down:
        buses = "; ".join(f"{bus_names[bus]}: {why}" for bus, why in controller.down.items())
        rest = "its modules and robots do what they did; see to the bus, then type this again"
        raise DeviceError(f"--can {buses}; {rest}")


def message_for_robots(name: str, kind: int | None, data: str | None) -> bytes:
    """The message of `kilotwin grid send`: nine bytes and a type; InputError if it cannot be."""
    if name != _USER and (kind is not None or data is not None):
        raise InputError(f"send {name}: --type and --data go with user only")
    if name in COMMANDS:
        return message((), COMMANDS[name])
    if name != _USER:
        raise InputError(f"send {name}: no such message; allowed: {', '.join(COMMANDS)}, {_USER}")
    if kind is None:
        raise InputError("send user: of which type? Add --type 0 to 127")
    try:
        values = [int(part, 0) for part in data.split(",")] if data else []
        return message(_checked(values), kind)
    except ValueError:
        what = f"not up to {DATA_BYTES} bytes from 0 to 255, with commas between them"
        raise InputError(f"--data {data}: {what}") from None


def _checked(values: list[int]) -> bytes:
    if len(values) > DATA_BYTES:
        raise ValueError
    return bytes(values)


def _parse_size(text: str) -> tuple[int, int]:
    found = _SIZE.fullmatch(text)
    most = kconf.LAST + 1
    if not found or not all(1 <= int(number) <= most for number in found.groups()):
        raise InputError(f"--size {text}: not COLUMNSxROWS, each 1 to {most}; try 10x20")
    return int(found[1]), int(found[2])


def _names(modules: Sequence[Module]) -> str:
    return ", ".join(f"{x}-{y}" for x, y in modules)
