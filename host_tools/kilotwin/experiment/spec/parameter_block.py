"""The parameters of `firmware/aggregation` as CONFIG carries them, one a message.

Keys, units and ranges on air are those of firmware/aggregation/default_params.h; what a value means
there is said here, for each of them in the order in which they are sent.
"""

from collections.abc import Iterable
from typing import get_args

from kilotwin import _emulator
from kilotwin.experiment.schema.controller import Controller, Reading
from kilotwin.experiment.schema.parameter import Parameter
from kilotwin.experiment.schema.section import Section

ALL_ROBOTS = (0, 0xFFFF)

Message = tuple[int, int, bytes]
"""First uid, last uid, nine bytes and the type."""

_Q16 = 65536
_REAL = Parameter("real", _Q16)
_TICKS = Parameter("seconds")
_WHOLE = Parameter("whole")
_YES_NO = Parameter("yes_no")


def _choice(table: type[Section], key: str) -> Parameter:
    """default_params.h numbers words in the order of the schema."""
    return Parameter("choice", choices=get_args(table.model_fields[key].annotation))


_CONTROLLER = {
    "RULE": ("rule", _choice(Controller, "rule")),
    "ALPHA": ("alpha", _REAL),
    "BETA": ("beta", _REAL),
    "FIRAT_A": ("a", _REAL),
    "FIRAT_K": ("k", _REAL),
    "UPDATE_TICKS": ("update_s", _TICKS),
    "STRAIGHT_TICKS": ("straight_s", _TICKS),
    "ENTRY_TICKS": ("entry_s", _TICKS),
    "RHO": ("rho", _REAL),
    "TURN_TICKS_PER_RAD": ("turn_s_per_rad", Parameter("seconds", _Q16)),
    "WINDOW_TICKS": ("neighbour_window_s", _TICKS),
    "TIMEOUT_TICKS": ("neighbour_timeout_s", _TICKS),
    "CAPACITY": ("neighbour_capacity", _WHOLE),
    "EMPTY_WINDOWS": ("empty_windows", _WHOLE),
    "STEP_TICKS": ("control_step_s", _TICKS),
    "WALL_IGNORE_TICKS": ("wall_ignore_s", _TICKS),
    "LEAVE_TURN": ("leave_turn", _YES_NO),
}
_READING = {
    "SIGNAL_FROM": ("signal_from", _choice(Reading, "signal_from")),
    "FIRST_LEAVE": ("first_leave", _choice(Reading, "first_leave")),
    "WALK_OUT": ("walk_out", _choice(Reading, "walk_out")),
    "ENTRY_OBSTACLE": ("entry_obstacle", _choice(Reading, "entry_obstacle")),
    "COUNT_SELF": ("count_self", _YES_NO),
    "FIRAT_JOIN": ("firat_join", _choice(Reading, "firat_join")),
    "FIRAT_SIGNAL_FROM": ("firat_signal_from", _choice(Reading, "firat_signal_from")),
    "START_ON_SITE": ("start_on_site", _choice(Reading, "start_on_site")),
    "UPDATE_CLOCK": ("update_clock", _choice(Reading, "update_clock")),
    "PUSHED_OFF": ("pushed_off", _choice(Reading, "pushed_off")),
}


def config_values(
    controller: Controller, reading: Reading, report_s: float = 0.0
) -> dict[str, int]:
    """The value of every key of default_params.h but INFORMED_SITE, in the firmware's units."""
    return {
        **_numbers(_CONTROLLER, controller),
        "TRACKING_TICKS": _TICKS.number(report_s),
        **_numbers(_READING, reading),
    }


def _numbers(declared: dict[str, tuple[str, Parameter]], table: Section) -> dict[str, int]:
    return {
        name: parameter.number(getattr(table, key)) for name, (key, parameter) in declared.items()
    }


def config_messages(
    controller: Controller,
    reading: Reading,
    report_s: float,
    informed: Iterable[tuple[int, int, int]],
) -> list[Message]:
    """Every parameter for all; then each site's informed robots: its number, first id, count."""
    values = config_values(controller, reading, report_s)
    settings: list[tuple[int, int, str, int]] = [
        (*ALL_ROBOTS, name, value) for name, value in values.items()
    ]
    for site, first_id, count in informed:
        settings.append((first_id + 1, first_id + count, "INFORMED_SITE", site))
    return [_config(*setting) for setting in settings]


def reports_message(report_s: float) -> Message:
    """For robots that keep their own parameters: how often they report."""
    return _config(*ALL_ROBOTS, "TRACKING_TICKS", _TICKS.number(report_s))


def is_default(message: bytes) -> bool:
    """Whether a message of this block tells what a robot does anyway that has just started."""
    defaults = {key: default for key, default, _, _ in _emulator.CONFIG_KEYS.values()}
    return int.from_bytes(message[5:9], "little") == defaults[message[4]]


def _config(first: int, last: int, name: str, value: int) -> Message:
    key = _emulator.CONFIG_KEYS[name][0]
    return first, last, _emulator.config_message(first, last, key, value)
