"""An emulated overhead controller on a pseudo terminal: orders, and robots flashed by its light.

Robots on chips hold a boot loader as the published ones behave (a stand-in, written from that), or
ours. The host's side is the one that drives a real overhead controller.
"""

import json
import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from kilotwin import RGB, World
from kilotwin.experiment.spec.overhead import message
from kilotwin.files.flash_image import FlashImage, read_hex
from kilotwin.runs.reader import Run
from kilotwin.session.served_overhead import ServedOverhead
from kilotwin.table.links.overhead_robots import OverheadRobots
from kilotwin.table.links.packets import Overhead, encode, encode_page
from kilotwin.units import TICK_S

from .conftest import KILOTWIN, ROOT, Kilotwin

PROGRAMS = ROOT / "tests/native/avr/programs"
NEWER = ROOT / "tests/native/bootloader/programs/newer.c"
NEVER = [{"at_s": 1e6, "send": "wakeup"}]
RUN, BOOT, RESET = (message((), kind) for kind in (0x88, 0x80, 0x83))
RED, YELLOW = RGB(3, 0, 0), RGB(3, 3, 0)

LAMP = """
#include <kilolib.h>
static void setup(void) {}
static void loop(void) { set_color(RGB(3, 0, 0)); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


def call(*words: str | Path) -> None:
    """A command that must succeed; it prints nothing."""
    subprocess.run(words, check=True, capture_output=True)


def avr_hex(source: Path, folder: Path, *options: str) -> str:
    """A program without our kilolib, as the text of its .hex."""
    elf = folder / f"{source.stem}.elf"
    call("avr-gcc", "-mmcu=atmega328p", "-Os", "-std=gnu99", "-o", elf, source, *options)
    call("avr-objcopy", "-O", "ihex", elf, elf.with_suffix(".hex"))
    return elf.with_suffix(".hex").read_text()


def joined(*images: str) -> str:
    """Application and loader in one .hex."""
    lines = [line for image in images for line in image.splitlines() if line != ":00000001FF"]
    return "\n".join([*lines, ":00000001FF", ""])


@pytest.fixture(scope="session")
def images(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """original.hex: a published runtime and its loader; ours.hex: lamp.c and ours; newer.hex."""
    folder = tmp_path_factory.mktemp("images")
    application = avr_hex(PROGRAMS / "original.c", folder)
    section = "-Wl,--section-start=.text=0x7000"
    loader = avr_hex(PROGRAMS / "original_loader.c", folder, section)
    (folder / "original.hex").write_text(joined(application, loader))
    (folder / "lamp.c").write_text(LAMP)
    for source in (folder / "lamp.c", NEWER):
        call(KILOTWIN, "build", source, "--hex", folder / f"{source.stem}.hex")
    ours = folder / "bootloader.hex"
    firmware = ROOT / "firmware"
    call("make", "-s", "-C", firmware, f"BUILD={folder}", "KILOLIB=", "PROGRAM=", ours)
    (folder / "ours.hex").write_text(joined((folder / "lamp.hex").read_text(), ours.read_text()))
    return folder


class EngineClock:
    """The time of an engine with an overhead controller above its robots."""

    def __init__(self, world: World) -> None:
        self._simulation = world._simulation
        self.controller = ServedOverhead(self._simulation, None)
        self._now_s = self._simulation.tick * TICK_S

    def now_s(self) -> float:
        return self._now_s

    def sleep(self, seconds: float) -> None:
        self._now_s += seconds
        while self._simulation.tick < round(self._now_s / TICK_S):
            self.controller.step(self._simulation.tick)
            self._simulation.advance(1)


class Lab:
    """Robots, and the host of their overhead controller."""

    def __init__(self, robots: list[dict[str, object]]) -> None:
        # Steps as in a served world. To translate the images takes longer than they run.
        engine = {"step_ticks": 1, "avr_core": "interpreted"}
        sees_all = {"overhead_loss": 0}  # where one lap is to do
        self.world = World(
            robots=robots, command=NEVER, arena=(1, 1), engine=engine, medium=sees_all
        )
        self.world.run(1)
        self.clock = EngineClock(self.world)
        # The port is said as it is to people.
        port = self.clock.controller.note.rpartition(":")[2]
        self.host = OverheadRobots(port, self.clock)

    def upload(self, image: FlashImage) -> None:
        """As our host does it: a lap, after time to erase."""
        self.host.repeat(BOOT, 0.5)
        self.host.announce(image)
        self.host.send_page(0, image.pages[0])
        self.clock.sleep(1)
        for page, data in enumerate(image.pages):
            self.host.send_page(page, data)

    def upload_as_kilogui(self, image: FlashImage, laps: int) -> None:
        """Packets each 130 ms: BOOT, then size and pages, round and round. No CRC, no pause."""
        packets = [encode(Overhead.FORWARDMSG, BOOT)]
        size = encode(Overhead.FORWARDMSG, message([len(image.pages)], 0x82))
        lap = [encode_page(Overhead.BOOTPAGE, *page) for page in enumerate(image.pages)]
        for packet in [*packets, *([size, *lap] * laps)]:
            self.host._port.write(packet)
            self.clock.sleep(0.130)

    def close(self) -> None:
        self.host.close()
        self.clock.controller.close()
        self.world.close()


@pytest.fixture
def labs() -> Iterator[list[Lab]]:
    opened: list[Lab] = []
    yield opened
    for lab in opened:
        lab.close()


def test_chips_and_native_robots_obey_the_light(images: Path, labs: list[Lab]) -> None:
    lab = Lab(
        [
            {"hex": str(images / "lamp.hex"), "count": 2},
            {"program": str(images / "lamp.c"), "count": 1},
        ]
    )
    labs.append(lab)
    assert list(lab.world.leds) != [RED] * 3
    lab.host.repeat(RUN, 0.1)
    lab.clock.sleep(0.1)
    assert list(lab.world.leds) == [RED] * 3
    lab.host.repeat(RESET, 0.1)
    lab.clock.sleep(0.1)
    assert RED not in lab.world.leds


def test_a_robot_with_the_published_loader_is_flashed_in_one_lap(
    images: Path, labs: list[Lab]
) -> None:
    lab = Lab([{"hex": str(images / "original.hex"), "count": 3}])
    labs.append(lab)
    image = read_hex(images / "newer.hex")
    lab.upload(image)
    lab.host.repeat(RUN, 0.2)
    lab.clock.sleep(0.2)
    assert list(lab.world.leds) == [YELLOW] * 3
    # BOOT called the loader again, which waits for an image: any other message leaves it.
    lab.host.repeat(BOOT, 0.2)
    lab.host.repeat(RUN, 0.2)
    lab.host.repeat(RUN, 0.2)
    lab.clock.sleep(0.2)
    assert list(lab.world.leds) == [YELLOW] * 3


def test_ours_take_kilogui_s_packets_and_a_native_one_says_that_it_has_no_loader(
    images: Path, labs: list[Lab]
) -> None:
    lab = Lab(
        [
            {"hex": str(images / "ours.hex"), "count": 1},
            {"program": str(images / "lamp.c"), "count": 2, "cpu": "native"},
        ]
    )
    labs.append(lab)
    image = read_hex(images / "newer.hex")
    lab.upload_as_kilogui(image, 2)
    lab.host.repeat(RUN, 0.2)
    lab.clock.sleep(0.2)
    assert list(lab.world.leds) == [YELLOW, RED, RED]
    told = [event for event in lab.world.events if "has no boot loader" in event["text"]]
    assert [(event["kind"], event["robot"]) for event in told] == [("note", 1), ("note", 2)]
    assert 'cpu = "avr"' in told[0]["text"]


EXPERIMENT = """
name = "served"
duration_s = 2

