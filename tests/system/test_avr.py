"""Robots that run from their .hex: experiment files, gdb, traces of pins, and what is refused."""

import itertools
import json
import re
import socket
import subprocess
from collections import Counter, defaultdict
from pathlib import Path

import pyarrow as pa
import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.programs.image.image import Image, build_image
from kilotwin.runs.reader import Run

from .conftest import KILOTWIN, Kilotwin
from .gdb_client import GdbClient

CYCLE_NS = 125
SLOT_CYCLES = 269

EXPERIMENT = """
name = "boards"
duration_s = {duration_s}

[arena]
diameter_m = 1.0

[swarm]
profile = "kilobot"

[medium]
kind = "kilobot"
loss = 0
loss_at_range = 0
clock_spread = 0

{robots}
"""

# Says its uid, counts its loops, and lights up in the colour of what it heard.
TALKER = """
#include <kilolib.h>
message_t message;
volatile uint8_t loops;
static message_t *say(void) { return &message; }
static void listen(message_t *heard, distance_measurement_t *distance) {
    (void)distance;
    set_color(heard->data[0] & 3 ? RGB(0, 3, 0) : RGB(3, 0, 0));
}
static void setup(void) {
    message.data[0] = (uint8_t)kilo_uid;
    message.crc = message_crc(&message);
}
void loop(void) {
    loops++;
    delay(20);
}
int main(void) {
    kilo_init();
    kilo_message_tx = say;
    kilo_message_rx = listen;
    kilo_start(setup, loop);
    return 0;
}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "talker.c").write_text(TALKER)
    return tmp_path


@pytest.fixture
def image(folder: Path) -> Image:
    """The talker, built for the robot."""
    return build_image(find_program("talker.c", folder))


def experiment(
    folder: Path, robots: str, name: str = "boards.toml", *, duration_s: float = 3
) -> Path:
    file = folder / name
    file.write_text(EXPERIMENT.format(robots=robots, duration_s=duration_s))
    return file


def address_of(name: str, image: Image) -> int:
    symbols = subprocess.run(
        ["avr-nm", str(image.elf)], capture_output=True, text=True, check=True
    ).stdout
    match = re.search(rf"^([0-9a-f]+) \w {name}$", symbols, re.MULTILINE)
    assert match, symbols
    return int(match[1], 16)


def test_a_hex_and_the_program_it_was_built_of_live_the_same_run(
    folder: Path, image: Image, kilotwin: Kilotwin
) -> None:
    hashes = set()
    kinds = (f'hex = "{image.hex}"', f'hex = "{image.elf}"', 'program = "talker.c"\ncpu = "avr"')
    files = [
        experiment(folder, f"[[robots]]\n{kind}\ncount = 4", f"{number}.toml")
        for number, kind in enumerate(kinds)
    ]
    # The experiment of a run folder runs again, too.
    files.append(folder / "run-0" / "experiment.toml")
    for number, file in enumerate(files):
        out = folder / f"run-{number}"
        run = json.loads(kilotwin("run", file, "--out", out, "--json").stdout)
        assert run["robots"] == 4
        assert run["robots_failed"] == []
        hashes.add(run["result_hash"])
    assert len(hashes) == 1


def test_hex_robots_and_native_ones_hear_each_other(
    folder: Path, image: Image, kilotwin: Kilotwin
) -> None:
    robots = f"""
[[robots]]
hex = "{image.hex}"
count = 1
poses = [[0, 0, 0]]

[[robots]]
program = "talker.c"
count = 1
poses = [[0.05, 0, 0]]
"""
    out = folder / "run"
    kilotwin("run", experiment(folder, robots), "--out", out, "--set", "record.sample_s=1")
    with pa.OSFile(str(out / "robots.arrows")) as file:
        last = pa.ipc.open_stream(file).read_all().to_pylist()[-2:]
    # The one hears uid 2, the other uid 1: both are odd or even enough to show green.
    assert [row["led"] for row in last] == [0b001100, 0b001100], last


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--gdb", "2"], r"robot 2 does not run on a board"),
        (["--vcd", "1", "--vcd", "9"], r"--vcd 9: there is no such robot; name one of 1 to 2"),
        (["--gdb", "1", "--gdb-port", "{taken}"], r"gdb cannot be served on port \d+: is it taken"),
    ],
)
def test_probes_of_what_is_not_there_are_refused(
    options: list[str], said: str, folder: Path, kilotwin: Kilotwin
) -> None:
    robots = """
[[robots]]
program = "talker.c"
cpu = "avr"
count = 1

