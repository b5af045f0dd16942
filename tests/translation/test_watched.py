"""Robots whose stores are told to a trail do the same as others, to the cycle."""

from pathlib import Path

import pytest

from .outcomes import outcome

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = [
    *sorted((Path(__file__).parent / "corpus").glob("*.c"))[:3],
    ROOT / "firmware/examples/orbit.c",
    ROOT / "tests/system/programs/tell.c",
]
WORLD = """
name = "watched"
seed = 3
duration_s = 60
[arena]
shape = "circle"
diameter_m = 0.4
[swarm]
profile = "kilobot"
cpu = "translated"
program = "{program}"
size = 8
"""


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_trail_changes_nothing(program: Path, tmp_path: Path) -> None:
    file = tmp_path / "watched.toml"
    file.write_text(WORLD.format(program=program))
    seen, unseen = (
        outcome(file, ticks=400, chunk=57, sample_ticks=7, variant=variant)
        for variant in ("watched", "plain")
    )
    assert seen == unseen