[arena]
diameter_m = 0.5

[swarm]
profile = "kilobot"
runtime = "kilotwin"
program = "lamp.c"
size = 2

[record]
sample_s = 0.1
"""


def serve(folder: Path, environment: dict[str, str], *words: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [KILOTWIN, "serve", "world", "served.toml", "--out", "out", "--link-ohc", "ohc", *words],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(link: Path, process: "subprocess.Popen[str]") -> None:
    deadline = time.monotonic() + 600
    while not link.is_symlink():
        assert time.monotonic() < deadline
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)


@pytest.mark.waits
def test_robots_of_any_experiment_wait_for_a_host(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    (tmp_path / "lamp.c").write_text(LAMP)
    (tmp_path / "served.toml").write_text(EXPERIMENT)
    with serve(tmp_path, environment, "--json") as process:
        wait_for(tmp_path / "ohc", process)
        time.sleep(1)
        assert process.poll() is None  # its 2 s begin with the host's RUN
        host = OverheadRobots(str(tmp_path / "ohc"))
        host.repeat(RUN, 0.3)
        host.close()
        said, notes = process.communicate(timeout=600)
    assert process.returncode == 0, notes
    assert "an overhead controller is at ohc; --via ohc:ohc" in notes
    assert not (tmp_path / "ohc").is_symlink()
    assert json.loads(said)["simulated_s"] == pytest.approx(2, abs=0.1)
    rows = Run.open(tmp_path / "out").robots().to_pylist()
    assert min(row["time_s"] for row in rows) < 0.2
    assert {row["led"] for row in rows if row["time_s"] > 0.5} == {RED}


FLASHED = """
name = "flashed"
duration_s = 4

