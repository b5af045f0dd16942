"""The robots that an experiment can name, and what the firmware must be told about them."""

from collections.abc import Mapping
from dataclasses import dataclass

from kilotwin.experiment.programs import Runtime

SHORT_S = 300.0
"""A run that is so short is sampled more often."""

Defaults = dict[str, float | bool]


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
    range_m: float
    medium: str
    virtual_floor: bool
    runtime: Runtime
    line_of_light: bool  # walls stop its infrared, which is not reflected by the table
    legs: bool
    step_ticks: int
    sample_s: float
    short_sample_s: float  # of runs of SHORT_S at most


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
            range_m=0.8,
            medium="ideal",
            virtual_floor=True,
            runtime="kilotwin",
            line_of_light=True,
            legs=False,
            step_ticks=2,
            sample_s=10.0,
            short_sample_s=10.0,
        ),
        # hardware.md 2. Speed and [motion] are fitted to tracks of real robots, see
        # docs/limits.md; others say 7 to 15 mm/s.
        Profile(
            name="kilobot",
            radius_m=0.0165,
            speed_m_s=0.0103,
            turn_rad_s=0.785,
            straight_left=65,
            straight_right=65,
            turn_left=70,
            turn_right=70,
            range_m=0.10,
            medium="kilobot",
            virtual_floor=False,
            runtime="original",
            line_of_light=False,
            legs=True,
            step_ticks=4,  # as far as a foot-bot in 2, measured in radii
            # A robot of a published program decides something each second or two.
            sample_s=1.0,
            short_sample_s=0.25,
        ),
    ]
}

# Keys of [motion], besides speed and turn rate; a robot without legs has none of it.
MOTION_DEFAULTS: Mapping[str, Defaults] = {
    "foot-bot": {
        "mass_kg": 1.8,  # a guess
        "push_n": 1.8,  # a guess
        "kick_needed": False,
        "gives_way": True,
        "speed_spread": 0.0,
        "bias_spread": 0.0,
        "motor_noise": 0.0,
    },
    "kilobot": {
        "mass_kg": 0.010,  # hardware.md 2
        "push_n": 0.001,  # a guess
        "kick_needed": True,
        "gives_way": True,
        "speed_spread": 0.2,
        "bias_spread": 0.2,
        "motor_noise": 0.16,
    },
}


def motion_defaults(profile: Profile) -> Defaults:
    """Every key of [motion]."""
    return {
        "speed_m_s": profile.speed_m_s,
        "turn_rad_s": profile.turn_rad_s,
        **MOTION_DEFAULTS[profile.name],
    }
