"""`kilotwin debug`: a run is repeated, a robot held in it, line by line, forwards and backwards."""

import io
import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from pyarrow import csv
from tests.processes import alive

from kilotwin import World, _emulator
from kilotwin.commands.gdb_programs import find_gdb
from kilotwin.experiment.text import parse_setting
from kilotwin.programs.guest_symbols import GuestSymbols
from kilotwin.programs.translate.translation import translated_guest
from kilotwin.session.debug import travel as travel_module
from kilotwin.session.debug.held_world import NOTHING
from kilotwin.session.debug.repeated_run import Repeated, travel_in
from kilotwin.session.debug.travel import Place, Travel, Wanted

from .conftest import KILOTWIN, ROOT, WALKER, Kilotwin, RunJson, block
from .gdb_client import GdbClient

EXPERIMENT = ROOT / "experiments/debugging/neighbours.toml"
LINE_OF_BUG = "met.uids[met_count++] = uid;"
ALARMED, AT_S = 11, 160.0  # its index: its uid is 12


@pytest.fixture(scope="module")
def recorded(kilotwin: Kilotwin, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of the experiment, in which a robot raises the alarm."""
    folder = tmp_path_factory.mktemp("recorded") / "alarm"
    kilotwin("run", EXPERIMENT, "--out", folder, "--quiet")
    return folder


@contextmanager
def travelling(target: Path, robots: list[int], at_s: float, *sets: str) -> Iterator[Travel]:
    repeated = Repeated.of(target, [parse_setting(text) for text in sets])
    with travel_in(repeated, robots) as (travel, symbols):
        travel.start(robots, at_s)
        travel.symbols = symbols  # type: ignore[attr-defined]
        yield travel


def address_of(travel: Travel, name: str) -> int:
    symbols: dict[int, Path] = travel.symbols  # type: ignore[attr-defined]
    return GuestSymbols(symbols[travel.robots[0]]).number(name).offset


def test_travelling_back_and_forth_leaves_the_result_as_it_was(recorded: Path) -> None:
    repeated = Repeated.of(recorded, [])
    with travelling(recorded, [ALARMED], AT_S) as travel:
        alarm = Wanted(watches=((address_of(travel, "met.alarm"), 1),))
        here = travel.now
        assert here is not None
        raised = travel.go_back(alarm)
        for _ in range(3):
            travel.go_on(alarm, step=True)
        travel.go_back(alarm, step=True)
        assert travel.go_to(here.place).place == here.place
        assert travel.go_back(alarm).place == raised.place
        assert travel.go_on(Wanted()).why == "end"
        assert travel.result_hash() == repeated.result_hash
        assert travel.go_back(alarm).place == raised.place
        assert travel.go_on(Wanted()).why == "end"
        assert travel.result_hash() == repeated.result_hash


@pytest.mark.parametrize("wanted", [{"step": True}, {"message": True}, {"breakpoints": [0x100]}])
def test_a_run_that_was_stepped_through_has_the_result_of_one_that_was_not(
    wanted: dict[str, object],
) -> None:
    program = str(ROOT / "experiments/debugging/neighbours.c")
    keys: dict[str, Any] = {"program": program, "count": 5, "arena": (0.3, 0.3), "seed": 1}
    results = []
    for is_held in (False, True):
        with World(**keys, cpu="translated") as world:
            simulation = world._simulation
            world.run_ticks(40)
            if is_held:
                (group,) = world._experiment.groups
                codes = [
                    translated_guest(group.program, variant=v) for v in ("debugged", "watched")
                ]
                files = [str(code.file) for code in codes]
                _emulator.hold_by(simulation.program(0), "neighbours", *files)
                simulation.hold(range(5), lambda _: None)
                simulation.want({**NOTHING, **wanted, "only_notes": True})
            world.run_ticks(80)
            results.append(simulation.result_hash())
            assert not is_held or simulation.found() is not None or "breakpoints" in wanted
    assert results[0] == results[1]


def test_worlds_fork_beside_a_library_that_has_files_of_its_own(recorded: Path) -> None:
    # Arrow keeps a pipe from its first reading of a table on, and makes it anew at each fork.
    csv.read_csv(io.BytesIO(b"a,b\n1,2\n"))
    with travelling(recorded, [3], 20.0) as travel:
        forth = travel.go_on(Wanted(), step=True).place
        travel.go_on(Wanted(), step=True)
        assert travel.go_back(Wanted(), step=True).place == forth


def test_a_step_back_is_the_instruction_before(recorded: Path) -> None:
    with travelling(recorded, [3], 20.0) as travel:
        forth = [travel.go_on(Wanted(), step=True).place for _ in range(20)]
        back = [travel.go_back(Wanted(), step=True).place for _ in range(19)]
    assert back == forth[-2::-1]
    assert all(later.cycle > place.cycle for place, later in pairwise(forth))


def test_what_was_last_is_found_from_the_present_and_from_the_end_alike(recorded: Path) -> None:
    with travelling(recorded, [ALARMED], 165.0) as travel:
        count = Wanted(watches=((address_of(travel, "met_count"), 1),))
        changes = []
        while (stop := travel.go_back(count)).why == "watch":
            changes.append(stop.place)
        assert stop.why == "begin"
        forth = []
        while (stop := travel.go_on(count)).why == "watch":
            forth.append(stop.place)
    assert len(changes) == len(forth) == 7
    for before, after in zip(reversed(changes), forth, strict=True):
        # Forwards it stands behind the instruction that has made the change.
        assert 0 < after.cycle - before.cycle < 10


WRITER = """\
#include <kilolib.h>

static volatile uint8_t busy, once, same, never;
static volatile uint16_t passes, last, numbers[4];
static volatile float sum;
static message_t said = {.type = NORMAL};

static uint8_t depth(volatile uint8_t *local, uint8_t left) {
    volatile uint8_t own = *local + left;
    return left ? depth(&own, left - 1) : own;
}

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    numbers[message->data[0] & 3]++;
}

