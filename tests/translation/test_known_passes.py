"""Passes of loop() that are known to change nothing may be left out, with the ticks between them:
robots do the same to the cycle as if each pass were executed."""

from pathlib import Path
from typing import Any

import pytest

from .outcomes import outcome as engine_outcome

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent
CORPUS = sorted((HERE / "corpus").glob("*.c"))
EXAMPLES = ROOT / "firmware/examples"
EACH_TICK = sorted((HERE / "each_tick").glob("*.c"))
SLOW = sorted((ROOT / "experiments/bench/slow").glob("*.c"))
COUNTED = sorted((HERE / "counted").glob("*.c"))
TICKS = 600
WORLD = """
name = "known passes"
seed = {seed}
duration_s = 60

[arena]
shape = "circle"
diameter_m = {diameter_m}

[swarm]
profile = "{profile}"
floor = {floor}

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


def world(
    folder: Path, medium: str, programs: list[Path], count: int, profile: str = "kilobot"
) -> Path:
    file = folder / "world.toml"
    robots = "".join(ROBOTS.format(program=program, count=count) for program in programs)
    is_kilobot = profile == "kilobot"
    head = WORLD.format(
        seed=len(programs) + count,
        medium=medium,
        profile=profile,
        diameter_m=0.6 if is_kilobot else 3,
        floor="false" if is_kilobot else "true",
    )
    file.write_text(head + robots)
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


@pytest.mark.parametrize("medium", ["ideal", "kilobot"])
def test_programs_that_work_in_each_tick_do_the_same(medium: str, tmp_path: Path) -> None:
    """They note the tick that they have worked for; some have no message when they are asked."""
    file = world(tmp_path, medium, EACH_TICK, 6)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert outcome(file, recalls=True, chunk=20) == executed
    assert executed[2]["frames_received"] > 100


def test_a_pass_that_changes_a_local_for_the_next_one_is_executed(tmp_path: Path) -> None:
    """The program has not cleared it; most that is below the main loop's stack changes nothing,
    and so do variables that go back to what they were."""
    programs = [HERE / f"programs/{name}.c" for name in ("uncleared_local", "sums_anew")]
    file = world(tmp_path, "kilobot", programs, 2)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed


def test_passes_that_count_do_the_same(tmp_path: Path) -> None:
    """Their counters go over all bounds that the programs ask for; one reads its counters by a
    pointer too, and in one robots' messages change what is added."""
    file = world(tmp_path, "kilobot", COUNTED, 3)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert outcome(file, recalls=True, chunk=20) == executed
    assert executed[2]["frames_received"] > 100


def test_passes_that_come_back_in_turns_do_the_same(tmp_path: Path) -> None:
    """Two of them are one that changes nothing, or a colour is shown meanwhile; robots that talk
    interrupt them in all places."""
    programs = [path for path in SLOW if path.stem not in ("light_300", "waits_for_flash")]
    file = world(tmp_path, "kilobot", [*programs, EXAMPLES / "talk_and_listen.c"], 2)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert outcome(file, recalls=True, chunk=20) == executed
    assert executed[2]["frames_received"] > 20


def test_waits_for_the_serial_line_do_the_same(tmp_path: Path) -> None:
    """Runs and interrupts end in their midst; a second program talks to those that print."""
    programs = [HERE / "corpus/print_in_wait.c", EXAMPLES / "talk_and_listen.c"]
    file = world(tmp_path, "kilobot", programs, 2)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert outcome(file, recalls=True, chunk=4) == executed


def test_a_robot_in_an_interrupt_is_asked_again_before_others_run_past_it(tmp_path: Path) -> None:
    """It may yet send sooner than it had to when the run ended."""
    file = world(tmp_path, "kilobot", [HERE / "programs/slow_to_answer.c"], 24)
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert executed[2]["attempts_failed"] > 0


def test_the_paper_s_program_does_the_same(tmp_path: Path) -> None:
    """On a floor of sites, asked at each tick while it does not signal."""
    file = world(tmp_path, "ideal", [ROOT / "firmware/aggregation"], 12, "foot-bot")
    executed = outcome(file, recalls=False)
    assert outcome(file, recalls=True) == executed
    assert outcome(file, recalls=True, chunk=20) == executed


@pytest.mark.long
@pytest.mark.parametrize("program", CORPUS, ids=lambda path: path.stem)
def test_each_program_of_the_corpus_does_the_same(program: Path, tmp_path: Path) -> None:
    for medium in ("ideal", "kilobot"):
        file = world(tmp_path, medium, [program], 6)
        assert outcome(file, recalls=True) == outcome(file, recalls=False)
