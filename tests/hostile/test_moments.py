"""Programs that mean harm from the first moment on: when they are loaded, before main(), in it, in
callbacks; robots and modules; by each command that runs them."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

KILOTWIN = Path(sys.executable).with_name("kilotwin")
HERE = Path(__file__).parent

# Moments of moments.c, but for those when it is loaded.
MOMENTS = {
    2: "section .init",
    5: "constructor",
    6: "destructor",
    7: "kilo_message_tx",
    8: "kilo_message_tx_success",
    9: "kilo_message_rx",
    10: "setup()",
    11: "loop()",
    12: "loop() after delay()",
    13: "main()",
    14: "main() after kilo_init()",
}
NEVER_CALLED = {2, 6}
# By moment: what a file says that has it, and is not loaded.
NOT_LOADED = {
    1: "a function that is chosen when it is loaded (ifunc)",
    3: "an initialiser (_init, section .init)",
    4: "a finaliser (_fini, section .fini)",
}
# Acts of acts.h: on files outside, which Landlock refuses, and calls, which end the robot.
ON_FILES = (1, 2, 3)
CALLS = {
    4: "fork()",
    5: "kill()",
    6: "socket()",
    **dict.fromkeys((7, 8, 9, 10), "fcntl()"),
    11: "ioctl()",
    12: "ppoll()",
    13: "pselect()",
    14: "epoll_pwait()",
    15: "tgkill()",
    **dict.fromkeys((16, 17), "mmap()"),
    18: "pipe()",
    19: "fallocate()",
    20: "eventfd()",
}
WITHOUT_LANDLOCK = {"KILOTWIN_WITHOUT_LANDLOCK": "1"}

ROBOTS = """\
[[robots]]
program = "{here}/moments.c"
define = ['VICTIM="{outside}/victim"', 'OUTSIDE="{outside}"', 'MOMENT={moment}', 'ACT={act}']
count = {count}
"""
SWARM = """\
duration_s = 20
arena.diameter_m = 0.5
[swarm]
profile = "kilobot"
cpu = "native"
[record]
sample_s = 5
"""
GRID = """\
duration_s = 5
[grid]
columns = 1
rows = 1
buses = 1
program = "{here}/module_moments.c"
define = ['VICTIM="{outside}/victim"', 'OUTSIDE="{outside}"', 'MOMENT={moment}', 'ACT={act}']
[swarm]
profile = "kilobot"
cpu = "native"
program = "{here}/innocent.c"
size = 1
[record]
sample_s = 1
"""
CASES = [(moment, act) for moment in MOMENTS for act in (*ON_FILES, *CALLS)]
CASES = [case for case in CASES if case[0] == 13 or case[1] in (1, 4)]


@dataclass
class Scene:
    """A folder, and one beside it that no program may touch."""

    folder: Path
    command: tuple[object, ...] = (KILOTWIN,)

    def __post_init__(self) -> None:
        self.outside.mkdir()
        (self.outside / "victim").write_text("mine")

    @property
    def outside(self) -> Path:
        return self.folder / "outside"

    def text(self, text: str, moment: int = 0, act: int = 0, count: int = 1) -> str:
        names = {"moment": moment, "act": act, "count": count}
        return text.format(here=HERE, outside=self.outside, **names)

    def kilotwin(self, *words: object, **variables: str) -> "subprocess.CompletedProcess[str]":
        """A command; afterwards nothing has been touched."""
        done = subprocess.run(
            [*map(str, self.command), *map(str, words)],
            env={**os.environ, "KILOTWIN_CACHE": str(self.folder.parent / "cache"), **variables},
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=400,
        )
        assert [file.name for file in self.outside.iterdir()] == ["victim"], done.stderr
        assert (self.outside / "victim").read_text() == "mine"
        assert "Traceback" not in done.stderr
        return done


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return Scene(tmp_path)


def verdicts(run: Path) -> dict[int, list[str]]:
    """What each robot, or module 0, did: "did 0", or why it stopped; each once."""
    found: dict[int, list[str]] = {}
    for line in (run / "events.jsonl").read_text().splitlines():
        event: dict[str, Any] = json.loads(line)
        texts = found.setdefault(event.get("robot", 0), [])
        if event["kind"] in ("print", "crash") and event["text"] not in texts:
            texts.append(event["text"])
    return found


def run_swarm(scene: Scene, cases: list[tuple[int, int]], *words: str, **variables: str) -> None:
    """Each case is a robot, which does as it should."""
    text = SWARM + "".join(scene.text(ROBOTS, *case) for case in cases)
    text += scene.text(ROBOTS, count=16)  # who they hear, and who hears them
    (scene.folder / "swarm.toml").write_text(text)
    done = scene.kilotwin("run", "swarm.toml", "--out", "run", "--quiet", *words, **variables)
    assert done.returncode == 4, done.stderr
    of = verdicts(scene.folder / "run")
    for robot, (moment, act) in enumerate(cases):
        *before, last = of[robot]
        if act in CALLS and moment not in NEVER_CALLED:
            ending = f"it made a system call that is not allowed here, {CALLS[act]}"
            assert last.endswith(ending), (MOMENTS[moment], of[robot])
            assert set(before) <= {"did 0"}
        else:
            assert (before, last) == ([], "did 0"), (MOMENTS[moment], act)


def test_a_harmful_act_is_refused_and_named_at_every_moment(scene: Scene) -> None:
    run_swarm(scene, CASES, "--confine=require")


def test_the_present_folder_is_not_read_where_python_imports_from_it(scene: Scene) -> None:
    (scene.folder / "swarm.toml").write_text(SWARM + scene.text(ROBOTS, 13, 2))
    scene.command = (sys.executable, "-m", "kilotwin")
    scene.kilotwin("run", "swarm.toml", "--out", "run", "--confine=require")
    assert verdicts(scene.folder / "run") == {0: ["did 0"]}


def test_the_folder_of_a_served_ports_name_is_not_written(scene: Scene) -> None:
    # The second robot's end says that main() of both has run.
    robots = scene.text(ROBOTS, 13, 1) + scene.text(ROBOTS, 13, 4)
    (scene.folder / "swarm.toml").write_text(SWARM + robots)
    words = ("serve", "world", "swarm.toml", "--out", "run", "--link-ohc", "ohc")
    events, link = scene.folder / "run/events.jsonl", scene.folder / "ohc"
    with subprocess.Popen([KILOTWIN, *words], cwd=scene.folder, stderr=subprocess.PIPE) as process:
        while process.poll() is None and not (events.exists() and "fork()" in events.read_text()):
            time.sleep(0.1)
        assert link.is_symlink()
        process.send_signal(signal.SIGINT)
        process.communicate()
    assert [file.name for file in scene.outside.iterdir()] == ["victim"]
    assert not link.is_symlink()


def test_calls_are_refused_at_every_moment_without_landlock(scene: Scene) -> None:
    cases = [case for case in CASES if case[1] in CALLS]
    run_swarm(scene, cases, **WITHOUT_LANDLOCK)
    manifest = json.loads((scene.folder / "run/manifest.json").read_text())
    assert manifest["confined"] is False
    assert "this kernel has no Landlock" in manifest["not_confined"][0]


@pytest.mark.parametrize("moment", NOT_LOADED)
@pytest.mark.parametrize("variables", [{}, WITHOUT_LANDLOCK])
def test_what_would_run_when_it_is_loaded_is_not_loaded(
    scene: Scene, moment: int, variables: dict[str, str]
) -> None:
    (scene.folder / "swarm.toml").write_text(SWARM + scene.text(ROBOTS, moment, 1))
    done = scene.kilotwin("run", "swarm.toml", "--out", "run", **variables)
    assert done.returncode == 2
    assert "swarm.toml:8: program moments cannot be loaded: it has " in done.stderr
    assert NOT_LOADED[moment] in done.stderr
    assert not (scene.folder / "run").exists()


STUCK = (
    "nothing went on in the engine for 3 s, so that it was ended; last to run was moments robot 1"
)


@pytest.mark.parametrize(("moment", "act"), [(5, 21), (13, 22), (11, 22)])
def test_a_robot_that_no_signal_reaches_is_ended_from_outside_and_named(
    scene: Scene, moment: int, act: int
) -> None:
    (scene.folder / "swarm.toml").write_text(SWARM + scene.text(ROBOTS, moment, act))
    done = scene.kilotwin("run", "swarm.toml", "--out", "run", KILOTWIN_STUCK_S="3")
    assert done.returncode == 1
    assert STUCK in done.stderr
    manifest = json.loads((scene.folder / "run/manifest.json").read_text())
    assert (manifest["status"], STUCK in manifest["reason"]) == ("failed", True)


def test_a_sweep_names_a_trial_that_no_signal_reaches_and_goes_on(scene: Scene) -> None:
    for name, act in (("held", 22), ("other", 0)):
        (scene.folder / f"{name}.toml").write_text(SWARM + scene.text(ROBOTS, 11, act))
    (scene.folder / "sweep.toml").write_text('base = ["held.toml", "other.toml"]\nseeds = 1\n')
    words = ("sweep", "sweep.toml", "--out", "out", "-j", "1", "--json")
    done = scene.kilotwin(*words, KILOTWIN_STUCK_S="3")
    told = json.loads(done.stdout)
    assert told["finished"] == 1, done.stderr
    (failed,) = told["failed"]
    assert "held" in failed["trial"]
    assert STUCK in failed["failed"]


def test_a_scenario_names_a_robot_that_no_signal_reaches(scene: Scene) -> None:
    text = SWARM + scene.text(ROBOTS, 11, 22) + "[[expect]]\nno_crash = true\n"
    (scene.folder / "scene.toml").write_text(text)
    done = scene.kilotwin("test", "scene.toml", KILOTWIN_STUCK_S="3")
    assert done.returncode == 1
    assert STUCK in done.stdout + done.stderr


@pytest.mark.parametrize(("moment", "act"), [(5, 1), (13, 1), (5, 4), (11, 4)])
def test_modules_are_confined_at_every_moment(scene: Scene, moment: int, act: int) -> None:
    (scene.folder / "grid.toml").write_text(scene.text(GRID, moment, act))
    done = scene.kilotwin("run", "grid.toml", "--out", "run", "--confine=require", "--json")
    assert done.returncode == (4 if act in CALLS else 0), done.stderr
    failed = json.loads(done.stdout)["grid"]["modules_failed"]
    assert bool(failed) == (act in CALLS)
    assert all(CALLS[act] in told["what"] for told in failed[:1])


@pytest.mark.parametrize(("moment", "act"), [(1, 1), (13, 1), (5, 4)])
class TestByEachCommand:
    def test_sweep(self, scene: Scene, moment: int, act: int) -> None:
        (scene.folder / "base.toml").write_text(SWARM + scene.text(ROBOTS, moment, act))
        (scene.folder / "sweep.toml").write_text('base = "base.toml"\nseeds = 1\n')
        done = scene.kilotwin("sweep", "sweep.toml", "--out", "out", "-j", "1", "--json")
        told = [trial["failed"] for trial in json.loads(done.stdout)["failed"]]
        self._is_named(moment, act, told)

    def test_test(self, scene: Scene, moment: int, act: int) -> None:
        expect = "[[expect]]\nno_crash = true\n"
        text = SWARM + scene.text(ROBOTS, moment, act) + expect
        (scene.folder / "scene.toml").write_text(text)
        scene.kilotwin("test", "scene.toml")

    def test_check(self, scene: Scene, moment: int, act: int) -> None:
        scene.kilotwin("check", HERE / "moments.c", "--time=2", *self._defines(scene, moment, act))

    def test_port(self, scene: Scene, moment: int, act: int) -> None:
        scene.kilotwin("port", HERE / "moments.c", "--time=2", *self._defines(scene, moment, act))

    def test_twin(self, scene: Scene, moment: int, act: int) -> None:
        (scene.folder / "swarm.toml").write_text(SWARM + scene.text(ROBOTS, moment, act))
        words = ("run", "swarm.toml", "--out", "run", "--quiet", "--require-twin")
        scene.kilotwin(*words, KILOTWIN_NO_TWIN="")

    @staticmethod
    def _defines(scene: Scene, moment: int, act: int) -> list[str]:
        outside = scene.outside
        texts = [f'VICTIM="{outside}/victim"', f'OUTSIDE="{outside}"']
        texts += [f"MOMENT={moment}", f"ACT={act}"]
        return [word for text in texts for word in ("-D", text)]

    @staticmethod
    def _is_named(moment: int, act: int, told: list[str]) -> None:
        if moment in NOT_LOADED:
            assert len(told) == 1
            assert NOT_LOADED[moment] in told[0]
        elif act in CALLS:
            assert len(told) == 1
            assert f"not allowed here, {CALLS[act]}: robot 1" in told[0]
        else:
            assert told == []
