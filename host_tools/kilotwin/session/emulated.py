"""An emulated world as the table of a run: the engine in this process, in simulated time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from kilotwin.runs.event_places import EventPlaces
from kilotwin.session.loop import Table

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation
    from kilotwin.session.emulated_grid import EmulatedHost


class EmulatedWorld(Table):
    """The engine up to the tick `end`. `hosts`: that of its Kilogrid, if there is one."""

    zero_tick = 0
    """The engine's tick when the run began."""

    def __init__(
        self,
        simulation: "Simulation",
        places: EventPlaces,
        hosts: "Sequence[EmulatedHost]" = (),
        end: int = 0,
    ) -> None:
        self.simulation = simulation
        self.end = end
        self.hosts = hosts
        self._places = places

    @property
    def tick(self) -> int:
        """The engine's."""
        return self.simulation.tick

    @property
    def run_tick(self) -> int:
        """The same since the run began."""
        return self.simulation.tick - self.zero_tick

    @property
    def ran(self) -> bool:
        """Whether the whole run is over."""
        return self.over

    @property
    def over(self) -> bool:
        """Whether it has come to its end."""
        return self.simulation.tick >= self.end

    def advance(self, to: int) -> None:
        """Goes on to `to`, or to its end."""
        self.simulation.advance(min(to, self.end) - self.simulation.tick)

    def samples(self) -> "Samples":
        """Those since the last call; ticks are the run's."""
        return self._seen(self.simulation.samples())

    def snapshot(self) -> "Samples":
        """How robots are now, as one sample."""
        return self._seen(self.simulation.snapshot())

    def last_moment(self) -> "Samples":
        """How robots are at the end of the run, as one sample, or none if it lies behind."""
        return self.snapshot()

    def events(self) -> list[dict[str, Any]]:
        """Events of robots and modules since the last call, in order of time; ticks are the run's.
        Those of modules have the key `module`, those of robots `robot`."""
        modules = [event for host in self.hosts for event in host.module_events()]
        return sorted(modules + self.robot_events(), key=lambda event: event["tick"])

    def robot_events(self) -> list[dict[str, Any]]:
        """Those of robots alone."""
        events = [self._places.of_robot(event) for event in self.simulation.events()]
        for event in events:
            event["tick"] -= self.zero_tick
        return events

    def _seen(self, samples: "Samples") -> "Samples":
        """On a grid, sites are those of the cells below robots."""
        for host in self.hosts:
            host.see(samples)
        return samples
