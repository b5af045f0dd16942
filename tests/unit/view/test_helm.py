"""A wish of a page becomes an order in the experiment's own terms, or a line that says why not."""

from pathlib import Path
from typing import Any

import pytest

from kilotwin.errors import InputError
from kilotwin.view.helm import Helm, helm_of

from ..conftest import GRID, INFORMED, SMALL
from ..known_run import Begin

WIRE = """\
type = 5
[parameter.step_s]
kind = "seconds"
byte = 0
most = 60
default = 3.3
[parameter.turns]
kind = "whole"
bytes = 1
byte = 2
default = 64
"""


@pytest.fixture
def helm(begin: Begin) -> Helm:
    return Helm(begin(text=SMALL + INFORMED).folder)


def test_a_command_is_the_message_that_the_experiment_would_send(helm: Helm) -> None:
    order = helm.order({"do": "command", "keys": {"send": "pause", "robot": 3}})
    assert order["do"] == "send"
    assert order["messages"] == [{"data": [0] * 9 + [0x85], "uid_first": 3, "uid_last": 3}]
    assert order["told"] == "[[command]] send = pause, robot = 3"
    near = {"send": "user", "type": 7, "data": [1, 2], "centre_m": [0.5, 0.0], "within_m": 0.2}
    (message,) = helm.order({"do": "command", "keys": near})["messages"]
    assert message["data"] == [1, 2, 0, 0, 0, 0, 0, 0, 0, 7]
    assert message["region"] == [0.5, 0.0, 0.2]


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"send": "jump"}, 'send is "jump"'),
        ({}, "send"),
        ({"send": "pause", "robot": 11}, "robots"),
        ({"send": "pause", "at_s": 3}, "acts now"),
        ({"send": "user"}, "type"),
    ],
)
def test_a_command_that_no_experiment_may_have_is_refused(
    helm: Helm, keys: dict[str, Any], why: str
) -> None:
    with pytest.raises(InputError, match=why):
        helm.order({"do": "command", "keys": keys})


def test_a_parameter_is_told_by_what_changes_and_is_remembered(helm: Helm) -> None:
    assert helm.offers()["parameters"]["controller.beta"] == 2.25
    order = helm.order({"do": "set", "setting": "controller.beta=1.5"})
    assert len(order["messages"]) == 1
    assert order["told"] == "controller.beta=1.5"
    assert helm.offers()["parameters"]["controller.beta"] == 1.5
    with pytest.raises(InputError, match="have been told so"):
        helm.order({"do": "set", "setting": "controller.beta=1.5"})


def test_a_programs_own_parameters_go_by_its_wire(begin: Begin, tmp_path: Path) -> None:
    (tmp_path / "own.wire.toml").write_text(WIRE)
    text = SMALL + 'wire = "own.wire.toml"\n[parameters]\nturns = 3\n'
    helm = Helm(begin(text=text).folder)
    assert helm.offers()["parameters"] == {"parameters.step_s": 3.3, "parameters.turns": 3}
    (message,) = helm.order({"do": "set", "setting": "parameters.turns=200"})["messages"]
    assert message["data"] == [101, 0, 200, 0, 0, 0, 0, 0, 0, 5]
    with pytest.raises(InputError, match="turns"):
        helm.order({"do": "set", "setting": "parameters.turns=300"})
    with pytest.raises(InputError, match="in mid-run"):
        helm.order({"do": "set", "setting": "swarm.size=3"})


def test_on_a_kilogrid_robots_are_told_nothing_but_through_its_host(begin: Begin) -> None:
    helm = Helm(begin(text=GRID).folder)
    assert helm.offers() == {"grid": True, "commands": [], "parameters": {}}
    assert helm.order({"do": "grid", "order": "pause"}) == {"do": "grid", "order": "pause"}
    with pytest.raises(InputError, match="pause and to resume"):
        helm.order({"do": "command", "keys": {"send": "pause"}})


@pytest.mark.parametrize("asked", [{}, {"do": "look"}, {"do": ["pause"]}, {"do": "command"}])
def test_what_a_run_cannot_be_asked_is_refused(helm: Helm, asked: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="nothing that a run can be asked"):
        helm.order(asked)


def test_a_run_whose_program_is_gone_is_only_seen(begin: Begin) -> None:
    folder = begin().folder
    text = (folder / "experiment.toml").read_text()
    (folder / "experiment.toml").write_text(text.replace("blink.c", "gone.c"))
    assert helm_of(folder) is None
