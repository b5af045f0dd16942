"""Robots that run translated do the same however far they run at once; same seed, same result."""

from pathlib import Path
from typing import Any

import pytest

from .outcomes import outcome as engine_outcome

ROOT = Path(__file__).resolve().parents[2]
CORPUS = Path(__file__).parent / "corpus"
TICKS = 400
WORLD = """
name = "translated"
seed = {seed}
duration_s = 60

[arena]
shape = "circle"
diameter_m = {arena_m}

[swarm]
profile = "{profile}"
floor = {floor}
"""
ROBOTS = """
[[robots]]
program = "{program}"
cpu = "translated"
count = 4
"""
KILOBOTS = [
    ROOT / "firmware/examples/talk_and_listen.c",
    ROOT / "firmware/examples/random_walk_counter.c",
    ROOT / "firmware/examples/orbit.c",
    CORPUS / "passes_blink.c",
    CORPUS / "delay_in_callback.c",
    CORPUS.parent / "programs/delay_while_held.c",
    CORPUS / "two_producers.c",
    CORPUS / "random_delays.c",
]


def outcome(file: Path, *, run_ahead: bool, chunk: int) -> tuple[Any, ...]:
    return engine_outcome(file, ticks=TICKS, chunk=chunk, sample_ticks=31, run_ahead=run_ahead)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("profile", ["kilobot", "foot-bot"])
def test_run_ahead_tick_by_tick_and_in_chunks_give_the_same(
    profile: str, seed: int, tmp_path: Path
) -> None:
    is_kilobot = profile == "kilobot"
    programs = KILOBOTS if is_kilobot else [ROOT / "firmware/aggregation", *KILOBOTS[:2]]
    arena_m = 0.6 * seed if is_kilobot else 3 * seed
    world = WORLD.format(
        seed=seed, profile=profile, arena_m=arena_m, floor="false" if is_kilobot else "true"
    )
    file = tmp_path / "world.toml"
    file.write_text(world + "".join(ROBOTS.format(program=program) for program in programs))
    first = outcome(file, run_ahead=True, chunk=TICKS)
    assert outcome(file, run_ahead=True, chunk=TICKS) == first
    assert outcome(file, run_ahead=False, chunk=TICKS) == first
    assert outcome(file, run_ahead=True, chunk=20) == first
    assert first[2]["frames_received"] > 10
