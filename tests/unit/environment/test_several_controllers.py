"""[[overhead]]: several overhead controllers, each over a part of the table."""

from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.session.display import Silent
from kilotwin.session.job import Serving
from kilotwin.session.overhead_recording import Setup, record
from kilotwin.table.environment.poses import parse_address

# Green for half a second after a message of type 7, blue after a word for itself, and dark.
PROGRAM = """\
#include <kilolib.h>
static uint32_t at;
static uint8_t shown;
static void rx(message_t *m, distance_measurement_t *d) {
    (void)d;
    if (m->type == 7) { at = kilo_ticks; shown = RGB(0, 3, 0); }
    if (m->type != 0) return;
    for (uint8_t i = 0; i < 9; i += 3)
        if ((m->data[i] << 2 | m->data[i + 1] >> 6) == kilo_uid) {
            at = kilo_ticks;
            shown = RGB(0, 0, 3);
        }
}
static void setup(void) {}
static void loop(void) { set_color(shown && kilo_ticks - at < 16 ? shown : 0); }
int main(void) { kilo_init(); kilo_message_rx = rx; kilo_start(setup, loop); return 0; }
"""
ENVIRONMENT = """\
class Says:
    def __init__(self, arena, settings):
        self.words = settings["words"]

    def step(self, seen, send):
        if not self.words:
            send.to_all([1], 7)
        for robot in seen.robots if self.words else ():
            send(robot.uid, 5)
"""
# Robot 1 on the left, 2 in the middle, 3 on the right, 4 far off.
TABLE = """\
duration_s = 10
arena = {{ shape = "rectangle", width_m = 2.0, height_m = 1.0 }}
record.sample_s = 1
{medium}
[swarm]
profile = "kilobot"
cpu = "{cpu}"
[[robots]]
program = "shows.c"
count = 4
poses = [[-0.4, 0, 0], [0, 0, 0], [0.4, 0, 0], [0, 0.45, 0]]
[environment]
program = "says.py:Says"
picture_hz = 5
missed = 0
settings = {{ words = {words} }}
"""
LEFT = "[[overhead]]\ncentre_m = [-0.4, 0]\ndiameter_m = {reach}\n"
RIGHT = (
    '[[overhead]]\nshape = "rectangle"\ncentre_m = [0.4, 0]\nwidth_m = {reach}\nheight_m = 0.5\n'
)
GREEN, BLUE = 3 << 2, 3 << 4


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with both programs."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shows.c").write_text(PROGRAM)
    (tmp_path / "says.py").write_text(ENVIRONMENT)
    return tmp_path


def table(*controllers: str, words: bool = False, cpu: str = "translated") -> Path:
    """The experiment with these controllers."""
    ideal = cpu == "ideal"
    medium = 'medium.kind = "ideal"\nmedium.range_m = 0.1' if ideal else "medium.overhead_loss = 0"
    text = TABLE.format(cpu="native" if ideal else cpu, medium=medium, words=str(words).lower())
    file = Path("table.toml")
    file.write_text(text + "".join(controllers))
    return file


def colours(file: Path) -> list[int]:
    """Each robot's light after 5 s."""
    with World(str(file)) as world:
        world.run(5)
        return [int(led) for led in world.leds]


@pytest.mark.parametrize("cpu", ["native", "translated", "avr", "ideal"])
def test_robots_hear_the_controllers_that_cover_them(cpu: str) -> None:
    apart = table(LEFT.format(reach=0.6), RIGHT.format(reach=0.6), cpu=cpu)
    assert colours(apart) == [GREEN, 0, GREEN, 0]


@pytest.mark.parametrize("cpu", ["native", "translated", "avr"])
def test_what_two_send_at_once_is_lost_to_robots_below_both(cpu: str) -> None:
    both = table(LEFT.format(reach=1.0), RIGHT.format(reach=1.0), cpu=cpu)
    assert colours(both) == [GREEN, 0, GREEN, 0]


def test_the_ideal_medium_loses_nothing_below_two() -> None:
    both = table(LEFT.format(reach=1.0), RIGHT.format(reach=1.0), cpu="ideal")
    assert colours(both) == [GREEN, GREEN, GREEN, 0]


def test_a_word_goes_by_the_controller_over_its_robot() -> None:
    with World(str(table(LEFT.format(reach=0.6), RIGHT.format(reach=0.6), words=True))) as world:
        world.run(5)
        assert [int(led) for led in world.leds] == [BLUE, 0, BLUE, 0]
        rows = world.sent
    assert {row["uid"] for row in rows} == {1, 3}


def test_one_controller_over_all_is_the_default() -> None:
    hashes = []
    for controllers in ("", LEFT.format(reach=9)):
        with World(str(table(controllers))) as world:
            world.run(5)
            assert [int(led) for led in world.leds] == [GREEN] * 4
            hashes.append(world.result_hash)
    assert hashes[0] == hashes[1]


def test_a_served_world_has_a_port_for_each() -> None:
    serving = Serving(links={"ohc": Path("here/ohc")})
    both = Experiment.load(table(LEFT.format(reach=0.6), RIGHT.format(reach=0.6)))
    assert serving.names(both) == [Path("here/ohc-1"), Path("here/ohc-2")]
    assert serving.names(Experiment.load(table())) == [Path("here/ohc")]
    assert Serving().ohc_links(both) == [None, None]


def test_a_record_by_one_port_refuses_several() -> None:
    both = Experiment.load(table(LEFT.format(reach=0.6), RIGHT.format(reach=0.6)))
    setup = Setup("/dev/nowhere", parse_address("udp:127.0.0.1:5005"))
    with pytest.raises(InputError, match=r"names one overhead controller, here are 2"):
        record(both, setup, None, [], Silent())


@pytest.mark.parametrize(
    ("controllers", "what"),
    [
        ("[[overhead]]\ndiameter_m = 1\n", "lacks 'centre_m', the place below it"),
        ("[[overhead]]\ncentre_m = [0, 0]\n", "a circle needs 'diameter_m'"),
        (
            "[[overhead]]\ncentre_m = [0, 0]\ndiameter_m = 1\nwidth_m = 1\n",
            "a circle has no 'width_m'",
        ),
    ],
)
def test_a_mistake_is_named_with_what_to_do(controllers: str, what: str) -> None:
    with pytest.raises(InputError) as caught:
        Experiment.load(table(controllers))
    assert what in str(caught.value)
