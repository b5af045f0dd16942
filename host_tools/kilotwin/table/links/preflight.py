"""Asks a grid, before an experiment, how its buses, modules and robots are.

Nothing is changed: modules are polled and asked for their health, robots for their vitals.
`verdicts` says what the answers mean for the experiment.
"""

from collections.abc import Callable, Sequence

from kilotwin.errors import DeviceError, InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.grid_plan import GridPlan
from kilotwin.table.can.buses import BusName, OpenBus, close_all, name_all, need_answers
from kilotwin.table.can.protocol import ModuleState
from kilotwin.table.grid.can_links import CanLinks
from kilotwin.table.grid.clock import Clock, WallClock
from kilotwin.table.grid.console import open_alone
from kilotwin.table.grid.controller import Controller, NoListener
from kilotwin.table.grid.foreign_orders import WatchedLinks
from kilotwin.table.grid.links import Links
from kilotwin.table.links.grid_robots import GridRobots
from kilotwin.table.links.readiness import Finding, NotAsked, Seen, Wanted, judge
from kilotwin.table.links.robot_link import Report
from kilotwin.table.links.roll_call import RollCall

_STEP_S = 0.001
# Longer than modules that have just been switched on are silent.
_BOOT_S = 1.3
# A module hears one answer in four: a robot that is there is missed so often in one case of ten.
_QUIET_QUESTIONS = 8
# Enough to know that robots are awake; with one robot in a cell half of them are heard.
_FEW_QUESTIONS = 3


def check(
    experiment: Experiment, names: Sequence[str], *, takeover: bool, note: Callable[[str], None]
) -> list[Finding]:
    """All about a grid at the end of these buses, as --can names them.

    InputError or DeviceError if that cannot be, as on a bus where another host gives orders, unless
    for `takeover`. It takes some seconds, and a minute where robots are missing.
    """
    if experiment.plan is None:
        raise InputError(f"{experiment.origin.source}: no [grid] to check; add it")
    layout = experiment.plan.layout
    bus_names = name_all(names, layout.buses, (layout.columns, layout.rows))
    need_answers(bus_names, "a check takes CAN adapters")
    buses = open_alone(bus_names, takeover)
    try:
        return _findings(experiment, buses, bus_names, WallClock(), note, ask_all=True)
    finally:
        close_all(buses)


def check_before_record(
    experiment: Experiment,
    buses: Sequence[OpenBus],
    names: Sequence[BusName],
    *,
    speed: float,
    note: Callable[[str], None],
) -> list[Finding]:
    """Faults that set-up does not put right. Robots of our runtime are asked, a few times."""
    found = _findings(experiment, buses, names, WallClock(speed), note, ask_all=False)
    return [finding for finding in found if finding.concerns_record]


def _findings(
    experiment: Experiment,
    buses: Sequence[OpenBus],
    names: Sequence[BusName],
    clock: Clock,
    note: Callable[[str], None],
    *,
    ask_all: bool,
) -> list[Finding]:
    plan = experiment.plan
    assert plan is not None
    programs = [group.program for group in experiment.groups]
    # An image does not say whose runtime is in it.
    answering = any(program.runtime == "kilotwin" and program.sources for program in programs)
    wanted = Wanted(plan.configuration, experiment.size, answering, all_asked=ask_all)

    def ask(roll_call: RollCall) -> None:
        note("asking robots")
        if ask_all:
            roll_call.ask_until(_QUIET_QUESTIONS, expected=experiment.size)
            return
        for _ in range(_FEW_QUESTIONS):
            if len(roll_call.robots) < experiment.size:
                roll_call.ask()

    note("asking modules")
    links = WatchedLinks(
        CanLinks([bus.bus for bus in buses], echoes=[bus.echoes for bus in buses]), announces=True
    )
    ask_robots = ask if ask_all or answering else None
    seen = look_at_table(plan, links, [str(name) for name in names], clock, ask_robots)
    return judge(seen, wanted)


def look_at_table(
    plan: GridPlan,
    links: Links,
    names: Sequence[str],
    clock: Clock,
    ask_robots: Callable[[RollCall], None] | None,
) -> Seen:
    """All that a grid at the end of these buses says; DeviceError if none of them works.

    No other host may be on them, and nothing may be recorded: polls take reports away.
    `ask_robots` asks them as often as it likes; None: they are left alone.
    """
    layout = plan.layout.on_buses(len(links))
    controller = Controller(layout, plan.settings, links, NoListener())
    table = _Table(controller, names, clock)
    table.carry_out(controller.look)
    if len(controller.poller.heard) < len(controller.poller.modules):
        table.wait(_BOOT_S)
        table.carry_out(controller.look)
    cut_off = {module for bus in controller.down for module in layout.modules_of(bus)}
    there = [module for module in controller.poller.heard if module not in cut_off]
    table.carry_out(lambda: controller.request_health(there))
    if 0 < len(controller.health) < len(there):
        heard = {*controller.health} & {*controller.bus_health}
        table.carry_out(lambda: controller.request_health(m for m in there if m not in heard))
    robots: dict[int, Report] | NotAsked = NotAsked.UNWANTED
    if ask_robots is not None:
        why_not = _why_not(controller)
        if why_not is None:
            roll_call = RollCall(GridRobots(layout, links, clock, names))
            ask_robots(roll_call)
            robots = roll_call.robots
        else:
            robots = why_not
    return Seen(
        layout=layout,
        names=tuple(names),
        down=dict(controller.down),
        silent=sorted({*layout.modules()} - {*there}),
        health=dict(controller.health),
        bus_health=dict(controller.bus_health),
        robots=robots,
    )


def _why_not(controller: Controller) -> NotAsked | None:
    """Why modules would not ask their robots, if none would."""
    if controller.down:
        return NotAsked.BUS_DOWN
    if not controller.health:
        return NotAsked.NO_MODULE
    if all(answer.state == ModuleState.RUNNING for answer in controller.health.values()):
        return NotAsked.RUNNING
    return None


class _Table:
    """A controller whose orders are waited for, also where a bus is down."""

    def __init__(self, controller: Controller, names: Sequence[str], clock: Clock) -> None:
        self._controller, self._names, self._clock = controller, names, clock
        controller.step(clock.now_s())

    def carry_out(self, order: Callable[[], None]) -> None:
        order()
        self._step()
        while self._controller.busy:
            self._clock.sleep(_STEP_S)
            self._step()

    def wait(self, seconds: float) -> None:
        end_s = self._clock.now_s() + seconds
        while self._clock.now_s() < end_s:
            self._clock.sleep(_STEP_S)
            self._step()

    def _step(self) -> None:
        self._controller.step(self._clock.now_s())
        down = self._controller.down
        if len(down) == len(self._names):
            buses = "; ".join(f"{self._names[bus]}: {why}" for bus, why in sorted(down.items()))
            raise DeviceError(f"--can {buses}; see to the bus, then type this again")
