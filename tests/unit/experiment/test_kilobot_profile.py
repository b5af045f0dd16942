"""Experiments with Kilobots: defaults of the profile, their own tables, what the engine is told."""

import pytest

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.medium import MEDIUM_DEFAULTS
from kilotwin.experiment.schema.profile_defaults import PROFILES, motion_defaults
from kilotwin.experiment.spec.engine import engine_spec

from ..conftest import SMALL, Load

KILOBOT = SMALL.replace('"foot-bot"', '"kilobot"')


def spec_of(experiment: Experiment) -> dict[str, object]:
    return engine_spec(experiment, ["/guest.so"], sample_ticks=305, black_box=None)


def test_a_kilobot_has_legs_noise_and_real_infrared(load: Load) -> None:
    keys = load(KILOBOT).keys
    assert keys.motion is not None
    assert keys.motion.model_dump() == motion_defaults(PROFILES["kilobot"])
    assert keys.medium.model_dump() == {"kind": "kilobot", "range_m": 0.1, **MEDIUM_DEFAULTS}
    assert keys.engine.step_ticks == 4
    assert not keys.swarm.floor


def test_the_engine_is_told_all_of_it(load: Load) -> None:
    text = f"{KILOBOT}\n[battery]\nhours = 2\n[light]\nambient = 50\n"
    text += "[[light.source]]\nat_m = [1, 0]\npeak = 800\nhalf_m = 0.2\n"
    spec = spec_of(load(text, "medium.carrier_sense=false", "temperature=280"))
    assert spec["profile"] == {
        "radius_m": 0.0165,
        "speed_m_s": 0.0103,
        "turn_rad_s": 0.785,
        "straight_left": 65,
        "straight_right": 65,
        "turn_left": 70,
        "turn_right": 70,
        "push_m_s2": 0.1,
        "mass_kg": 0.01,
        "legs": True,
        "kick_needed": True,
        "gives_way": True,
        "speed_spread": 0.2,
        "bias_spread": 0.2,
        "motor_noise": 0.16,
    }
    medium = {"kind": "kilobot", "range_m": 0.1, **MEDIUM_DEFAULTS, "carrier_sense": False}
    assert spec["medium"] == medium
    assert spec["floor"] is None
    sources = [{"at_m": [1.0, 0.0], "peak": 800, "half_m": 0.2}]
    lamps = {"ambient": 50, "sources": sources, "picture": None, "white": 0.0}
    assert spec["light"] == lamps
    assert spec["battery_h"] == 2
    assert spec["readings"] == {"temperature": 280}


@pytest.mark.parametrize(
    ("text", "settings", "sample_s"),
    [
        (KILOBOT, ["duration_s=3600"], 1.0),
        (KILOBOT, ["duration_s=300"], 0.25),
        (KILOBOT, ["duration_s=300", "record.sample_s=7"], 7.0),
        (SMALL, ["duration_s=60"], 10.0),
    ],
)
def test_kilobots_are_sampled_each_second_and_more_often_in_a_short_run(
    load: Load, text: str, settings: list[str], sample_s: float
) -> None:
    assert load(text, *settings).keys.record.sample_s == sample_s


def test_a_foot_bot_moves_without_noise(load: Load) -> None:
    profile = spec_of(load())["profile"]
    assert isinstance(profile, dict)
    assert not profile["legs"]
    assert profile["speed_m_s"] == 0.1
    assert [profile[key] for key in ("speed_spread", "bias_spread", "motor_noise")] == [0, 0, 0]


@pytest.mark.parametrize(("profile", "floor"), [("foot-bot", False), ("kilobot", True)])
def test_the_floor_can_be_chosen(load: Load, profile: str, floor: bool) -> None:
    settings = [f"swarm.profile={profile}", f"swarm.floor={str(floor).lower()}"]
    assert (spec_of(load(SMALL, *settings))["floor"] is not None) == floor


def test_kilobots_may_have_the_ideal_medium(load: Load) -> None:
    spec = spec_of(load(KILOBOT, "medium.kind=ideal"))
    assert spec["medium"] == {"kind": "ideal", "range_m": 0.1, "line_of_sight": True}


def test_foot_bots_may_have_the_real_infrared(load: Load) -> None:
    keys = load(SMALL, "medium.kind=kilobot").keys
    assert keys.medium.loss == MEDIUM_DEFAULTS["loss"]


def test_a_program_may_be_several_files(load: Load) -> None:
    text = KILOBOT.replace('program = "blink.c"\nsize = 10\n', "")
    text += '[[robots]]\nprogram = ["blink.c", "more.c"]\ninclude = ["."]\ndefine = ["N=3"]\n'
    experiment = load(f"{text}count = 2\n", "robots.0.program=blink.c")
    assert experiment.groups[0].program.name == "blink"
    (experiment.origin.folder / "more.c").write_text("int more;\n")
    experiment = load(f"{text}count = 2\n")
    program = experiment.groups[0].program
    assert [source.name for source in program.sources] == ["blink.c", "more.c"]
    assert program.defines == ("N=3",)
    assert program.include_folders == (experiment.origin.folder.resolve(),)
    assert load(experiment.to_toml()).resolved() == experiment.resolved()


@pytest.mark.parametrize("text", [SMALL, KILOBOT])
def test_a_resolved_experiment_means_the_same(load: Load, text: str) -> None:
    text += '[[command]]\nat_s = 3\nsend = "user"\ntype = 4\ndata = [1]\n'
    first = load(text)
    again = load(first.to_toml())
    assert again.resolved() == first.resolved()
    assert again.identity() == first.identity()
