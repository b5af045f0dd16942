"""The host of an emulated grid in the engine's own process: it lives by simulated time."""

import math
from typing import TYPE_CHECKING, Any

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import config_differences, lives_through_on_s
from kilotwin.files.headers import MOST_PER_BUS
from kilotwin.runs.event_places import EventPlaces
from kilotwin.runs.grid_record import GridEvents, GridRecord
from kilotwin.runs.tracking import sites_of_cells
from kilotwin.runs.writer import RunWriter
from kilotwin.session.loop import NEVER, Companion
from kilotwin.table.grid.conductor import Conductor, set_up_s
from kilotwin.table.grid.emulated_links import EmulatedLinks
from kilotwin.units import TICK_S, ticks

if TYPE_CHECKING:
    from kilotwin._emulator import Samples, Simulation

# Beyond the end of the run, for the host to leave robots and modules idle.
_ENDING_S = 30.0


def lead_ticks(experiment: Experiment) -> int:
    """How long before 0 the world must begin: chips have been on for `swarm.on_s`, and the set-up
    of a grid must be done."""
    on_s = experiment.keys.swarm.on_s or 0.0
    on_ticks = ticks(on_s) if lives_through_on_s(experiment) else 0
    plan = experiment.plan
    if plan is None:
        return on_ticks
    step_s = experiment.keys.engine.step_ticks * TICK_S
    return max(on_ticks, ticks(set_up_s(plan, len(config_differences(experiment)), step_s)))


class EmulatedHost(Companion):
    """Steps the conductor beside the engine."""

    def __init__(
        self,
        simulation: "Simulation",
        experiment: Experiment,
        places: EventPlaces,
        to: RunWriter | GridEvents | None,
    ) -> None:
        """`to`: the folder that it is written to, or an object that receives it."""
        plan = experiment.plan
        assert plan is not None
        self._plan = plan
        keys = experiment.keys
        self.simulation = simulation
        self._places = places
        names = [f"can{bus}" for bus in range(plan.layout.buses)]
        # The world begins some ticks below 0, and times in a log do not.
        self._zero_s = -simulation.tick * TICK_S
        self.record = to if isinstance(to, GridEvents) else GridEvents()
        if isinstance(to, RunWriter):
            self.record = GridRecord(to, experiment, names, self._zero_s)
        self._links = EmulatedLinks(simulation, plan.layout.buses, self.record.log)
        self.conductor = Conductor(
            plan,
            config_differences(experiment),
            keys.duration_s,
            self._links,
            self.record,
            # Steps are far apart: all modules that are due are polled in one.
            poll_window=MOST_PER_BUS,
        )
        self._absences = sorted((fault.from_s, fault.until_s) for fault in keys.faults.host)
        self._away = False
        self._due_tick = simulation.tick

    def see(self, samples: "Samples") -> None:
        """Corrects the sites in samples: on a grid those of the cells below robots."""
        sites_of_cells(samples, self._plan.layout, self._plan.site_maps, TICK_S)

    def module_events(self) -> list[dict[str, Any]]:
        """Events of modules' programs since the last call, which the record sees too."""
        events = [self._places.of_module(event) for event in self.simulation.module_events()]
        for event in events:
            self.record.module_event(event)
        return events

    def order(self, order: str) -> None:
        """Has the host `pause` or `resume` robots now, after what it is at. InputError while the
        grid is set up."""
        if self.conductor.phase != "running":
            raise InputError("the grid does not run yet, or no more")
        controller = self.conductor.controller
        if controller.busy:
            raise InputError("the host is at another order; try again in a moment")
        (controller.pause if order == "pause" else controller.resume)()
        self.notice_orders()

    def notice_orders(self) -> None:
        """To be called when the controller may have got an order since it last acted."""
        if not self._away:
            self._due_tick = min(self._due_tick, self._next_due_tick())

    def next_due(self) -> int:
        """When the host wants to act."""
        return self._due_tick

    def _next_due_tick(self) -> int:
        now_s = self._now_s
        times = [t for absence in self._absences for t in absence if t > now_s]
        if not self._away:
            times.append(self.conductor.next_step_s())
        due_s = min(times, default=math.inf)
        if math.isinf(due_s):
            return NEVER
        return max(self.simulation.tick + 1, math.ceil(due_s / TICK_S - 1e-6))

    def step(self, now: int) -> None:
        """Does what is due, if anything, unless the host is away."""
        if now >= self._due_tick:
            self._act(self._now_s)
            self._due_tick = self._next_due_tick()

    def _act(self, now_s: float) -> None:
        was_away = self._away
        self._away = any(from_s <= now_s < until_s for from_s, until_s in self._absences)
        if was_away:
            # Frames of the meantime are lost to it, though they were on the bus and are logged.
            self._links.receive(now_s)
        if self._away != was_away:
            what = "the host is gone" if self._away else "the host is back"
            self.record.event(now_s, "host_away" if self._away else "host_back", what)
        if not self._away:
            self.conductor.step(now_s)
        self.record.flush()

    def close(self) -> None:
        """Robots and modules idle, files closed; the engine goes on for as long as that takes."""
        self.conductor.end()
        end = self.simulation.tick + ticks(_ENDING_S)
        while self.conductor.phase != "done" and self.simulation.tick < end:
            self.simulation.advance(1)
            self.conductor.step(self._now_s)
        self.leave()

    def leave(self) -> None:
        """Leaves the buses, and robots and modules as they are; the files are whole."""
        self._links.close()
        self.record.close()

    def summary(self) -> dict[str, Any]:
        """`grid`."""
        controller = self.conductor.controller
        poller = controller.poller
        grid = {
            "reports": poller.counts.reports,
            "polls": poller.counts.asked,
            "polls_missed": poller.counts.missed,
            "bad_frames": poller.counts.bad_frames,
            "modules_failed": self.record.failed_modules(controller.silent),
            "undefined": self.record.undefined(),
            "buses": self.simulation.can_stats(),
            "cells": self.simulation.cell_stats(),
            "kilodat": self.record.kilodat and str(self.record.kilodat),
        }
        return {"grid": grid}

    @property
    def _now_s(self) -> float:
        return self.simulation.tick * TICK_S
