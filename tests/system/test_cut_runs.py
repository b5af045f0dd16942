"""Where a call of the engine ends is by the wall clock, and nothing in a result may depend on it:
runs that are cut up at random leave the same result hash and the same files as a whole one."""

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from kilotwin import World, _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import engine_spec
from kilotwin.experiment.text import parse_setting
from kilotwin.programs.group import build_all, symbols_of
from kilotwin.runs.writer import RunWriter
from kilotwin.session.job import Job
from kilotwin.session.loop import NEVER, Attention
from kilotwin.session.trial import Trial
from kilotwin.session.worker import _make_folder
from kilotwin.studies.scenario.looks import Looks

# Keys of a summary that tell of the machine: its time and memory, and where the run lies.
MACHINE = re.compile("(cpu|wall|startup)_s|peak_bytes|robot_s_per_cpu_s|run_folder|grid")

# Walks, talks, listens, prints; every third robot's program fails at a time of its own.
TALKER = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>
uint16_t heard;
static uint8_t orders;
static uint32_t last;
static message_t out;
static message_t *give(void) { return heard % 4 == 3 ? 0 : &out; }
static void take(message_t *message, distance_measurement_t *distance) {
    heard++;
    if (message->type == 7) orders++;
    if (estimate_distance(distance) < 60) set_color(RGB(3, 0, 0));
}
static void setup(void) {
    debug_init();
    rand_seed(rand_hard());
    out.type = 1;
    out.crc = message_crc(&out);
}
static void loop(void) {
    if (kilo_ticks - last < 20u + kilo_uid) return;
    last = kilo_ticks;
    const uint8_t dice = rand_soft();
    printf("%u %u %d\\n", heard, orders, get_ambientlight());
    set_color(RGB(0, dice & 3, orders & 3));
    spinup_motors();
    set_motors(dice % 3 ? kilo_straight_left : 0, dice % 3 != 1 ? kilo_straight_right : 0);
    if (dice % 5 == 0) delay(120);
    if (kilo_uid % 3 == 0 && kilo_ticks > 120) ((void (*)(void))0x7ffc)();
}
int main(void) {
    kilo_message_tx = give;
    kilo_message_rx = take;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""
# A module that prints, shows what it was told and hands reports on.
MODULE = """\
#include "debug.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"
static uint8_t rounds;
static void hear(IR_message_t *m, cell_num_t cell, distance_measurement_t *d, uint8_t crc_error) {
    (void)d;
    if (crc_error || m->type != TRACKING) return;
    CAN_message_t *record = next_CAN_message();
    if (record != NULL) serialize_tracking_message(record, cell, (tracking_user_data_t *)m->data);
}
static void setup(void) { cprints("ready"); }
static void loop(void) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) set_LED(cell, (color_t)(rounds >> 4 & 7));
    if (rounds++ % 32 == 0) cprinti(rounds);
    _delay_ms(20);
}
int main(void) {
    module_init();
    module_IR_message_rx = hear;
    module_start(setup, loop);
    return 0;
}
"""
# The fifth sample is refused.
METRICS = """\
import numpy as np
seen = []
def width(sample):
    seen.append(np.ptp(sample.positions_m[:, 0]))
    return float(seen[-1]) if len(seen) != 5 else "wide"
"""
ENVIRONMENT = """\
class Echo:
    def __init__(self, arena, settings):
        self.arena, self.pictures = arena, 0
        arena.note("begins")
    def step(self, seen, send):
        self.pictures += 1
        for robot in seen.robots:
            if robot.x_m * robot.y_m > 0:
                send(robot.uid, int(1000 * abs(robot.x_m)), 3)
        if self.pictures % 7 == 0:
            send.to_all([self.pictures % 256], 7)
            self.arena.note(f"{self.pictures} pictures, {len(seen.robots)} robots")
"""
EXPERIMENT = """
name = "cut up"
seed = 5
duration_s = {duration_s}
[swarm]
profile = "kilobot"
[[robots]]
program = "talker.c"
cpu = "{cpu}"
count = {count}
[battery]
hours = 0.02
[states]
far = "bright-red"
[record]
sample_s = {sample_s}
robots_s = {robots_s}
also = ["motors", "battery", "messages"{also}]
prints_per_robot = 50
prints = {prints}
[[expect]]
that = "failed == 0"
throughout_s = {duration_s}
[[expect]]
that = "failed >= 2"
within_s = {duration_s}
[metric.far]
builtin = "share"
state = "far"
[metric.first_far]
builtin = "first_time"
metric = "far"
at_least = 0.1
[metric.spread]
builtin = "spread"
[metric.been]
builtin = "coverage"
cell_m = 0.05
"""
# These make the engine stand still at samples, which the plain ones do without.
FUNCTION = """
[metric.width]
function = "metrics.py:width"
"""
MOMENTS = """
[metric.rate]
builtin = "message_rate"
[metric.alive]
builtin = "survival"
"""
VARIABLE = """
[metric.heard]
variable = "heard"
per_robot = true
"""
ARENA = """
[arena]
diameter_m = 0.6
[[site]]
name = "middle"
centre_m = [0.0, 0.0]
diameter_m = 0.2
"""
COMMANDS = """
[[command]]
at_s = 0
send = "run"
[[command]]
at_s = 2.02
send = "user"
type = 7
data = [1]
centre_m = [0.1, 0.0]
within_m = 0.2
repeat_s = 0.5
[[command]]
at_s = 3.5
send = "pause"
robot = 1
[[command]]
at_s = 5.11
send = "run"
"""
OBJECT = """
[[object]]
shape = "circle"
diameter_m = 0.06
mass_kg = 0.01
pose = [0.0, 0.0, 0.0]
[object.beacon]
type = 7
period_s = 0.3
[metric.way]
builtin = "object_distance"
goal_m = [0.2, 0.0]
"""
STEPS = """
[light]
ambient = 200
[[light.source]]
at_m = [0.1, 0.1]
peak = 500
half_m = 0.2
[[step]]
at_s = 0
robot = 1
pose = [0.0, 0.25, 1.0]
[[step]]
at_s = 2.6
ambient = 500
[[step]]
at_s = 4.03
robot = 2
pose = [0.2, -0.1, 3.0]
[[step]]
at_s = 4.5
lamp = 0
peak = 0
"""
ECHO = """
[environment]
program = "echo.py:Echo"
"""
GRID = """
[grid]
columns = {side}
rows = {side}
buses = 2
wall_cells = 0
program = "module.c"
cpu = "{modules}"
hold_s = 0.2
rounds = 1
[[site]]
name = "black"
shape = "rectangle"
centre_m = [-0.05, 0.0]
width_m = 0.1
height_m = 0.2
[[site]]
name = "white"
shape = "rectangle"
centre_m = [0.05, 0.0]
width_m = 0.1
height_m = 0.2
[[grid.change]]
at_s = 3.3
swap = ["black", "white"]
[faults]
error_share = 0.01
[[faults.module]]
at_s = 2
kind = "reset"
module = [1, 1]
[[faults.host]]
from_s = 4.1
until_s = 4.9
"""


@dataclass(frozen=True)
class Case:
    """A world: what stands in its file besides EXPERIMENT, and how it is filled in."""

    more: str
    duration_s: float = 12.0
    count: int = 12
    sample_s: float = 0.5
    robots_s: float = 1.0
    also: str = ""
    prints: int = 10_000
    modules: str = "native"
    side: int = 4

    def text(self, cpu: str) -> str:
        """The experiment file. What runs by machine code has no variables."""
        keys = {**vars(self), "cpu": cpu, "more": None}
        text = (EXPERIMENT + self.more).format(**keys)
        return text + VARIABLE if cpu == "native" and MOMENTS in text else text


PLAIN = ARENA + COMMANDS + OBJECT
CASES = {
    "plain": Case(PLAIN, prints=60),
    "moments": Case(PLAIN + MOMENTS),
    "samples below the step": Case(PLAIN, sample_s=0.1, robots_s=0.3),
    "samples below the step, moments": Case(PLAIN + MOMENTS, sample_s=0.04, robots_s=0.04),
    "samples that are no multiple of the step": Case(PLAIN + MOMENTS, sample_s=0.16, robots_s=0.32),
    "light and steps": Case(ARENA + STEPS + MOMENTS),
    "function": Case(PLAIN + FUNCTION),
    "environment": Case(ARENA + ECHO + MOMENTS),
    "ideal": Case(PLAIN + '[medium]\nkind = "ideal"\n'),
    "grid": Case(GRID, also=', "modules"'),
    "grid, moments": Case(GRID + MOMENTS + FUNCTION),
}
CHIPS = {
    "plain": Case(PLAIN, duration_s=6, count=4),
    "samples below the step": Case(PLAIN, duration_s=6, count=4, sample_s=0.1, robots_s=0.1),
    "light and steps": Case(ARENA + STEPS + MOMENTS, duration_s=6, count=4),
    "environment": Case(ARENA + ECHO, duration_s=6, count=4),
    "grid of chips": Case(GRID, duration_s=6, count=2, side=2, modules="avr", also=', "modules"'),
}
WORLDS = [
    pytest.param(cpu, case, id=f"{cpu}, {name}")
    for cpu, cases in (("native", CASES), ("translated", CASES), ("avr", CHIPS))
    for name, case in cases.items()
]


class Cuts(Attention):
    """Comes round after `most` ticks, whatever they took."""

    def __init__(self, most: Callable[[], int]) -> None:
        super().__init__(0.0)
        self._most = most

    def step(self, now: int) -> None:
        if now >= self._due:
            self._due = now + self._most()


class CutTrial(Trial[Any]):
    """A trial that asks the engine for `most` ticks at a time at most."""

    def __init__(self, job: Job, make: Callable[[], Any], most: Callable[[], int]) -> None:
        self._most = most
        super().__init__(job, lambda _: None, make)

    def _make_attention(self) -> Attention:
        return Cuts(self._most)


@pytest.fixture
def load(tmp_path: Path, guest_cache: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The experiment of a text."""
    monkeypatch.setenv("KILOTWIN_CACHE", str(guest_cache))
    (tmp_path / "talker.c").write_text(TALKER)
    (tmp_path / "module.c").write_text(MODULE)
    (tmp_path / "metrics.py").write_text(METRICS)
    (tmp_path / "echo.py").write_text(ENVIRONMENT)

    def load(text: str) -> Experiment:
        (tmp_path / "cut.toml").write_text(text)
        return Experiment.load(tmp_path / "cut.toml")

    return load


def whole() -> int:
    return NEVER


def cuts(seed: int) -> Callable[[], int]:
    """Random lengths: many short ones, some long ones."""
    chance = random.Random(seed)
    return lambda: chance.choice((1, 1, chance.randint(1, 12), chance.randint(1, 80)))


def run(experiment: Experiment, folder: Path, most: Callable[[], int]) -> dict[str, Any]:
    """Runs it; what it leaves, by name."""
    guests, modules = build_all(experiment)
    job = Job(
        experiment,
        [str(guest.file) for guest in guests],
        folder,
        {},
        None,
        "" if modules is None else str(modules.file),
        symbols=symbols_of(guests, modules),
    )
    trial = CutTrial(job, lambda: _make_folder(job), most)
    assert trial.run(lambda: False)
    summary = trial.summary(interrupted=False)
    trial.close()
    assert isinstance(trial.writer, RunWriter)
    trial.writer.close(clean=True)
    looks = CutTrial(job, lambda: Looks(experiment), most)
    looks.run(lambda: False)
    looks.close()
    return {
        "looks": looks.writer.looks(),
        **{key: value for key, value in summary.items() if not MACHINE.fullmatch(key)},
        **dict(contents(folder)),
    }


def contents(folder: Path) -> Iterator[tuple[str, Any]]:
    """All recorded files; of streams the rows, since batches are as they come."""
    for file in sorted(folder.parent.rglob("*")):
        name = file.name
        if file.suffix == ".arrows":
            with pa.ipc.open_stream(file) as stream:
                yield name, repr(stream.read_all().to_pylist())  # nan is like nan
        elif file.is_file() and name != "manifest.json":
            yield name, file.read_bytes()


@pytest.mark.parametrize(("cpu", "case"), WORLDS)
def test_a_run_that_is_cut_up_leaves_what_the_whole_one_leaves(
    cpu: str, case: Case, load: Any, tmp_path: Path
) -> None:
    experiment = load(case.text(cpu))
    expected = run(experiment, tmp_path / "whole" / "run", whole)
    for seed in (1, 2):
        got = run(experiment, tmp_path / f"cut-{seed}" / "run", cuts(seed))
        unlike = [part for part in expected.keys() | got.keys() if got[part] != expected[part]]
        assert not unlike, seed


@pytest.mark.parametrize("name", ["plain", "grid", "environment", "ideal"])
def test_a_world_goes_the_same_way_however_it_is_stepped_and_looked_at(
    name: str, load: Any, tmp_path: Path
) -> None:
    load(CASES[name].text("native"))
    most = cuts(3)

    def seen(looks: bool) -> list[Any]:
        with World(tmp_path / "cut.toml") as world:
            has_grid = name == "grid"
            while world.tick < 300:
                world.run_ticks(min(most() if looks else NEVER, 300 - world.tick))
                if looks:
                    _ = world.events, world.poses, world.result_hash, world.metrics
                    _ = has_grid and (world.grid_events, world.cells, world.modules)
            return [
                world.result_hash,
                world.stats,
                world.events,
                world.sent,
                *((world.grid_events, world.reports, world.cells.tolist()) if has_grid else ()),
            ]

    assert seen(looks=True) == seen(looks=False)


def test_a_metric_that_is_measured_changes_no_result(load: Any, tmp_path: Path) -> None:
    """Also beside a [[step]] at 0, the moment of the first sample."""
    results = [
        run(load(Case(ARENA + STEPS + more).text("native")), tmp_path / name / "run", whole)
        for name, more in (("plain", ""), ("measured", MOMENTS))
    ]
    assert results[0]["result_hash"] == results[1]["result_hash"]


def test_a_thousand_translated_robots_end_in_the_same_poses_however_the_run_is_cut_up() -> None:
    """Light falls on some that are sending: they are told of it when they have been run on."""
    file = Path(__file__).parents[2] / "experiments/porting/translated.toml"
    experiment = Experiment.load(file, [parse_setting("seed=3")])
    guests, _ = build_all(experiment)
    spec = engine_spec(
        experiment, [str(guest.file) for guest in guests], sample_ticks=10_000, black_box=None
    )
    ticks = 7000

    def end(cuts: list[int]) -> tuple[str, float]:
        simulation = _emulator.Simulation(spec)
        for tick in [*cuts, ticks]:
            simulation.advance(tick - simulation.tick)
        return simulation.final_hash(), simulation.stats()["frames_deaf"]

    whole, deaf = end([])
    assert deaf > 10
    chance = random.Random(1)
    for cuts in ([6308], *(sorted(chance.sample(range(1, ticks), n)) for n in (3, 300))):
        assert end(cuts)[0] == whole, cuts
