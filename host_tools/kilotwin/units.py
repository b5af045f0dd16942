"""Units: seconds and ticks, the firmware's Q16, durations as text."""

CYCLES_PER_S = 8_000_000
"""Clock of the robots' processor."""

TICK_CYCLES = 262_144
"""A robot's nominal tick, in those cycles."""

TICK_S = TICK_CYCLES / CYCLES_PER_S
"""The same in seconds: 0.032768."""

Q16_ONE = 65536


def ticks(seconds: float) -> int:
    """The number of nominal ticks nearest to `seconds`."""
    return round(seconds / TICK_S)


def seconds(tick_count: int) -> float:
    """How long so many nominal ticks last."""
    return tick_count * TICK_S


def q16(value: float) -> int:
    """`value` times 65,536, as CONFIG carries real numbers."""
    return round(value * Q16_ONE)


def duration_text(duration_s: float) -> str:
    """`40 s`, `12 min`, `2.5 h`."""
    if duration_s < 90:
        return f"{duration_s:.0f} s"
    minutes = duration_s / 60
    return f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h"


def counted(number: int, thing: str) -> str:
    """`1 print`, `1,000 prints`."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"
