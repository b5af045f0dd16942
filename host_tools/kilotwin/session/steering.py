"""Orders of a viewer to a run: checked, and carried out between two calls of the engine.

The viewer's process makes the orders (view/steering.py) of what its page asks; robots' programs run
here, so an order is data that was checked, and is checked again.
"""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationError

from kilotwin import _emulator
from kilotwin.errors import InputError
from kilotwin.experiment.schema.section import (
    MOST_ROBOTS,
    Byte,
    Coordinate,
    Section,
    Text,
    Uid,
)
from kilotwin.session.acts import PACED, STEERED, event_of
from kilotwin.session.pace import LEAST_SPEED, MOST_SPEED, MOST_STEP_TICKS, Pace
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Simulation

_MESSAGE_BYTES = 10
_Robot = Annotated[int, Field(ge=0, le=MOST_ROBOTS)]


class Message(Section):
    """Nine bytes and the type, for robots with these uids, in `region` [x, y, radius] if given."""

    data: Annotated[list[Byte], Field(min_length=_MESSAGE_BYTES, max_length=_MESSAGE_BYTES)]
    uid_first: Uid
    uid_last: Uid
    region: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] | None = None


_Do = Literal["pause", "resume", "step", "speed", "place", "turn", "send", "grid"]
_STEERING = ("place", "turn", "send", "grid")
_NEEDED: dict[str, set[str]] = {
    "pause": set(),
    "resume": set(),
    "step": set(),
    "speed": set(),
    "place": {"robot", "x_m", "y_m"},
    "turn": {"robot", "heading_rad"},
    "send": {"messages", "told"},
    "grid": {"order"},
}


class Order(Section):
    """One order. `id`: of the answer."""

    do: _Do
    id: Annotated[int, Field(ge=0, le=1 << 53)]
    ticks: Annotated[int, Field(ge=1, le=MOST_STEP_TICKS)] | None = None
    """step: so many; without it up to the next sample."""
    speed: Annotated[float, Field(ge=LEAST_SPEED, le=MOST_SPEED)] | None = None
    """speed: simulated seconds per second; without it as fast as it can."""
    robot: _Robot | None = None
    x_m: Coordinate | None = None
    y_m: Coordinate | None = None
    heading_rad: Annotated[float, Field(ge=-10, le=10)] | None = None
    """place: without it the robot keeps its heading."""
    messages: Annotated[list[Message], Field(min_length=1, max_length=100)] | None = None
    told: Text | None = None
    """send: what is told, as events have it."""
    order: Literal["pause", "resume"] | None = None
    """grid: of its host."""


def checked(raw: dict[str, Any]) -> Order:
    """The order; InputError says what is wrong with it."""
    try:
        order = Order.model_validate(raw)
    except ValidationError as error:
        problem = error.errors()[0]
        where = ".".join(str(part) for part in problem["loc"])
        raise InputError(f"{where or 'an order'}: {problem['msg']}") from None
    for name in _NEEDED[order.do]:
        if getattr(order, name) is None:
            raise InputError(f"{order.do} needs {name}")
    return order


def no_grid(order: str) -> None:
    """Refuses orders for a host that is not there."""
    raise InputError("there is no Kilogrid")


class Steering:
    """Carries orders out in a simulation."""

    def __init__(
        self,
        simulation: "Simulation",
        sample_ticks: int,
        record: Callable[[dict[str, Any]], None],
        grid: Callable[[str], None] = no_grid,
        uid_of: Callable[[int], int] = lambda robot: robot + 1,
    ) -> None:
        """`record` takes an event of each; `grid` takes orders for the host of a grid. Orders name
        robots by index, of which `uid_of` is the uid."""
        self.pace = Pace()
        self._simulation = simulation
        self._sample_ticks = sample_ticks
        self._record = record
        self._grid = grid
        self._uid_of = uid_of

    def do(self, raw: dict[str, Any]) -> None:
        """Carries an order out now. InputError, and nothing has changed, if it cannot be."""
        order = checked(raw)
        if order.do in _STEERING:
            self._note(STEERED, self._steer(order), order)
        else:
            self._note(PACED, self._set_pace(order), order)

    def _note(self, kind: str, text: str, order: Order) -> None:
        said = order.model_dump(exclude_none=True, exclude={"id", "told"})
        self._record(event_of(self._simulation.tick, kind, text, said))

    def _steer(self, order: Order) -> str:
        if order.do == "place":
            return self._place(order)
        if order.do == "turn":
            return self._turn(order)
        if order.do == "grid":
            assert order.order is not None
            self._grid(order.order)
            return f"the grid's host: {order.order}"
        assert order.messages is not None
        assert order.told is not None
        for message in order.messages:
            where = None if message.region is None else (*message.region,)
            assert where is None or len(where) == 3
            data = bytes(message.data)
            self._simulation.send(data, message.uid_first, message.uid_last, where)
        return order.told

    def _place(self, order: Order) -> str:
        assert order.robot is not None
        assert order.x_m is not None
        assert order.y_m is not None
        robot, simulation = self._robot(order.robot), self._simulation
        heading = order.heading_rad
        if heading is None:
            heading = float(simulation.snapshot()["heading_rad"][0][robot])
        try:
            simulation.place(robot, order.x_m, order.y_m, heading)
        except _emulator.EngineError:
            raise InputError(f"robot {self._uid_of(robot)} has no room there") from None
        return f"robot {self._uid_of(robot)} is put to {order.x_m:.3f}, {order.y_m:.3f}"

    def _turn(self, order: Order) -> str:
        assert order.robot is not None
        assert order.heading_rad is not None
        robot = self._robot(order.robot)
        self._simulation.turn(robot, order.heading_rad)
        degrees = math.degrees(order.heading_rad)
        return f"robot {self._uid_of(robot)} is turned to {degrees:.0f} degrees"

    def _robot(self, robot: int) -> int:
        if robot >= self._simulation.robots:
            raise InputError(f"there is no robot with index {robot}")
        return robot

    def _set_pace(self, order: Order) -> str:
        now_s, tick = time.monotonic(), self._simulation.tick
        if order.do == "pause":
            self.pace.pause()
            return "paused"
        if order.do == "resume":
            self.pace.resume(now_s, tick)
            return "goes on"
        if order.do == "step":
            sample = self._sample_ticks
            to_tick = (tick // sample + 1) * sample if order.ticks is None else tick + order.ticks
            self.pace.step(now_s, tick, to_tick)
            return f"goes on to {seconds(to_tick):.3f} s"
        self.pace.go_at(now_s, tick, math.inf if order.speed is None else order.speed)
        return "as fast as it can" if order.speed is None else f"{order.speed:g} x real time"
