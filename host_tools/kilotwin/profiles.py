"""The robots that an experiment can name, and what the firmware must be told about them."""

from collections.abc import Mapping
from dataclasses import dataclass

ControllerDefaults = Mapping[str, str | float | bool]


@dataclass(frozen=True)
class Profile:
    """One kind of robot. Lengths in metres; duties are those that give full speed or turn rate."""

    name: str
    radius_m: float
    speed_m_s: float
    turn_rad_s: float
    straight_left: int
    straight_right: int
    turn_left: int
    turn_right: int
    push_m_s2: float
    range_m: float
    virtual_floor: bool


PROFILES = {
    profile.name: profile
    for profile in [
        Profile(
            name="foot-bot",
            radius_m=0.085,
            speed_m_s=0.10,
            turn_rad_s=1.43,
            straight_left=70,
            straight_right=70,
            turn_left=65,
            turn_right=65,
            push_m_s2=1.0,
            range_m=0.8,
            virtual_floor=True,
        ),
    ]
}

# What the paper fixes, for every robot.
_PAPER: ControllerDefaults = {
    "rule": "simplified",
    "alpha": 0.5,
    "beta": 2.25,
    "a": 2.0,
    "k": 18.0,
    "rho": 0.5,
    "control_step_s": 0.1,
    "neighbour_capacity": 100,
}

CONTROLLER_DEFAULTS: Mapping[str, ControllerDefaults] = {
    # paper.md 1 and 2; 18 ticks hear one frame per 16 ticks of everybody on a lossless medium.
    "foot-bot": {
        **_PAPER,
        "update_s": 2.0,
        "straight_s": 5.0,
        "entry_s": 10.0,
        "turn_s_per_rad": 0.70,
        "neighbour_window_s": 0.59,
        "empty_windows": 1,
        "wall_ignore_s": 0.0,
        "leave_turn": False,
    },
    # paper.md 5: times by 1.25; the firmware's own defaults (wire.h) are these.
    "kilobot": {
        **_PAPER,
        "update_s": 2.5,
        "straight_s": 6.25,
        "entry_s": 12.5,
        "turn_s_per_rad": 1.27,
        "neighbour_window_s": 2.5,
        "empty_windows": 2,
        "wall_ignore_s": 16.0,
        "leave_turn": True,
    },
}