static message_t *report(void) { return &said; }

static void setup(void) {
    said.crc = message_crc(&said);
    rand_seed(kilo_uid);
}

static void loop(void) {
    busy = 1;  // each pass changes it, and leaves it as it was
#ifdef COUNTS
    passes++;  // without it passes are known ones, which are left out over ticks
#endif
    same = 5;
    if (kilo_ticks > last + 640) {
        last = kilo_ticks;
        sum += 0.5f;
        once = rand_soft();
        said.data[0] = depth(&once, 9);
        said.crc = message_crc(&said);
    }
    if (kilo_ticks == 500) never = never ? 2 : 1;
    busy = 0;
}

int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_message_tx = report;
    kilo_start(setup, loop);
    return 0;
}
"""
WRITERS = """\
duration_s = 400
arena = {shape = "circle", diameter_m = 0.3}
robots = [{program = "writer.c", cpu = "translated", count = 3, define = [DEFINED]}]
[swarm]
profile = "kilobot"
"""


@pytest.fixture
def many_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of runs that take no time."""
    monkeypatch.setattr(travel_module, "FAR_S", 0.0)
    monkeypatch.setattr(travel_module, "NEAR_S", 0.0)


@pytest.mark.usefixtures("many_checkpoints")
@pytest.mark.parametrize("defined", ["", '"COUNTS"'])
def test_the_last_write_is_the_same_with_and_without_what_was_noted(
    tmp_path: Path, defined: str
) -> None:
    (tmp_path / "writer.c").write_text(WRITER)
    file = tmp_path / "writers.toml"
    file.write_text(WRITERS.replace("DEFINED", defined))
    looked = []
    with travelling(file, [1], 390.0, "seed=1") as travel:
        symbols = GuestSymbols(travel.symbols[1])  # type: ignore[attr-defined]
        names = ("busy", "once", "same", "never", "passes", "last", "numbers[2]", "sum")
        places = [symbols.number(name) for name in names]
        watches = [(place.offset, place.length) for place in places]
        watches += [(watches[4][0] + 1, 1), (0x8D0, 4), (0x850, 8), (0x8F8, 2), (0x300, 16)]
        here = travel.now
        assert here is not None
        plain = travel._may_be_in

        def counted(wanted: Wanted, begin: int, end: int) -> bool:
            looked.append(plain(wanted, begin, end))
            return looked[-1]

        travel._may_be_in = counted  # type: ignore[method-assign]
        found = []
        for noted in (True, False):
            if not noted:
                travel._written.robot = -1  # nothing is known
            for watch in watches:
                for at in (here.place, Place(1, 1_000_000_000)):
                    travel.go_to(at)
                    stop = travel.go_back(Wanted(watches=(watch,)))
                    found.append((watch, stop.place, stop.why))
    assert found[: len(found) // 2] == found[len(found) // 2 :]
    assert {why for _, _, why in found} == {"watch", "begin"}
    assert looked[: len(looked) // 2].count(False) > len(looked) // 6


def test_any_robot_is_the_one_that_does_it_first(recorded: Path) -> None:
    with travelling(recorded, list(range(12)), 156.8) as travel:
        alarm = Wanted(watches=((address_of(travel, "met.alarm"), 1),))
        stop = travel.go_on(alarm)
        assert (stop.why, stop.place.robot) == ("watch", ALARMED)
        back = travel.go_back(alarm)
        assert back.place.robot == ALARMED
        assert 0 < stop.place.cycle - back.place.cycle < 10


def test_a_message_stops_it_where_the_callback_begins(recorded: Path) -> None:
    with travelling(recorded, [ALARMED], 100.0) as travel:
        symbols: dict[int, Path] = travel.symbols  # type: ignore[attr-defined]
        begin = symbol(symbols[ALARMED], "on_message")
        stop = travel.go_on(Wanted(message=True))
        assert stop.why == "message"
        assert travel.chip(ALARMED).pc == begin
        assert travel.go_back(Wanted(message=True)).place.cycle < stop.place.cycle
        assert travel.chip(ALARMED).pc == begin


MANY = (
    "experiments/porting/translated.toml",
    ("robots.0.count=10000", "arena.width_m=18", "arena.height_m=18"),
    3.0,
)
GRID = ("experiments/kilogrid/stripes-n50.toml", ("swarm.size=20", "swarm.cpu=translated"), 6.0)


@pytest.mark.parametrize("world", [MANY, GRID], ids=["10,000 robots", "a grid"])
def test_worlds_of_all_kinds_go_on_from_a_checkpoint_to_the_same_result(
    run_json: RunJson, world: tuple[str, tuple[str, ...], float]
) -> None:
    target, sets, duration_s = world
    sets = (*sets, f"duration_s={duration_s}")
    plain = run_json(target, *sets)["result_hash"]
    with travelling(ROOT / target, [7], duration_s / 2, "seed=1", *sets) as travel:
        here = travel.now
        assert here is not None
        assert travel.go_on(Wanted()).why == "end"
        assert travel.result_hash() == plain
        assert travel.go_to(here.place).place == here.place
        assert travel.go_on(Wanted()).why == "end"
        assert travel.result_hash() == plain


CHIPS = """\
duration_s = 3
arena = {shape = "circle", diameter_m = 0.4}
swarm = {profile = "kilobot"}
robots = [
  {program = "walker.c", cpu = "avr", count = 2},
  {program = "walker.c", cpu = "translated", count = 2},
]
"""


@pytest.mark.usefixtures("many_checkpoints")
def test_each_world_is_confined_as_a_run_is(recorded: Path) -> None:
    with travelling(recorded, [3], 20.0) as travel:
        travel.go_back(Wanted(), step=True)
        worlds = [one.process for one in travel.checkpoints]
        said = [Path(f"/proc/{world}/status").read_text() for world in worlds]
        kept = travel.bytes_kept()
    assert len(said) > 3
    assert all("NoNewPrivs:\t1" in text and "Seccomp:\t2" in text for text in said)
    assert kept > 0
    assert not any(map(alive, worlds))


def test_chips_go_on_from_a_checkpoint_beside_robots_that_are_held(
    run_json: RunJson, tmp_path: Path
) -> None:
    (tmp_path / "walker.c").write_text(WALKER)
    file = tmp_path / "chips.toml"
    file.write_text(CHIPS)
    plain = run_json(file)["result_hash"]
    with travelling(file, [3], 2.0, "seed=1") as travel:
        assert travel.now is not None
        for place in (travel.now.place, Place(3, 1_000_000)):
            travel.go_to(place)
            travel.go_on(Wanted())
            assert travel.result_hash() == plain


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--robot", "13"], "--robot 13: there is no such robot; name one of 1 to 12"),
        (["--at", "171"], "--at 171: the run has 0 to 170 s"),
        (["--set", "robots.0.cpu=native"], "runs natively, .*toml --set robots.0.cpu=translated"),
        (["--set", "robots.0.cpu=avr"], "simulated ATmega328P.*kilotwin run .*toml --gdb 1"),
    ],
)
def test_what_cannot_be_held_is_said_before_anything_runs(
    kilotwin: Kilotwin, words: list[str], complaint: str
) -> None:
    done = kilotwin("debug", EXPERIMENT, *words, "--port", "4999", expect=2)
    assert re.search(complaint, done.stderr)


