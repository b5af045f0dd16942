"""`kilotwin why`: a run is repeated, and what a robot did is told back to its first cause."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from .conftest import ROOT, Kilotwin

HERE = Path(__file__).parent
# Robots 1, 2, 3 in a row: 1 draws, tells 2, which tells 3, which turns red.
THREE = f"""
name = "tell"
duration_s = 5
[arena]
shape = "rectangle"
width_m = 1
height_m = 1
[swarm]
profile = "kilobot"
[[robots]]
program = "{HERE}/programs/tell.c"
count = 3
poses = [[-0.08, 0, 0], [0, 0, 0], [0.08, 0, 0]]
"""
TOLD = """
#include <kilolib.h>
static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    if (message->type == 5) set_color(RGB(0, message->data[0], 0));
}
static void setup(void) {}
static void loop(void) {}
int main(void) {
    kilo_init();
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
"""
COMMANDED = """
name = "told"
duration_s = 4
[arena]
shape = "circle"
diameter_m = 0.5
[swarm]
profile = "kilobot"
program = "told.c"
size = 2
[[command]]
at_s = 0
send = "run"
[[command]]
at_s = 2
send = "user"
robot = 2
type = 5
data = [3]
"""

Ask = Callable[..., list[dict[str, Any]]]


@pytest.fixture(scope="module")
def told_run(kilotwin: Kilotwin, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tell")
    (folder / "tell.toml").write_text(THREE)
    kilotwin("run", folder / "tell.toml", "--out", folder / "run", "-q")
    return folder / "run"


@pytest.fixture
def ask(kilotwin: Kilotwin) -> Ask:
    """The links of a chain."""

    def links(run: Path, robot: int, at_s: float, *more: str) -> list[dict[str, Any]]:
        done = kilotwin("why", run, "--robot", str(robot), "--at", str(at_s), "--json", *more)
        return list(json.loads(done.stdout)["chain"])

    return links


def test_a_chain_of_three_robots_is_told_to_the_draw_with_files_and_lines(
    told_run: Path, kilotwin: Kilotwin
) -> None:
    done = kilotwin("why", told_run, "--robot", "3", "--at", "4", "led", "-q")
    lines = [line.strip() for line in done.stdout.splitlines()]
    assert lines[0].startswith("robot 3: LED off -> bright-red at ")
    assert lines[1].startswith("by tell.c:40 in loop(), in the main loop at its tick ")
    assert lines[2].startswith("heard was set 0 -> 7 at ")
    assert "by tell.c:13 in note()" in lines[2]
    assert lines[3].startswith("<- message of type 0, data 02 07, of robot 2 at (0.000, 0.000) m")
    told = [line for line in lines if line.startswith(("robot", "first cause"))]
    assert [line.split(":")[0] for line in told] == ["robot 3", "robot 2", "robot 1", "first cause"]
    assert told[-1].startswith("first cause: robot 1 drew a random number at ")
    assert told[-1].endswith(", tell.c:30 in loop()")
    assert lines[-1].startswith("See it: kilotwin view ")


def test_the_page_shows_what_is_printed(told_run: Path, kilotwin: Kilotwin) -> None:
    page = (ROOT / "docs/why.md").read_text()
    asked, told = re.findall(r"^```\n(.*?)\n```", page, re.MULTILINE | re.DOTALL)
    words = asked.split()[3:]
    done = kilotwin("why", told_run, *words, "-q")
    assert done.stdout.strip().splitlines()[:-2] == told.splitlines()


def test_motors_and_variables_are_asked_for_likewise(told_run: Path, ask: Ask) -> None:
    motors, variable = ask(told_run, 3, 4, "motors"), ask(told_run, 2, 4, "heard")
    assert (motors[0]["was"], motors[0]["now"]) == ("(0, 0)", "(70, 0)")
    assert motors[0]["place"] == "tell.c:41 in loop()"
    assert (variable[0]["what"], variable[0]["was"], variable[0]["now"]) == ("heard", "0", "7")
    assert variable[0]["during"] == "message"
    assert variable[1]["sender"] == "robot 1"


def test_depth_is_kept(told_run: Path, ask: Ask) -> None:
    assert [link["link"] for link in ask(told_run, 3, 4)] == [
        *("change", "message", "change", "message", "change", "cause")
    ]
    short = ask(told_run, 3, 4, "--depth", "1")
    assert [link["link"] for link in short] == ["change", "message", "cause"]
    assert (short[-1]["kind"], short[-1]["of"]) == ("depth", "robot 2")


def test_what_never_changed_is_so_since_the_start(told_run: Path, ask: Ask) -> None:
    links = ask(told_run, 1, 4, "led")
    assert [(link["link"], link["kind"]) for link in links] == [("cause", "start")]


def test_a_word_of_an_environment_is_a_first_cause(
    kilotwin: Kilotwin, tmp_path: Path, ask: Ask
) -> None:
    settings = ["--set", "duration_s=50", "--set", "swarm.cpu=translated"]
    wall = "experiments/environment/wall.toml"
    kilotwin("run", wall, *settings, "--out", tmp_path / "run", "-q", folder=ROOT)
    links = ask(tmp_path / "run", 3, 46)
    assert links[0]["reads"] == "told"
    assert links[1]["sender"] == "overhead controller 1"
    assert "the environment's word for robot 3, type 1, value " in links[-1]["text"]


def test_a_command_of_the_experiment_is_a_first_cause(
    kilotwin: Kilotwin, tmp_path: Path, ask: Ask
) -> None:
    (tmp_path / "told.c").write_text(TOLD)
    (tmp_path / "told.toml").write_text(COMMANDED)
    kilotwin("run", tmp_path / "told.toml", "--out", tmp_path / "run", "-q")
    links = ask(tmp_path / "run", 2, 3)
    assert links[0]["now"] == "bright-green"
    assert links[-1]["kind"] == "command"
    assert "[[command]] 2 (send = 'user', " in links[-1]["text"]


def test_a_cell_s_word_is_a_first_cause(kilotwin: Kilotwin, tmp_path: Path, ask: Ask) -> None:
    small = "tests/system/grid_small.toml"
    kilotwin("run", small, "--set", "duration_s=17", "--out", tmp_path / "run", "-q", folder=ROOT)
    links = ask(tmp_path / "run", 3, 16.5)
    assert (links[0]["was"], links[0]["now"], links[0]["reads"]) == ("off", "white", "site")
    assert links[1]["sender"].startswith("cell 3 (bottom right) of module (2, 2)")
    assert links[-1]["kind"] == "cell"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--robot", "9", "--at", "4"], "--robot 9: there is no such robot; name one of 1 to 3"),
        (["--robot", "1", "--at", "400"], "--at 400: the run goes from 0 to 5"),
        (["--robot", "1", "--at", "-1"], "--at -1: the run goes from 0 to 5"),
        (["--robot", "1", "--at", "nan"], "--at nan: the run goes from 0 to 5"),
        (["--robot", "1", "--at", "4", "speed"], "'speed': it is led, motors or a variable"),
        (["--robot", "1", "--at", "4", "message"], "'message' is no number"),
    ],
)
def test_what_is_not_there_is_an_error(
    told_run: Path, kilotwin: Kilotwin, arguments: list[str], said: str
) -> None:
    done = kilotwin("why", told_run, *arguments, "-q", expect=2)
    assert said in done.stderr
    assert done.stdout == ""


def test_of_a_native_run_it_says_what_to_type(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (tmp_path / "told.c").write_text(TOLD)
    (tmp_path / "told.toml").write_text(COMMANDED)
    run = tmp_path / "run"
    kilotwin("run", tmp_path / "told.toml", "--out", run, "-q", "--set", "swarm.cpu=native")
    done = kilotwin("why", run, "--robot", "2", "--at", "3", "-q", expect=2)
    assert "robot 2 runs natively, where no store is seen" in done.stderr
    assert f"kilotwin run {run}/experiment.toml --set swarm.cpu=translated" in done.stderr


def test_a_run_that_is_another_one_by_now_is_not_explained(
    told_run: Path, kilotwin: Kilotwin
) -> None:
    program = next(told_run.rglob("tell.c"))
    text = program.read_text()
    program.write_text(text.replace("RGB(3, 0, 0)", "RGB(0, 3, 0)"))
    try:
        done = kilotwin("why", told_run, "--robot", "3", "--at", "4", "-q", expect=1)
    finally:
        program.write_text(text)
    assert "repeated, it is another run at " in done.stderr
    assert "(led differs); kilotwin run --verify " in done.stderr
