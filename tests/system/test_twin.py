"""A program that runs natively is held against its ATmega328P, some seconds of one robot."""

import json
import os
import subprocess
import threading
import time
from pathlib import Path

import pytest

from .conftest import KILOTWIN, WALKER, Kilotwin

EXPERIMENT = """\
duration_s = 2
[arena]
diameter_m = 0.5
[swarm]
profile = "{profile}"
cpu = "native"
program = "program.c"
size = 2
"""
# Counts passes of loop(), of which the robot makes thousands while one is made here.
COUNTS_PASSES = """\
#include <kilolib.h>
static uint16_t passes;
static void setup(void) {}
static void loop(void) { if (++passes == 1000) set_color(RGB(3, 0, 0)); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
AGREES = "twin agrees: program.c, "
WITH_TWIN = {"KILOTWIN_NO_TWIN": "0"}


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    """The experiment's file; its program is the walker."""
    return written(tmp_path, WALKER)


def written(folder: Path, program: str, profile: str = "kilobot") -> Path:
    (folder / "program.c").write_text(program)
    file = folder / "experiment.toml"
    file.write_text(EXPERIMENT.format(profile=profile))
    return file


def said(kilotwin: Kilotwin, experiment: Path, *words: str | Path, expect: int = 0) -> str:
    """The line about twins, without the path; "" if there is none."""
    out = ["--out", out_of(experiment)]
    done = kilotwin("run", experiment, *out, *words, expect=expect, env=WITH_TWIN)
    lines = done.stderr.replace(f"{experiment.parent}/", "").splitlines()
    return "\n".join(line for line in lines if "twin" in line.split(":")[0])


def out_of(experiment: Path) -> Path:
    folder = experiment.parent / "runs"
    count = len(list(folder.iterdir())) if folder.exists() else 0
    return folder / str(count)


def test_a_new_program_that_decides_as_on_the_robot_agrees_once(
    kilotwin: Kilotwin, experiment: Path
) -> None:
    assert said(kilotwin, experiment).startswith(AGREES)
    assert said(kilotwin, experiment) == ""
    manifest = json.loads((experiment.parent / "runs/1/manifest.json").read_text())
    (verdict,) = manifest["twins"]
    assert (verdict["agrees"], verdict["known"]) == (True, True)


