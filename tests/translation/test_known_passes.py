"""Passes of loop() that are known to change nothing may be left out, with the ticks between them:
robots do the same to the cycle as if each pass were executed."""

from pathlib import Path
from typing import Any

import pytest

from .outcomes import outcome as engine_outcome

ROOT = Path(__file__).resolve().parents[2]
CORPUS = sorted((Path(__file__).parent / "corpus").glob("*.c"))
EXAMPLES = ROOT / "firmware/examples"
TICKS = 1200
WORLD = """
name = "known passes"
seed = {seed}
duration_s = 60

[arena]
shape = "circle"
diameter_m = 0.6

[swarm]
profile = "kilobot"
floor = false

[medium]
kind = "{medium}"
"""
ROBOTS = """
[[robots]]
program = "{program}"
cpu = "translated"
count = {count}
"""


def outcome(file: Path, *, recalls: bool, chunk: int = TICKS) -> tuple[Any, ...]:
    return engine_outcome(file, ticks=TICKS, chunk=chunk, sample_ticks=7, recalls_passes=recalls)


def world(folder: Path, medium: str, programs: list[Path], count: int) -> Path:
    file = folder / "world.toml"
    robots = "".join(ROBOTS.format(program=program, count=count) for program in programs)
    file.write_text(WORLD.format(seed=len(programs) + count, medium=medium) + robots)
    return file


@pytest.mark.parametrize("medium", ["ideal", "kilobot"])
def test_robots_do_the_same_with_and_without_known_passes(medium: str, tmp_path: Path) -> None:
    """In a crowd, where frames overlap and interrupts fall into all places of a pass."""
    programs = [EXAMPLES / f"{name}.c" for name in ("random_walk_counter", "talk_and_listen")]
    programs += [path for path in CORPUS if path.stem in ("passes_blink", "two_producers")]
    file = world(tmp_path, medium, programs, 4)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert outcome(file, recalls=True, chunk=20) == executed
    assert executed[2]["frames_received"] > 100


@pytest.mark.long
@pytest.mark.parametrize("program", CORPUS, ids=lambda path: path.stem)
def test_each_program_of_the_corpus_does_the_same(program: Path, tmp_path: Path) -> None:
    for medium in ("ideal", "kilobot"):
        file = world(tmp_path, medium, [program], 6)
        assert outcome(file, recalls=True) == outcome(file, recalls=False)
