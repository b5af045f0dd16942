"""The folder of a hunt: it goes on where it was stopped, and refuses what is another's."""

import json
import random
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.studies.hunt.corpus import Corpus
from kilotwin.studies.hunt.folder import STATE, Found, State, opened, with_paths
from kilotwin.studies.hunt.variation import Addition, Variation

ONE = Variation(seed=3).add(Addition(("step",), (("at_s", 1.0), ("ambient", 5.0))))
FOUND = Found(
    "no_crash = true",
    "walk.c",
    7,
    "robot 1 (walk) at 1.2 s: crash",
    "plain",
    12,
    ONE,
    Variation(),
    "found/1.toml",
    1,
    0.5,
    40,
)


def test_a_hunt_goes_on_with_all_that_it_knew(tmp_path: Path) -> None:
    state = State("it", 5, 3, 48, 2, corpus=Corpus([ONE], {(0, 64, 1), ("led", 0, 3)}))
    state.found.append(FOUND)
    state.moves["medium loss"] = 7
    state.write(tmp_path / "hunt")
    assert opened(tmp_path / "hunt", "it", 5) == state
    assert FOUND.key == ("no_crash = true", "walk.c", 7)


def test_a_new_folder_begins_a_new_hunt(tmp_path: Path) -> None:
    assert opened(tmp_path / "new", "it", 1) == State("it", 1)
    assert not (tmp_path / "new").exists()


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    State("it", 1).write(tmp_path / "hunt")
    with pytest.raises(InputError, match="of another experiment"):
        opened(tmp_path / "hunt", "other", 1)
    with pytest.raises(InputError, match="with --seed 1; give that"):
        opened(tmp_path / "hunt", "it", 2)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="holds something else"):
        opened(tmp_path, "it", 1)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 1, "seed": 1}'])
def test_a_damaged_state_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / STATE).write_text(text)
    with pytest.raises(InputError, match="damaged"):
        opened(tmp_path, "it", 1)


def test_a_state_of_another_version_is_refused(tmp_path: Path) -> None:
    State("it", 1).write(tmp_path)
    told = json.loads((tmp_path / STATE).read_text())
    (tmp_path / STATE).write_text(json.dumps({**told, "version": 0}))
    with pytest.raises(InputError, match="another experiment"):
        opened(tmp_path, "it", 1)


def test_a_scenario_names_files_from_its_own_folder(tmp_path: Path) -> None:
    tables = {
        "swarm": {"profile": "kilobot", "lab": "lab.toml"},
        "robots": [{"program": "walk.c", "include": ["inc"]}, {"hex": "a.hex", "count": 1}],
        "name": "program",
        "list": [1, 2],
        "floor": {"image": "firmware/floor.png"},
    }
    resolved = {
        "swarm": {"lab": str(tmp_path / "lab.toml")},
        "robots": [
            {"program": str(tmp_path / "walk.c"), "include": [str(tmp_path / "inc")]},
            {"hex": str(tmp_path / "a.hex")},
        ],
        "list": [1],
        "floor": {"image": "firmware/floor.png"},
    }
    moved = with_paths(tables, resolved, tmp_path / "found")
    assert moved == {
        "swarm": {"profile": "kilobot", "lab": "../lab.toml"},
        "robots": [
            {"program": "../walk.c", "include": ["../inc"]},
            {"hex": "../a.hex", "count": 1},
        ],
        "name": "program",
        "list": [1, 2],
        "floor": {"image": "firmware/floor.png"},
    }


def test_a_corpus_keeps_what_reached_something_new() -> None:
    corpus = Corpus()
    assert corpus.learn(ONE, {(0, 1, 1)}) == 1
    assert corpus.learn(Variation(seed=4), {(0, 1, 1)}) == 0
    assert corpus.learn(Variation(seed=5), {(0, 1, 1), (0, 2, 1), (0, 2, 2)}) == 2
    assert corpus.variations == [ONE, Variation(seed=5)]
    chosen = [corpus.choose(random.Random(index)) for index in range(40)]
    assert set(map(id, chosen)) == set(map(id, corpus.variations))
