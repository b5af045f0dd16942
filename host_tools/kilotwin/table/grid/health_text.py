"""Counts of modules' health as text: those that matter, and what to do about them."""

from collections.abc import Mapping
from statistics import median

from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.table.can.protocol import BusHealth, Health

MANY_ERRORS = 96
"""With so many, of 255, a CAN controller warns; from 128 on it may not signal errors any more."""


def counts_text(answers: Mapping[Module, Health], bus: Mapping[Module, BusHealth]) -> list[str]:
    """A line for each count of a module that matters, with what to do; then one on the others."""
    if not answers:
        return []
    lines = [line for module in sorted(answers) for line in _of_answer(module, answers[module])]
    typical_s = median(health.uptime_s for health in bus.values()) if bus else 0
    lines += [line for module in sorted(bus) for line in _of_bus(module, bus[module], typical_s)]
    if lines:
        return [*lines, "all other counts are of no weight"]
    return [
        "no count matters: no report was lost, no frame refused, no module reset, and no CAN "
        f"controller counts {MANY_ERRORS} errors or more (fewer are sent again, and fade)"
    ]


def _of_answer(module: Module, health: Health) -> list[str]:
    name = f"module {module[0]}-{module[1]}"
    lines = []
    if health.lost_records:
        lines.append(
            f"{name}: {health.lost_records} reports lost, which no table has: let robots report "
            "less often, or poll more often (grid.poll_s)"
        )
    if health.refused_frames:
        lines.append(
            f"{name}: {health.refused_frames} frames refused since it has power; if that grows, "
            "another host or version sends what it does not know: kilotwin grid check EXP"
        )
    return lines


def _of_bus(module: Module, health: BusHealth, typical_s: float) -> list[str]:
    name = f"module {module[0]}-{module[1]}"
    lines = []
    errors = max(health.transmit_errors, health.receive_errors)
    if errors >= MANY_ERRORS:
        lines.append(f"{name}: {errors} CAN errors: see to its plug, and to the bus's terminators")
    if health.uptime_s < typical_s / 2:
        lines.append(
            f"{name}: has power for {health.uptime_s} s, others for {typical_s:.0f} s: it was "
            "reset; its configuration is gone if it was not set up since: kilotwin grid setup EXP"
        )
    return lines
