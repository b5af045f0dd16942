"""Notes at the end of a run on what hardly anybody means: motors that are on and do not turn,
messages that reach nobody, a uid that no robot has."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from kilotwin.errors import KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.units import counted

if TYPE_CHECKING:
    from kilotwin import _emulator

_HUMMED_S = 5.0


def of_robots(simulation: "_emulator.Simulation", experiment: Experiment) -> Iterator[str]:
    """Notes on motors that hummed and on frames that reached no robot."""
    hummed, first = simulation.hummed_s(), 0
    for group in experiment.groups:
        of_group = hummed[first : first + group.count]
        first += group.count
        if robots := int((of_group >= _HUMMED_S).sum()):
            yield (
                f"{group.program.name}: motors of {counted(robots, 'robot')} were on for up to "
                f"{of_group.max():,.0f} s without turning; a motor that stands needs 15 ms at full "
                "duty, spinup_motors(): docs/porting.md#no-kick"
            )
    stats = simulation.stats()
    sent, alone = int(stats["frames_sent"]), simulation.robots == 1
    if sent == 0 or alone or experiment.keys.grid is not None or stats["frames_received"]:
        return
    if stats["frames_spoilt"] == sent:
        yield (
            f"{sent:,} frames were sent, none with the right checksum: no robot takes them; "
            "message.crc = message_crc(&message) after every change"
        )
    else:
        yield (
            f"{sent:,} frames were sent, and no robot received one: none was within medium.range_m "
            f"= {experiment.keys.medium.range_m:g} of a sender"
        )


def of_programs(experiment: Experiment, stats: dict[str, Any]) -> Iterator[str]:
    """Notes from the machine code of the programs, where avr-gcc is; `stats` of the run."""
    if experiment.keys.swarm.profile != "kilobot":
        return
    from kilotwin.programs.port.code_facts import facts_of

    uids = {experiment.uid_of(robot) for robot in range(experiment.size)}
    listens = False
    for program in dict.fromkeys(group.program for group in experiment.groups):
        try:
            facts = facts_of(program) if program.sources else None
        except KilotwinError:
            facts = None
        # The Kilogrid's helpers may set the callback.
        listens = listens or facts is None or program.api != "kilobot" or facts["listens"]
        if facts is None:
            continue
        for function, place in facts["never_returns"]:
            yield f"{place}: {function}() never returns: its robots stay there"
        for place in () if 0 in uids else facts["asks_for_uid_0"]:
            yield (
                f"{place}: kilo_uid is compared with 0, which no robot has: they have {min(uids)} "
                f"to {max(uids)}; swarm.first_uid = 0 counts from 0"
            )
    received = stats["frames_received"]
    if received and experiment.keys.grid is None and not listens:
        yield (
            f"{received:,} frames reached robots, and no program sets kilo_message_rx: none of "
            "them hears"
        )
