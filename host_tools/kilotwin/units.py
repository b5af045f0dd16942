"""The one place where seconds become ticks and real numbers become the firmware's Q16."""

TICK_S = 0.032768
"""A robot's nominal tick: 262,144 cycles of 125 ns."""

Q16_ONE = 65536


def ticks(seconds: float) -> int:
    """The number of nominal ticks nearest to `seconds`."""
    return round(seconds / TICK_S)


def seconds(tick_count: int) -> float:
    """How long so many nominal ticks last."""
    return tick_count * TICK_S


def ticks_q16(seconds: float) -> int:
    """Ticks times 65,536, for durations that must not be rounded to whole ticks."""
    return q16(seconds / TICK_S)


def q16(value: float) -> int:
    """`value` times 65,536, as CONFIG carries real numbers."""
    return round(value * Q16_ONE)