def test_a_program_that_decides_otherwise_is_told_at_every_run(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    experiment = written(tmp_path, COUNTS_PASSES)
    first, second = (said(kilotwin, experiment) for _ in range(2))
    assert first.startswith("twin differs: program.c, first at tick ")
    assert "LED RGB(3,0,0) at tick 6;" in first
    assert "kilotwin port program.c" in first
    assert second == first


def test_a_twin_that_is_required_and_differs_lets_nothing_run(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    experiment = written(tmp_path, COUNTS_PASSES)
    line = said(kilotwin, experiment, "--require-twin", expect=1)
    assert "program.c" in line
    assert not (tmp_path / "runs").exists()


def test_a_twin_that_is_required_and_agrees_lets_it_run(
    kilotwin: Kilotwin, experiment: Path
) -> None:
    said(kilotwin, experiment, "--require-twin")
    assert (experiment.parent / "runs/0/robots.parquet").exists()


def test_there_is_no_twin_if_none_is_wanted_or_the_robot_is_no_kilobot(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    experiment = written(tmp_path, COUNTS_PASSES)
    assert said(kilotwin, experiment, "--no-twin") == ""
    assert said(kilotwin, experiment, "--set", "swarm.cpu=translated") == ""
    assert said(kilotwin, written(tmp_path, COUNTS_PASSES, "foot-bot")) == ""
    assert "give one of them" in said(kilotwin, experiment, "--no-twin", "--require-twin", expect=2)


def test_without_avr_gcc_the_run_says_that_there_is_no_twin(
    kilotwin: Kilotwin, experiment: Path, tmp_path: Path
) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    for tool in ("gcc", "as", "ld", "cc", "objcopy", "nm", "ar", "objdump"):
        found = subprocess.run(["which", tool], capture_output=True, text=True, check=True)
        (tools / tool).symlink_to(found.stdout.strip())
    words = ["run", experiment, "--out", tmp_path / "run"]
    env = {**WITH_TWIN, "PATH": str(tools)}
    said = kilotwin(*words, env=env).stderr
    assert f"no twin: {tmp_path}/program.c, avr-gcc is not here" in said
    kilotwin(*words[:-1], tmp_path / "b", "--require-twin", env=env, expect=1)
    assert not (tmp_path / "b").exists()


def test_a_sweep_holds_each_program_once(kilotwin: Kilotwin, tmp_path: Path) -> None:
    written(tmp_path, COUNTS_PASSES)
    (tmp_path / "sweep.toml").write_text(
        'name = "two"\n[[block]]\nbase = ["experiment.toml"]\nseeds = 2\n'
    )
    words = ["sweep", tmp_path / "sweep.toml", "--out", tmp_path / "data"]
    done = kilotwin(*words, "--seeds", "1", env=WITH_TWIN)
    assert done.stderr.count("twin differs: ") == 1
    kilotwin(*words, "--require-twin", env=WITH_TWIN, expect=1)


def test_a_program_that_means_harm_cannot_do_it_in_its_twin(
    kilotwin: Kilotwin, tmp_path: Path
) -> None:
    """Its process is as confined as that of a run."""
    harm = Path(__file__).parents[1] / "hostile/system_call.h"
    experiment = written(
        tmp_path,
        f'#include "{harm.name}"\n'
        + COUNTS_PASSES.replace(
            "static void setup(void) {}",
            f'static void setup(void) {{ call(87, (long)"{tmp_path}/victim", 0, 0, 0); }}',
        ),
    )
    (tmp_path / harm.name).write_text(harm.read_text())
    (tmp_path / "victim").write_text("mine")
    line = said(kilotwin, experiment, "--require-twin", expect=1)
    assert "program.c" in line
    assert (tmp_path / "victim").read_text() == "mine"


def test_a_run_that_is_interrupted_does_not_wait_for_its_twin(
    environment: dict[str, str], experiment: Path, tmp_path: Path
) -> None:
    words: list[str | Path] = [KILOTWIN, "run", experiment, "--set", "duration_s=1e6"]
    words += ["--out", tmp_path / "run"]
    env = {**environment, **WITH_TWIN, "KILOTWIN_CACHE": str(tmp_path / "cache")}
    with subprocess.Popen(words, env=env, stderr=subprocess.PIPE, process_group=0) as process:
        manifest = tmp_path / "run/manifest.json"
        while not manifest.exists():
            time.sleep(0.01)
        os.killpg(process.pid, 2)
        killer = threading.Timer(120, process.kill)
        killer.start()
        process.communicate()
        killer.cancel()
    assert process.returncode == 130
    assert json.loads(manifest.read_text())["status"] == "interrupted"


# Followers show green while they received a leader's message within so many passes of loop(). A
# robot makes those in a moment and the emulator in seconds, so the two differ once leaders send.
FOLLOWS = """\
#include <kilolib.h>
static message_t message;
static volatile uint8_t fresh;
static uint8_t age = 255;
static message_t *on_transmit(void) { return IS_LEADER ? &message : 0; }
static void on_message(message_t *m, distance_measurement_t *d) {
    (void)d;
    if (m->type == 9 && m->data[0] == 0xA7 && m->data[5] == 0x3C) fresh = 1;
}
static void setup(void) {
    message.type = 9;
    message.data[0] = 0xA7;
    message.data[5] = 0x3C;
    message.crc = message_crc(&message);
}
static void loop(void) {
    if (fresh) { fresh = 0; age = 0; }
    else if (age < 255) age++;
    set_color(age < 48 ? RGB(0, 1, 0) : RGB(1, 0, 0));
}
int main(void) {
    kilo_init();
    kilo_message_tx = on_transmit;
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
"""


@pytest.mark.parametrize("leader", ["kilo_uid == 1", "kilo_uid == 2", "0"])
def test_a_twin_gets_what_robots_of_the_run_got(
    kilotwin: Kilotwin, tmp_path: Path, leader: str
) -> None:
    """Messages by chance lead no robot to what begins with another kind's message."""
    experiment = written(tmp_path, FOLLOWS.replace("IS_LEADER", leader))
    experiment.write_text(experiment.read_text().replace("diameter_m = 0.5", "diameter_m = 0.15"))
    line = said(kilotwin, experiment)
    if leader == "0":
        assert line.startswith(AGREES)
        return
    assert line.startswith("twin differs: program.c, first at tick ")
    assert "with the messages that robot " in line
    port = kilotwin("port", tmp_path / "program.c", "--time", "5", expect=1)
    assert "with the messages that robot " in port.stdout
    assert "[differs-in-passes]" in port.stdout
