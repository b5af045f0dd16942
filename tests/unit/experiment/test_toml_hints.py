"""A line that is no TOML is answered with the line to write."""

import json
import tomllib
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment

from ..conftest import SMALL, Load

LINES = [
    ("diameter_m = 4,5", "numbers have a point: write diameter_m = 4.5"),
    ("diameter_m = -4,25  # wide", "write diameter_m = -4.25"),
    ("diameter_m = 4.0 m", "its unit is that of the key's name: write diameter_m = 4.0"),
    ("speed = 10 mm/s", "write speed = 10"),
    ("diameter_m = .5", "write diameter_m = 0.5"),
    ("diameter_m = 4.", "write diameter_m = 4.0"),
    ("diameter_m = 007", "write diameter_m = 7"),
    ("floor = True", "write floor = true"),
    ("floor = no", "write floor = false"),
    ("diameter_m == 4", "write diameter_m = ..., with one ="),
    ("diameter_m = 4;", "write diameter_m = 4"),
    ("diameter_m 4", "write diameter_m = 4"),
    ("shape = circle", 'text has quotes: write shape = "circle"'),
    ("program = firmware/blank.c", 'write program = "firmware/blank.c"'),
    ("diameter_m =", "a value is missing behind diameter_m ="),
    ("[motion", "write [motion]"),
    ("[motion]]", "write [motion]"),
    ("[[site", "write [[site]]"),
    ("// wide", "a comment begins with #"),
    ("name = “mine”", 'write text in plain quotes: "..."'),
    ('name = "mine', "; text does not end with the quote that it began with"),
    ("name = 'mine", "in line 5 text does not end with the quote that it began with"),
    (r'program = "C:\Users\me.c"', "write / in a path"),
    ("diameter_m: 4", "this looks like YAML; an experiment is TOML: write diameter_m = 4"),
    ("shape: circle", 'write shape = "circle"'),
    ("motion:", "this looks like YAML; an experiment is TOML: write [motion]"),
    ("- robots: 4", "write robots = 4"),
    ("[swarm]\nx = 1", "all keys of a table stand below one heading; of several it is [[robots]]"),
    ("?", "mend this line"),
]


@pytest.mark.parametrize(("line", "advice"), LINES, ids=[line for line, _ in LINES])
def test_a_line_that_is_no_toml_is_answered_with_what_to_write(
    load: Load, line: str, advice: str
) -> None:
    text = SMALL.replace("diameter_m = 4.0", line, 1)
    assert text.splitlines()[4] == line.splitlines()[0]
    with pytest.raises(InputError) as refused:
        load(text)
    assert advice in str(refused.value)


@pytest.mark.parametrize("advice", [advice for _, advice in LINES if " = " in advice])
def test_the_line_that_is_advised_is_toml(advice: str) -> None:
    _, write, advised = advice.partition("write ")
    if write and "..." not in advised:
        assert len(tomllib.loads(advised)) == 1


@pytest.mark.parametrize("name", ["mine.json", "mine.toml"])
def test_json_is_answered_with_its_own_keys_as_toml(tmp_path: Path, name: str) -> None:
    tables = {"duration_s": 60, "arena": {"diameter_m": 4}, "swarm": {"profile": "kilobot"}}
    file = tmp_path / name
    file.write_text(json.dumps(tables, indent=2))
    with pytest.raises(InputError, match=r"this is JSON; an experiment is TOML: write duration_s"):
        Experiment.load(file)
    file.write_text('{"duration_s": 60,')
    with pytest.raises(InputError, match=r'this is JSON; .*: write name = "my run", and \[arena\]'):
        Experiment.load(file)


@pytest.mark.parametrize(
    ("setting", "what"),
    [
        ("site.name=x", "site is a list of 2; for its first type --set site.0.name=x (site.2 adds"),
        ("site.9.name=x", "for its first type --set site.0.name=x (site.2 adds one, site.1 is its"),
        ("site.0.centre_m.x=4", "site.0.centre_m is a list of 2; for its first type --set site.0"),
    ],
)
def test_a_setting_of_a_list_says_how_to_name_an_item(load: Load, setting: str, what: str) -> None:
    with pytest.raises(InputError) as refused:
        load(SMALL, setting)
    assert what in str(refused.value)