[[robots]]
program = "talker.c"
count = 1
"""
    file = experiment(folder, robots)
    with socket.create_server(("127.0.0.1", 0)) as holder:
        words = [word.format(taken=holder.getsockname()[1]) for word in options]
        done = kilotwin("run", file, "--out", folder / "run", "--quiet", *words, expect=2)
    assert re.search(said, done.stderr), done.stderr
    assert "Traceback" not in done.stderr


def test_gdb_holds_a_robot_in_its_loop_reads_it_and_lets_it_go(
    folder: Path, image: Image, environment: dict[str, str]
) -> None:
    file = experiment(folder, f'[[robots]]\nhex = "{image.hex}"\ncount = 2', duration_s=0.5)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    loop, loops = address_of("loop", image), address_of("loops", image)
    words = ["run", file, "--out", folder / "run", "--json", "--gdb", 2, "--gdb-port", port]
    process = subprocess.Popen(
        [KILOTWIN, *map(str, words)],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        with GdbClient(port) as gdb:
            assert gdb.ask("?")[0] in "ST"
            assert gdb.ask(f"Z0,{loop:x},2") == "OK"
            for count in range(3):
                stopped = gdb.ask("c")
                assert stopped[:3] in ("S05", "T05"), stopped
                assert gdb.program_counter() == loop
                assert gdb.byte_at(loops) == count
            assert gdb.ask(f"z0,{loop:x},2") == "OK"
            gdb.ask("D")
        output, errors = process.communicate(timeout=240)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    run = json.loads(output)
    assert run["simulated_s"] >= 0.5
    assert "target remote" in errors


def changes_in(path: Path) -> dict[str, list[tuple[int, str]]]:
    """By signal, the times in ns at which it took a value, from a value change dump."""
    names: dict[str, str] = {}
    changes: dict[str, list[tuple[int, str]]] = defaultdict(list)
    at = 0
    for line in path.read_text().splitlines():
        if declared := re.match(r"\$var wire \d+ (\S) (\w+) \$end", line):
            names[declared[1]] = declared[2]
        elif line.startswith("#"):
            at = int(line[1:])
        elif line.startswith("b"):
            value, code = line[1:].split()
            changes[names[code]].append((at, value))
        elif line and line[0] in "01":
            changes[names[line[1:]]].append((at, line[0]))
    return changes


def test_a_trace_shows_the_slots_of_each_frame(
    folder: Path, image: Image, kilotwin: Kilotwin
) -> None:
    file = experiment(folder, f'[[robots]]\nhex = "{image.hex}"\ncount = 2', duration_s=2)
    out = folder / "run"
    kilotwin("run", file, "--out", out, "--vcd", "1", "--vcd", "2", "--set", "engine.step_ticks=2")
    assert {path.name for path in out.glob("*.vcd")} == {"robot_1.vcd", "robot_2.vcd"}
    signals = changes_in(out / "robot_1.vcd")
    rises = [at for at, value in signals["ir_out"] if value == "1"]
    gaps = [(later - at) // CYCLE_NS for at, later in itertools.pairwise(rises)]
    # Between the frames there are 16 ticks, within one whole slots.
    within = [gap for gap in gaps if gap < 20 * SLOT_CYCLES]
    assert len(gaps) - len(within) >= 2
    assert {gap % SLOT_CYCLES for gap in within} == {0}, within
    assert SLOT_CYCLES in within
    # The LED is on PB0.
    port_b = [at for at, value in signals["port_b"] if int(value, 2) & 1]
    assert set(rises) <= set(port_b)


GRID = """
name = "grid of both"
duration_s = 40

[grid]
columns = 4
rows = 4
buses = 2
hold_s = 0.5
rounds = 2

[[site]]
name = "black"
shape = "rectangle"
centre_m = [-0.05, 0.0]
width_m = 0.1
height_m = 0.2

[swarm]
profile = "kilobot"

[[robots]]
program = "firmware/aggregation"
cpu = "avr"
count = 2
poses = [[-0.06, 0.05, 0], [0.06, 0.05, 0]]

[[robots]]
program = "firmware/aggregation"
count = 2
poses = [[-0.06, -0.05, 0], [0.06, -0.05, 0]]

[controller]
beta = 1.5

[record]
sample_s = 0.5
"""


@pytest.fixture(scope="module")
def grid_run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Two robots on boards and two native ones on a grid."""
    folder = tmp_path_factory.mktemp("grid")
    (folder / "both.toml").write_text(GRID)
    subprocess.run(
        [KILOTWIN, "run", folder / "both.toml", "--out", folder / "run", "--quiet"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=True,
    )
    return Run.open(folder / "run")


def test_cells_tell_robots_on_boards_where_they_are(grid_run: Run) -> None:
    """Those that begin on the site show so, and those that begin beside it walk first."""
    rows = grid_run.robots().to_pylist()
    for robot, native in ((0, 2), (1, 3)):
        shown = [{row["state"] for row in rows if row["robot"] == who} for who in (robot, native)]
        assert "walking" in shown[0]
        assert "walking" in shown[1]
    entered = {row["robot"] for row in rows if row["state"] in ("entering", "resting")}
    assert {0, 2} <= entered


def test_what_robots_on_boards_report_reaches_the_host(grid_run: Run) -> None:
    reports = grid_run.tracking().to_pylist()
    by_robot = Counter(report["robot"] for report in reports)
    assert set(by_robot) == {0, 1, 2, 3}
    # One each 2 s; of these about half are heard.
    assert all(3 <= count <= 30 for count in by_robot.values()), by_robot
