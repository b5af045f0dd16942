"""Meaning of an LED, and which robots count as resting on a site."""

import numpy as np
import pytest

from kilotwin.experiment.colours import LED_COLOURS, led_byte, led_rgb
from kilotwin.experiment.states import States, count

from ..conftest import SMALL, Load

WITH_CONTROLLER = f"{SMALL}\n[controller]\n"


@pytest.mark.parametrize(
    ("led", "state"),
    [
        (0x00, "walking"),
        (0x15, "entering"),
        (0x3F, "resting"),
        (0x04, "leaving"),
        (0x01, "avoiding"),
    ],
)
def test_the_colours_of_aggregation_have_names(load: Load, led: int, state: str) -> None:
    states = States.of(load(WITH_CONTROLLER).keys)
    assert states.names[states.of_led[led]] == state


def test_a_colour_without_a_name_is_called_by_its_numbers(load: Load) -> None:
    states = States.of(load(WITH_CONTROLLER).keys)
    assert states.names[states.of_led[led_byte(3, 0, 1)]] == "RGB(3,0,1)"


def test_without_controller_and_states_colours_mean_nothing(load: Load) -> None:
    states = States.of(load().keys)
    assert states.known == 0
    assert states.names[states.of_led[0x3F]] == "RGB(3,3,3)"


def test_an_experiment_names_its_own_states(load: Load) -> None:
    states = States.of(load(SMALL, "states.resting=blue", "states.busy=[3,0,1]").keys)
    assert states.names[: states.known] == ["resting", "busy"]
    assert states.of_led[led_byte(0, 0, 1)] == states.resting


def test_every_led_byte_has_a_state(load: Load) -> None:
    states = States.of(load(WITH_CONTROLLER).keys)
    assert len(set(states.of_led.tolist())) == len(states.names) == 64
    led = np.arange(256, dtype=np.uint8)
    assert np.array_equal(states.of_robots(led), np.tile(states.of_led, 4))


def test_led_bytes_are_those_of_the_kilobot_api() -> None:
    assert [led_byte(*LED_COLOURS[name]) for name in ("red", "green", "white", "bright-white")] == [
        0x01,
        0x04,
        0x15,
        0x3F,
    ]
    assert all(led_byte(*led_rgb(led)) == led for led in range(64))


def test_resting_on_a_site_takes_the_led_and_the_place(load: Load) -> None:
    states = States.of(load(WITH_CONTROLLER).keys)
    resting, walking = 0x3F, 0x00
    led = np.array([[resting, resting, resting, walking], [walking] * 4], dtype=np.uint8)
    site = np.array([[1, 2, 0, 1], [1, 1, 1, 1]], dtype=np.uint8)
    counts = count(states, led, site, sites=2)
    assert counts.resting.tolist() == [[1, 1], [0, 0]]
    assert counts.not_resting.tolist() == [2, 4]
    assert counts.in_state[:, :3].tolist() == [[1, 0, 3], [4, 0, 0]]


def test_without_sites_nobody_rests_on_one(load: Load) -> None:
    states = States.of(load(WITH_CONTROLLER).keys)
    counts = count(states, np.full((1, 3), 0x3F, np.uint8), np.zeros((1, 3), np.uint8), sites=0)
    assert counts.resting.shape == (1, 0)
    assert counts.not_resting.tolist() == [3]
