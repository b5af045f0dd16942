"""Outcome of a run by the engine alone, for comparisons of ways to run it."""

from pathlib import Path
from typing import Any

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.programs.group import build_group
from kilotwin.programs.variant import Variant


def outcome(
    file: Path,
    *,
    ticks: int,
    chunk: int,
    sample_ticks: int,
    variant: Variant = "plain",
    **spec: bool,
) -> tuple[Any, ...]:
    """Hash, events and statistics after `ticks`, which go by in chunks; "watched": with a trail,
    the first robot looked at closely; `spec`: keys of the engine's input that no experiment has."""
    experiment = Experiment.load(file)
    guests = [str(build_group(group, variant=variant).file) for group in experiment.groups]
    keys = engine_spec(experiment, guests, sample_ticks=sample_ticks, black_box=None) | spec
    simulation = _emulator.Simulation(keys)
    if variant == "watched":
        nothing_drawn: list[list[tuple[int, int]]] = [[] for _ in range(experiment.size)]
        simulation.keep_trail(1000, nothing_drawn, 0, 0x100, 0x900)
    events: list[Any] = []
    for done in range(0, ticks, chunk):
        simulation.advance(min(chunk, ticks - done))
        events += simulation.events()
    return simulation.result_hash(), events, simulation.stats()
