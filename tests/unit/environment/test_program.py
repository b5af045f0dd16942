"""An environment's class: loaded from its file, its mistakes told by file and line."""

from pathlib import Path

import pytest

from kilotwin.errors import InputError, RunError
from kilotwin.table.environment.program import EnvironmentProgram
from kilotwin.table.environment.protocol import Arena, Draws, Seen

ARENA = Arena("circle", 1.0, 1.0, (1, 2), Draws(1), lambda text: None, lambda x, y: True)
SEEN = Seen(2.5, ())


class NoSender:
    """Takes nothing: these programs send nothing."""

    def __call__(self, uid: int, value: int, type: int = 0) -> None:
        raise AssertionError

    def to_all(self, data: object, type: int) -> None:
        raise AssertionError


def program(folder: Path, text: str, name: str = "E") -> EnvironmentProgram:
    (folder / "e.py").write_text(text)
    return EnvironmentProgram(folder / "e.py", name, ARENA, {"a": 1})


def test_it_gets_arena_and_settings_and_is_shown_pictures(tmp_path: Path) -> None:
    text = (
        "class E:\n"
        "    def __init__(self, arena, settings):\n"
        "        self.got = arena, settings\n"
        "    def step(self, seen, send):\n"
        "        self.seen = seen\n"
    )
    played = program(tmp_path, text)
    played.step(SEEN, NoSender())
    assert played.object.got == (ARENA, {"a": 1})
    assert played.object.seen is SEEN
    assert not (tmp_path / "__pycache__").exists()


def test_modules_beside_it_can_be_imported(tmp_path: Path) -> None:
    (tmp_path / "beside_e.py").write_text("NUMBER = 12\n")
    text = (
        "from dataclasses import dataclass\n"
        "from beside_e import NUMBER\n"
        "@dataclass\n"
        "class E:\n"
        "    arena: object\n"
        "    settings: dict\n"
        "    def step(self, seen, send): self.number = NUMBER\n"
    )
    played = program(tmp_path, text)
    played.step(SEEN, NoSender())
    assert played.object.number == 12


STEP = "    def step(self, seen, send):\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("class F: pass\n", r"e\.py: there is no class 'E'"),
        ("E = 5\n", r"e\.py: there is no class 'E'"),
        ("class E:\n    def __init__(self, a, s): pass\n", r"e\.py: E has no step\(self, seen, "),
        ("import no_such_module\n", r"e\.py:1: ModuleNotFoundError: .*\(E, while it was made\)"),
        (
            "class E:\n    def __init__(self, arena, settings):\n        settings['b']\n" + STEP,
            r"e\.py:3: KeyError: 'b' \(E, while it was made\)",
        ),
        ("class E:\n" + STEP + "        pass\n", r"TypeError: E\(\) takes no arguments"),
    ],
)
def test_what_cannot_be_made_is_refused(tmp_path: Path, text: str, said: str) -> None:
    text = text + "        pass\n" if text.endswith(STEP) else text
    with pytest.raises(InputError, match=said):
        program(tmp_path, text)


def test_a_mistake_in_a_step_names_the_program_s_own_line(tmp_path: Path) -> None:
    text = (
        "import json\n"
        "class E:\n"
        "    def __init__(self, arena, settings): pass\n"
        "    def step(self, seen, send):\n"
        "        self.read()\n"
        "    def read(self):\n"
        "        json.loads('{')\n"
    )
    with pytest.raises(RunError, match=r"e\.py:7: JSONDecodeError: .*E, in the step for 2.500 s"):
        program(tmp_path, text).step(SEEN, NoSender())


def test_even_an_exit_is_told(tmp_path: Path) -> None:
    text = (
        "import sys\n"
        "class E:\n"
        "    def __init__(self, arena, settings): pass\n"
        "    def step(self, seen, send): sys.exit(3)\n"
    )
    with pytest.raises(RunError, match=r"e\.py:4: SystemExit: 3"):
        program(tmp_path, text).step(SEEN, NoSender())
