"""The engine's input, and that CONFIG says what wire.h says."""

import hashlib
from pathlib import Path
from typing import Any, get_args

import pytest
from annotated_types import Ge, Le

from kilotwin import _emulator
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.controller import (
    CONTROLLER_DEFAULTS,
    READING_DEFAULTS,
    Controller,
    Reading,
)
from kilotwin.experiment.spec.engine import commands, config_messages, engine_spec
from kilotwin.experiment.spec.parameter_block import config_values
from kilotwin.programs.native.guest import build

from ..conftest import INFORMED, SMALL, Load

# The hex has no robot's role; the range of the messages decides.
NOT_SENT_TO_ALL = {"INFORMED_SITE"}


def controller(profile: str, **changes: Any) -> Controller:
    defaults = CONTROLLER_DEFAULTS[profile]
    window = {"neighbour_timeout_s": defaults["neighbour_window_s"]}
    return Controller.model_validate({**window, **defaults, **changes})


def reading(profile: str, **changes: Any) -> Reading:
    return Reading.model_validate({**READING_DEFAULTS[profile], **changes})


def test_config_covers_every_key_of_the_wire() -> None:
    keys = set(config_values(controller("foot-bot"), reading("foot-bot")))
    assert keys == set(_emulator.CONFIG_KEYS) - NOT_SENT_TO_ALL


def test_the_hosts_defaults_of_a_kilobot_are_the_firmwares() -> None:
    values = config_values(controller("kilobot"), reading("kilobot"))
    assert values == {name: _emulator.CONFIG_KEYS[name][1] for name in values}


def least_and_most(model: type[Controller] | type[Reading], key: str) -> tuple[Any, Any]:
    field = model.model_fields[key]
    least = next(limit.ge for limit in field.metadata if isinstance(limit, Ge))
    most = next(limit.le for limit in field.metadata if isinstance(limit, Le))
    return least, most


@pytest.mark.parametrize(
    "key", [name for name, field in Controller.model_fields.items() if field.metadata]
)
def test_what_the_schema_allows_the_firmware_takes(key: str) -> None:
    for limit in least_and_most(Controller, key):
        values = config_values(controller("kilobot", **{key: limit}), reading("kilobot"))
        for name, value in values.items():
            _, _, least, most = _emulator.CONFIG_KEYS[name]
            assert least <= value <= most, (name, limit)


@pytest.mark.parametrize(
    "key", ["signal_from", "entry_obstacle", "firat_join", "update_clock", "pushed_off"]
)
def test_choices_are_numbered_in_the_order_of_the_schema(key: str) -> None:
    choices = get_args(Reading.model_fields[key].annotation)
    sent = [
        config_values(controller("foot-bot"), reading("foot-bot", **{key: choice}))[key.upper()]
        for choice in choices
    ]
    assert sent == list(range(len(choices)))
    assert sent[-1] == _emulator.CONFIG_KEYS[key.upper()][3]


@pytest.mark.parametrize(("profile", "sent"), [("foot-bot", 0), ("kilobot", 1)])
def test_a_kilobot_pushed_off_its_site_walks_a_foot_bot_stays(
    load: Load, profile: str, sent: int
) -> None:
    keys = load(SMALL + INFORMED, f"swarm.profile={profile}").keys
    assert keys.controller is not None
    assert config_values(keys.controller, keys.reading)["PUSHED_OFF"] == sent


def test_config_is_one_message_a_tick_and_over_before_run(load: Load) -> None:
    experiment = load(SMALL + INFORMED, "swarm.informed=0.5")
    *configs, run = commands(experiment)
    ticks = [tick for tick, *_ in configs]
    assert ticks == list(range(-1 - len(configs), -1))
    assert run == (0, 0, 0xFFFF, bytes(9) + b"\x88", None)


def test_each_informed_robot_is_told_its_site_once(load: Load) -> None:
    messages = config_messages(load(SMALL + INFORMED, "swarm.informed=0.5"))
    key = _emulator.CONFIG_KEYS["INFORMED_SITE"][0]
    told = [(first, last, message[5]) for first, last, message in messages if message[4] == key]
    assert told == [(1, 4, 1), (5, 5, 2)]


def test_a_message_is_as_the_wire_says(load: Load) -> None:
    messages = config_messages(load(f"{SMALL}\n[controller]\n"))
    beta = next(m for _, _, m in messages if m[4] == _emulator.CONFIG_KEYS["BETA"][0])
    expected = b"\x00\x00\xff\xff\x03" + (147_456).to_bytes(4, "little") + b"\x03"
    assert beta == expected


def test_without_a_controller_robots_hear_only_run(load: Load) -> None:
    assert [tick for tick, *_ in commands(load())] == [0]