def test_a_run_with_hosts_outside_is_refused(
    kilotwin: Kilotwin, recorded: Path, tmp_path: Path
) -> None:
    served = tmp_path / "served"
    shutil.copytree(recorded, served)
    manifest = json.loads((served / "manifest.json").read_text())
    manifest["command_line"] = ["kilotwin", "serve", "world"]
    (served / "manifest.json").write_text(json.dumps(manifest))
    done = kilotwin("debug", served, "--port", "4999", expect=2)
    assert "hosts outside had a hand in it; no repeating that" in done.stderr
    done = kilotwin("debug", recorded, "--seed", "3", "--port", "4999", expect=2)
    assert "a recorded run is repeated as it was" in done.stderr


def test_gdb_s_protocol_reads_sets_goes_and_writes_nothing(recorded: Path) -> None:
    with (
        subprocess.Popen(
            [KILOTWIN, "debug", recorded, "--robot", "12", "--at", "100", "--port", "4998"],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as server,
        GdbClient(4998) as gdb,
    ):
        assert "ReverseContinue+" in gdb.ask("qSupported:swbreak+")
        assert gdb.ask("?") == "T05"
        registers = bytes.fromhex(gdb.ask("g"))
        assert len(registers) == 39
        assert bytes.fromhex(gdb.ask("p22")) == registers[35:]
        assert gdb.ask("m800100,1") == gdb.ask("m800100,1")
        assert len(gdb.ask("m0,4")) == 8
        for written in ("G00", "P0=00", "M800100,1:00", "m820000,1", "Z2,10,1", "Zx"):
            assert gdb.ask(written) == "E01"
        for unknown in ("Z3,800100,1", "qXfer:features:read", "bx", "_"):
            assert gdb.ask(unknown) == ""
        for fixed, answer in {"qC": "QC1", "Hg0": "OK", "vCont?": "vCont;c;C;s;S"}.items():
            assert gdb.ask(fixed) == answer
        here = gdb.ask("p22")
        assert gdb.ask("vCont;s:1") == "T05"
        assert gdb.ask("bs") == "T05"
        assert gdb.ask("p22") == here
        assert gdb.ask("bc") == "T05replaylog:begin;"
        assert monitor(gdb, "robot 99").startswith("robot 99 cannot be held")
        assert "robot 3 at 50" in monitor(gdb, "at 50") + monitor(gdb, "robot 3")
        assert "monitor state NAME" in monitor(gdb, "what")
        assert "there is no state 'blue'" in monitor(gdb, "state blue")
        assert "the run has 0 to 170 s" in monitor(gdb, "at 1e9")
        assert gdb.ask("D") == "OK"
        said, _ = server.communicate()
        assert "avr-gdb" in said
        assert server.returncode == 0


def monitor(gdb: GdbClient, text: str) -> str:
    return bytes.fromhex(gdb.ask(f"qRcmd,{text.encode().hex()}")).decode()


def symbol(elf: Path, name: str) -> int:
    names = subprocess.run(["avr-nm", elf], capture_output=True, text=True, check=True).stdout
    (line,) = [line for line in names.splitlines() if line.endswith(f" {name}")]
    return int(line.split()[0], 16)


PAGE = (ROOT / "docs/debugging.md").read_text()


def test_the_page_shows_the_program_that_has_the_bug() -> None:
    assert block(PAGE, "c") in (ROOT / "experiments/debugging/neighbours.c").read_text()
    assert f"kilotwin run {EXPERIMENT.relative_to(ROOT)} --out runs/alarm" in PAGE
    assert f"kilotwin debug runs/alarm --robot {ALARMED + 1} --at {AT_S:g}" in PAGE


@pytest.mark.skipif(find_gdb() is None, reason="no gdb for AVR: apt-get install gdb-avr")
def test_the_session_of_the_page_goes_as_it_says(recorded: Path) -> None:
    shown = "".join(re.findall(r"^```gdb\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
    typed = [line.removeprefix("(gdb) ") for line in shown.splitlines() if line.startswith("(gdb)")]
    done = subprocess.run(
        [KILOTWIN, "debug", recorded, "--robot", str(ALARMED + 1), "--at", str(AT_S)],
        input="\n".join(["set pagination off", "set confirm off", *typed]),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,  # gdb's own words and those of `monitor`
        text=True,
        check=True,
    )
    answers = [line for line in shown.splitlines() if not line.startswith("(gdb)")]
    assert [line for line in answers if line not in done.stdout] == []
    assert LINE_OF_BUG in done.stdout
    assert f"kilotwin view {recorded}\n" in done.stdout
