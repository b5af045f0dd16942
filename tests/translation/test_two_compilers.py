"""A translation does the same whichever compiler made it, also one that is taken over while it
runs: tcc's code, with which a run begins, and gcc's, which comes later."""

import random
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import find_program
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.translate.translation import optimise, translated_guest

from .test_guests import MANY

ROOT = Path(__file__).resolve().parents[2]
WALK = ROOT / "firmware/examples/random_walk_counter.c"
# gcc takes seconds for each, and 11 for the paper's controllers.
SAMPLE = {"floats_each_pass", "random_walk_counter"}
PROGRAMS = [
    *(path for path in MANY if path.stem in SAMPLE),
    *(
        pytest.param(path, marks=pytest.mark.long)
        for path in [ROOT / "firmware/aggregation", *MANY]
        if path.stem not in SAMPLE
    ),
]
TICKS = 620
EXPERIMENT = """
name = "two compilers"
seed = {seed}
duration_s = 60
[arena]
shape = "circle"
diameter_m = 0.5
[swarm]
profile = "kilobot"
floor = false
[[robots]]
program = "{program}"
cpu = "translated"
count = 8
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing optimised is in it."""
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "cache"))


def quick(program: Path) -> Guest:
    guest = translated_guest(find_program([str(program)], ROOT, [], []))
    assert guest.optimised is not None
    return guest


def optimised(guest: Guest) -> Path:
    assert guest.optimised is not None
    optimise(guest.optimised)
    return guest.optimised


def run_of(
    folder: Path, program: Path, code: Path, steps: Iterator[int], faster: Path | None = None
) -> tuple[Any, ...]:
    """Hash, events and statistics, step by step; code is taken over behind the third."""
    file = folder / "world.toml"
    file.write_text(EXPERIMENT.format(seed=2, program=program))
    spec = engine_spec(Experiment.load(file), [str(code)], sample_ticks=7, black_box=None)
    simulation = _emulator.Simulation(spec)
    events: list[Any] = []
    for number, ticks in enumerate(steps):
        if number == 3 and faster is not None:
            _emulator.take_over(str(code), str(faster))
        simulation.advance(min(ticks, TICKS - simulation.tick))
        events += simulation.events()
        if simulation.tick >= TICKS:
            break
    return simulation.result_hash(), events, simulation.stats()


def at_random(seed: int) -> Iterator[int]:
    draw = random.Random(seed)
    while True:
        yield draw.choice([1, 4, 31, 100])


def whole() -> Iterator[int]:
    yield TICKS


@pytest.mark.skipif(not shutil.which("tcc"), reason="needs tcc")
@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_robots_do_the_same_by_the_code_of_both_compilers(program: Path, tmp_path: Path) -> None:
    guest = quick(program)
    first = run_of(tmp_path, program, guest.file, whole())
    assert run_of(tmp_path, program, optimised(guest), whole()) == first


def test_a_run_whose_code_is_taken_over_between_two_steps_is_the_same_run(tmp_path: Path) -> None:
    guest = quick(WALK)
    first = run_of(tmp_path, WALK, guest.file, whole())
    assert first[2]["frames_received"] > 100
    faster = optimised(guest)
    for seed in range(6):
        loaded = tmp_path / f"{seed}.so"
        shutil.copy(guest.file, loaded)
        assert run_of(tmp_path, WALK, loaded, at_random(seed), faster) == first
        assert run_of(tmp_path, WALK, loaded, at_random(seed)) == first  # by the faster one


def test_code_of_another_program_is_not_taken_over(tmp_path: Path) -> None:
    guest = quick(WALK)
    other = quick(WALK.with_name("orbit.c"))
    run_of(tmp_path, WALK, guest.file, whole())
    with pytest.raises(_emulator.EngineError, match="is no translation of random_walk_counter"):
        _emulator.take_over(str(guest.file), str(other.file))
    with pytest.raises(_emulator.EngineError, match="is no translation that is loaded"):
        _emulator.take_over(str(tmp_path / "none.so"), str(guest.file))


def test_without_tcc_the_compiler_of_guests_makes_the_first_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = WALK.with_name("blink.c")
    by_tcc = run_of(tmp_path, program, quick(program).file, whole())
    tools = tmp_path / "tools"
    tools.mkdir()
    for folder in ("/usr/bin", "/usr/local/bin"):
        for tool in Path(folder).iterdir():
            if tool.name != "tcc" and tool.stat().st_mode & stat.S_IXUSR:
                (tools / tool.name).unlink(missing_ok=True)
                (tools / tool.name).symlink_to(tool)
    monkeypatch.setenv("PATH", str(tools))
    monkeypatch.setenv("KILOTWIN_CACHE", str(tmp_path / "other"))
    assert shutil.which("tcc") is None
    assert run_of(tmp_path, program, quick(program).file, whole()) == by_tcc


def test_on_request_nothing_begins_before_its_faster_code_is_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    program = find_program([str(WALK.with_name("blink.c"))], ROOT, [], [])
    monkeypatch.setenv("KILOTWIN_OPTIMISED", "1")
    guest = translated_guest(program)
    assert guest.optimised is None
    monkeypatch.delenv("KILOTWIN_OPTIMISED")
    assert translated_guest(program).file == guest.file
