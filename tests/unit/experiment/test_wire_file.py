"""A declaration of parameters is checked, and what it says is what robots are sent."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec.engine import commands, config_differences
from kilotwin.experiment.wire_file import read_wire, wire_table
from kilotwin.studies.search.space import parse_axes, whole_numbers_of
from kilotwin.units import TICK_S

from ..conftest import DECLARED, GIVEN, GRID, SMALL, WIRE, Load


@pytest.fixture
def wire(folder: Path) -> Path:
    (folder / "my.wire.toml").write_text(WIRE)
    return folder / "my.wire.toml"


def sent(experiment: Experiment) -> list[bytes]:
    return [message for *_, message, _ in commands(experiment)[:-1]]


def test_all_parameters_are_in_one_message_before_run(load: Load, wire: Path) -> None:
    experiment = load(GIVEN, "parameters.way=right", "parameters.step_s=6")
    number = round(6 / TICK_S)
    expected = number.to_bytes(2, "little") + b"\xfe\xff" + bytes([128, 1, 0, 0, 1, 5])
    assert commands(experiment)[0] == (-2, 0, 0xFFFF, expected, None)
    assert len(commands(experiment)) == 2


def test_parameters_with_a_key_have_a_message_each(load: Load, wire: Path) -> None:
    wire.write_text(
        'type = 3\n[parameter.a]\nkind = "real"\nscale = 65536\nkey = 3\ndefault = 2.25\n'
        '[parameter.b]\nkind = "whole"\nkey = 7\ndefault = 70000\n'
    )
    heads = [b"\0\0\xff\xff\x03", b"\0\0\xff\xff\x07"]
    numbers = [(147_456).to_bytes(4, "little"), (70_000).to_bytes(4, "little")]
    expected = [head + number + b"\x03" for head, number in zip(heads, numbers, strict=True)]
    assert sent(load(DECLARED)) == expected


def test_they_come_behind_those_of_aggregation(load: Load, wire: Path) -> None:
    alone = sent(load(f"{SMALL}\n[controller]\n"))
    both = sent(load(f"{GIVEN}\n[controller]\n"))
    assert both[:-1] == alone
    assert both[-1][-1] == 5


def test_robots_of_a_grid_are_told_by_its_modules(load: Load, wire: Path) -> None:
    text = GRID.replace("size = 5", 'size = 5\nwire = "my.wire.toml"\n[parameters]\noffset = 1\n')
    without = config_differences(load(GRID))
    assert config_differences(load(text))[: len(without)] == without
    assert config_differences(load(text))[-1][-1] == 5


def test_the_resolved_experiment_has_every_parameter_and_means_the_same(
    load: Load, wire: Path, folder: Path
) -> None:
    experiment = load(GIVEN)
    expected = {"step_s": 3.0, "offset": -2, "share": 0.5, "bold": True, "way": "left"}
    assert experiment.resolved()["parameters"] == expected
    (folder / "again.toml").write_text(experiment.to_toml())
    again = Experiment.load(folder / "again.toml")
    assert again.identity() == experiment.identity()
    assert load(GIVEN, "parameters.share=0.4").identity() != experiment.identity()


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["parameters.ofset=1"], "unknown key 'ofset' in [parameters]; did you mean 'offset'?"),
        (["parameters.offset=6"], "parameters.offset is 6; it must be from -5 up to 5"),
        (["parameters.offset=1.5"], "parameters.offset is 1.5; it must be a whole number"),
        (["parameters.step_s=61"], "parameters.step_s is 61; it must be from 0 up to 60"),
        (["parameters.way=up"], 'parameters.way is "up"; allowed: left, right'),
        (["parameters.bold=1"], "parameters.bold is 1; it must be true or false"),
        (["swarm.wire=nowhere.toml"], "'nowhere.toml' is not there; name a file"),
    ],
)
def test_a_wrong_parameter_is_told_in_the_words_of_all_keys(
    settings: list[str], told: str, load: Load, wire: Path
) -> None:
    with pytest.raises(InputError) as error:
        load(GIVEN, *settings)
    assert told in str(error.value)
    assert str(error.value).startswith(f"--set {settings[0]}: ")


def test_a_parameter_without_a_default_must_be_given(load: Load, wire: Path) -> None:
    with pytest.raises(InputError, match=r"\[parameters\] lacks 'offset'; add offset = \.\.\."):
        load(DECLARED)


def test_parameters_of_no_program_are_refused(load: Load) -> None:
    with pytest.raises(InputError, match=r"small\.toml:\d+: which program's\? Add swarm\.wire"):
        load(f"{SMALL}\n[parameters]\na = 1\n")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("byte = 2", "byte = 1", "my.wire.toml:11: byte 1 is one of step_s; take another"),
        ("byte = 8", "byte = 8\nkey = 3", "where is it on air? Give it either 'byte' or 'key'"),
        ("byte = 8", "", "where is it on air? Give it either 'byte' or 'key'"),
        ("most = 60", "most = 6000", "most is 6000, whose number does not fit into 2 bytes"),
        ("most = 5\n", "most = -6\n", "most is -6, below least (-5)"),
        ("default = 3.0", "default = 99.0", "default is 99.0, which step_s may not be"),
        ('default = "left"', 'default = "up"', "default is 'up', which way may not be"),
        ('choices = ["left", "right"]', "", "'choices' goes with kind = \"choice\""),
        ("byte = 2", "byte = 2\nscale = 3", "a whole number is sent as it is"),
        ("bytes = 1\nbyte = 8", "bytes = 2\nbyte = 8", "2 bytes from byte 8 on; a message has 9"),
        ('kind = "real"', 'kind = "float"', 'parameter.share.kind is "float"; allowed: whole'),
        ("type = 5", "type = 200", "type is 200; it must be from 0 up to 127"),
        ("[parameter.bold]", '[parameter."so bold"]', "'so bold' is no name"),
    ],
)
def test_a_wrong_declaration_is_told_with_its_line(
    old: str, new: str, told: str, wire: Path
) -> None:
    assert WIRE.count(old) == 1 or old == "byte = 2"
    wire.write_text(WIRE.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        read_wire(wire)
    assert told in str(error.value)
    assert "my.wire.toml:" in str(error.value)


def test_two_parameters_may_not_share_a_key(wire: Path) -> None:
    one = 'kind = "whole"\nkey = 3\n'
    wire.write_text(f"type = 3\n[parameter.a]\n{one}[parameter.b]\n{one}")
    with pytest.raises(InputError, match="key 3 is that of a; take another"):
        read_wire(wire)


def test_a_search_tries_whole_numbers_where_the_declaration_wants_them(
    load: Load, wire: Path, folder: Path
) -> None:
    load(GIVEN)
    texts = ["parameters.offset=-5..5", "parameters.step_s=1..9", "swarm.size=1..4"]
    axes = parse_axes(texts, whole_numbers_of(folder / "small.toml"))
    assert [axis.whole for axis in axes] == [True, False, True]


def test_the_table_for_a_labs_page_has_ranges_defaults_and_meanings(wire: Path) -> None:
    rows = wire_table(read_wire(wire)).splitlines()
    assert rows[2] == "| `parameters.step_s` | number from 0 up to 60 | `3.0` | s | how long |"
    assert rows[3] == "| `parameters.offset` | whole number from -5 up to 5 | must be given |  |  |"
    assert rows[5] == "| `parameters.bold` | true, false | `true` |  |  |"
    assert rows[6] == '| `parameters.way` | `"left"`, `"right"` | `"left"` |  |  |'