def test_the_spec_holds_what_the_engine_needs(load: Load) -> None:
    experiment = load(SMALL, "reading.line_of_sight=false", "seed=9")
    spec = engine_spec(experiment, ["/guest.so"], sample_ticks=305, black_box=None)
    assert spec["seed"] == 9
    round_arena = {"shape": "circle", "width_m": 4.0, "height_m": 4.0, "blocks_light": False}
    assert spec["arena"] == round_arena
    assert spec["sites"][1] == {
        "shape": "circle",
        "width_m": 1.0,
        "height_m": 1.0,
        "centre_m": [1.0, 0.0],
    }
    assert spec["medium"] == {"kind": "ideal", "range_m": 0.8, "line_of_sight": False}
    assert spec["floor"] == {"obstacle_m": 0.05, "step_ticks": 3, "repeat_ticks": 16}
    assert spec["groups"] == [
        {"program": "/guest.so", "name": "blink", "count": 10, "tier": "native", "poses": None}
    ]


def test_the_engine_takes_the_spec_and_samples_in_time(load: Load) -> None:
    simulation = simulate(load(f"{SMALL}\n[controller]\n"), [1000])
    assert simulation.tick == 1000
    # Of the world's steps, the first at or after each sample's time.
    assert simulation.samples()["tick"].tolist() == [0, 306, 610, 916]


def test_how_often_the_host_looks_changes_nothing(load: Load) -> None:
    experiment = load(f"{SMALL}\n[controller]\n", "swarm.program=firmware/aggregation")
    once = simulate(experiment, [3000])
    often = simulate(experiment, [1, 2, 7, 90, 900, 1000, 1000])
    assert often.tick == once.tick == 3000
    assert often.final_hash() == once.final_hash()
    assert once.samples()["x_m"].tobytes() == often.samples()["x_m"].tobytes()


def simulate(experiment: Experiment, chunks: list[int]) -> _emulator.Simulation:
    """The real engine with this experiment, advanced chunk by chunk."""
    guests = [str(build(group.program).file) for group in experiment.groups]
    simulation = _emulator.Simulation(
        engine_spec(experiment, guests, sample_ticks=305, black_box=None)
    )
    for chunk in chunks:
        simulation.advance(min(chunk, sum(chunks) - simulation.tick))
    return simulation


def small_spec(load: Load) -> dict[str, Any]:
    experiment = load(f"{SMALL}\n[controller]\n", "swarm.program=firmware/aggregation")
    guests = [str(build(group.program).file) for group in experiment.groups]
    return engine_spec(experiment, guests, sample_ticks=305, black_box=None)


def test_the_engine_has_no_default_for_any_key(load: Load) -> None:
    spec = small_spec(load)
    tables = {"": spec, **{f"{key}.": spec[key] for key in ("profile", "floor", "medium", "light")}}
    for path, table in tables.items():
        for key in list(table):
            value = table.pop(key)
            with pytest.raises(_emulator.EngineError, match=f"lacks {path}{key}$"):
                _emulator.Simulation(spec)
            table[key] = value
    _emulator.Simulation(spec)


def test_the_engine_names_a_key_that_it_does_not_know(load: Load) -> None:
    spec = small_spec(load)
    spec["medium"]["lost"] = 0.1
    with pytest.raises(_emulator.EngineError, match=r"unknown medium\.lost"):
        _emulator.Simulation(spec)


def test_the_engine_names_a_value_of_a_wrong_type(load: Load) -> None:
    spec = small_spec(load)
    spec["profile"]["radius_m"] = "wide"
    with pytest.raises(_emulator.EngineError, match=r"wrong profile\.radius_m"):
        _emulator.Simulation(spec)


def test_walls_and_obstacles_are_handed_on_as_written(load: Load) -> None:
    text = SMALL.replace(
        "diameter_m = 4.0",
        'shape = "polygon"\npoints_m = [[-2, -2], [2, -2], [2, 2], [-2, 2]]',
        1,
    )
    text += (
        "\n[[obstacle]]\ncentre_m = [0, 0.5]\ndiameter_m = 0.2\nblocks_light = false\n"
        '\n[[obstacle]]\nshape = "polygon"\nheading_rad = 1\n'
        "points_m = [[0, 0], [0.2, 0], [0, 0.2]]\n"
    )
    spec = engine_spec(load(text), ["guest.so"], sample_ticks=32, black_box=None)
    corners = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]
    assert spec["arena"] == {"shape": "polygon", "points_m": corners, "blocks_light": True}
    assert spec["obstacles"] == [
        {
            "shape": "circle",
            "width_m": 0.2,
            "height_m": 0.2,
            "centre_m": [0.0, 0.5],
            "heading_rad": 0.0,
            "blocks_light": False,
        },
        {
            "shape": "polygon",
            "points_m": [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2]],
            "centre_m": [0.0, 0.0],
            "heading_rad": 1.0,
            "blocks_light": True,
        },
    ]


@pytest.mark.parametrize(
    ("name", "digest"),
    [
        ("paper/simplified-n100", "c732383a88fe5942"),
        ("paper/firat-n50", "4d76ebb960bc3894"),
        ("kilogrid/paper-n50", "9d6f60814935dc5d"),
    ],
)
def test_robots_of_the_papers_experiments_are_told_what_they_ever_were(
    name: str, digest: str
) -> None:
    """All bytes of CONFIG; digests are those of the host before its parameters were a block."""
    experiment = Experiment.load(Path(__file__).parents[3] / f"experiments/{name}.toml")
    told = repr(config_messages(experiment)).encode()
    assert hashlib.sha256(told).hexdigest()[:16] == digest
