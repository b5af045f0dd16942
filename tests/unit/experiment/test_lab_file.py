"""A lab's file, and experiments whose robots are that lab's."""

from collections.abc import Callable
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.lab_file import parse_lab, read_lab
from kilotwin.experiment.spec.engine import commands, engine_spec

Load = Callable[..., Experiment]

LOW = [900 - 60 * i for i in range(14)]
LAB = f"""
[robot.12]
turn_left = 65
straight_left = 70
motors = {{ at = 2026-11-24T12:00:00, how = "by hand" }}

[robot.3]
straight_right = 80
low_gain = {LOW}
high_gain = {[min(5 * gain, 1023) for gain in LOW]}

[robot.40]
"""
SWARM = """
duration_s = 10
arena = {diameter_m = 1.0}
[swarm]
profile = "kilobot"
program = "firmware/blank.c"
size = 2
lab = "lab.toml"
"""


def test_robots_come_in_the_order_of_their_uids() -> None:
    lab = parse_lab(LAB, Path("lab.toml"))
    assert list(lab.robots) == [3, 12, 40]
    assert lab.robots[12].turn_left == 65
    assert lab.robots[12].turn_right is None
    assert lab.robots[12].motors is not None
    assert lab.robots[12].motors.how == "by hand"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[robot.12]\nturn_left = 300", "lab.toml:2: robot.12.turn_left is 300; it must be"),
        (
            "[robot.12]\nturn_lef = 30",
            "lab.toml:2: unknown key 'turn_lef' in [robot.12]; did you mean 'turn_left'?",
        ),
        ("\n[robot.x]\n", "lab.toml:2: 'x' is no uid; write [robot.N] with N from 0 to 65535"),
        ("[robot.65536]\n", "lab.toml:1: '65536' is no uid"),
        ("[robot.007]\n", "lab.toml:1: '007' is no uid"),
        ("[robot.1]\nlow_gain = [1, 2]", "lab.toml:2: robot.1.low_gain"),
        (f"[robot.1]\nhigh_gain = {LOW}", "lab.toml:2: 'high_gain' needs 'low_gain' beside it"),
        (
            f"[robot.1]\nhigh_gain = {LOW}\nlow_gain = [\n  900, 840,\n  850, {LOW[3:]}".replace(
                "850, [", "850, "
            ),
            "lab.toml:5: low_gain rises from 840 to 850; readings fall with the distance",
        ),
        ("[robot.1]\nmotors = 3", "lab.toml:2: robot.1.motors is 3"),
        ("[robot.1", "lab.toml:1: not valid TOML"),
        ("robots = 1", "lab.toml:1: unknown key 'robots'"),
    ],
)
def test_a_mistake_is_named_with_its_line(text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_lab(text, Path("lab.toml"))
    assert str(caught.value).startswith(says)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_lab(tmp_path / "none.toml")


def test_an_experiments_robots_are_the_labs_with_the_lowest_uids(
    load: Load, tmp_path: Path
) -> None:
    (tmp_path / "lab.toml").write_text(LAB)
    experiment = load(SWARM)
    assert [experiment.uid_of(index) for index in range(2)] == [3, 12]
    spec = engine_spec(experiment, ["/guest.so"], sample_ticks=305, black_box=None)
    first, second = spec["lab"]
    assert (first["uid"], first["straight_right"], first["low_gain"]) == (3, 80, LOW)
    assert (second["uid"], second["turn_left"], second["low_gain"]) == (12, 65, None)
    assert second["straight_left"] == 70
    assert second["turn_right"] == spec["profile"]["turn_right"]
    resolved = Experiment.of(experiment.origin).resolved()
    assert resolved["swarm"]["lab"].endswith("lab.toml")


def test_a_command_for_a_robot_is_for_its_uid_in_the_lab(load: Load, tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(LAB)
    command = '[[command]]\nat_s = 1\nsend = "run"\nrobot = 12\n'
    assert [(first, last) for _, first, last, _, _ in commands(load(SWARM + command))] == [(12, 12)]


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("swarm.size=4", "has 3 robots, for 4; take fewer robots"),
        ("swarm.lab=none.toml", "'none.toml' is not there; name a file"),
    ],
)
def test_a_lab_that_does_not_fit_is_refused(
    load: Load, tmp_path: Path, setting: str, says: str
) -> None:
    (tmp_path / "lab.toml").write_text(LAB)
    with pytest.raises(InputError, match=says):
        load(SWARM, setting)


def test_informed_robots_need_the_first_uids(load: Load, tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(LAB)
    site = '[[site]]\nname = "a"\ncentre_m = [0.0, 0.0]\ndiameter_m = 0.2\n[controller]\n'
    with pytest.raises(InputError, match="informed robots need the uids 1 to 1"):
        load(SWARM + "informed = 0.5\ninformed_for = {a = 1.0}\n" + site)


GAINS = "[[33, 900, 1023], [63, 600, 903], [98, 250, 553]]"
MEASURED = f"""duration_s = 1
[arena]
diameter_m = 1
[swarm]
profile = "kilobot"
program = "blink.c"
size = 2
gains = {GAINS}
"""


def test_a_few_readings_are_one_table_for_all_robots(load: Load) -> None:
    (first, one), (second, other) = load(MEASURED).lab
    assert (first, second) == (1, 2)
    assert one.low_gain == [900 - 50 * step for step in range(7)] + [550 - 50 * k for k in range(7)]
    assert one.high_gain == [1023 - 20 * k for k in range(7)] + [853 - 50 * k for k in range(7)]
    assert other == one
    assert one.turn_left is None


def test_robots_keep_the_tables_of_their_lab(load: Load, folder: Path) -> None:
    (folder / "lab.toml").write_text(LAB)
    lab = dict(load(MEASURED.replace("size = 2", 'size = 2\nlab = "lab.toml"')).lab)
    assert lab[3].low_gain == LOW
    assert lab[12].low_gain is not None
    assert lab[12].low_gain[:2] == [900, 850]
    assert lab[12].turn_left == 65


@pytest.mark.parametrize(
    ("gains", "said"),
    [
        ("[[60, 600, 900], [33, 500, 800]]", "33 mm comes after 60 mm; write the nearest"),
        ("[[33, 600, 900], [60, 700, 800]]", "a reading rises from 33 to 60 mm"),
        ("[[33, 600, 900], [60, 500, 901]]", "a reading rises from 33 to 60 mm"),
        ("[[33, 600, 900]]", "gains has 1 item; it must have at least 2"),
        ("[[33, 600], [60, 500]]", "has 2 items; it must have 3"),
    ],
)
def test_readings_that_cannot_be_are_refused(gains: str, said: str, load: Load) -> None:
    with pytest.raises(InputError, match=said):
        load(MEASURED.replace(GAINS, gains))