[arena]
diameter_m = 0.5

[swarm]
profile = "kilobot"
runtime = "kilotwin"

[engine]
avr_core = "interpreted"

[medium]
overhead_loss = 0

[[robots]]
hex = "{images}/original.hex"
count = 3

[record]
sample_s = 0.1
"""


@pytest.mark.waits
def test_robots_with_the_published_loader_are_flashed_by_what_a_person_types(
    images: Path, tmp_path: Path, environment: dict[str, str], kilotwin: Kilotwin
) -> None:
    (tmp_path / "served.toml").write_text(FLASHED.format(images=images))
    with serve(tmp_path, environment) as process:
        wait_for(tmp_path / "ohc", process)
        via = ("--via", f"ohc:{tmp_path / 'ohc'}")
        done = kilotwin("flash", "robots", images / "newer.hex", *via, "--laps", "1", "-q")
        assert "sent 1 lap of" in done.stdout
        assert "not verifiable" in done.stdout
        kilotwin("robots", "run", *via, "-q")
        _, notes = process.communicate(timeout=600)
    assert process.returncode == 0, notes
    rows = Run.open(tmp_path / "out").robots().to_pylist()
    last_s = max(row["time_s"] for row in rows)
    assert [row["led"] for row in rows if row["time_s"] == last_s] == [YELLOW] * 3


def test_what_does_not_go_with_a_served_world_is_refused(
    tmp_path: Path, kilotwin: Kilotwin
) -> None:
    (tmp_path / "lamp.c").write_text(LAMP)
    file = tmp_path / "served.toml"
    file.write_text(EXPERIMENT)
    (tmp_path / "taken").write_text("precious")
    for words, said in (
        (["--port", "29600"], r"--port: .*served.toml has no \[grid\], so no CAN buses"),
        (["--can", "vcan0"], r"--can: .*served.toml has no \[grid\], so no CAN buses"),
        (["--link-ohc", tmp_path / "taken"], r"--link-ohc .*: there is a file of that name"),
    ):
        done = kilotwin("serve", "world", file, *words, "--out", tmp_path / "no", expect=2)
        assert re.search(said, done.stderr), done.stderr
        assert "Traceback" not in done.stderr


def test_run_serve_names_the_command_that_serves_a_world(kilotwin: Kilotwin) -> None:
    done = kilotwin("run", "served.toml", "--serve", "--port", "29600", expect=2)
    said = "run has no --serve; type: kilotwin serve world EXPERIMENT.toml"
    assert done.stderr == f"kilotwin: {said}\n"
