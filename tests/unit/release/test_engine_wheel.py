"""The engine's wheel is kept under all that it was built from."""

import os
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
ENGINE = runpy.run_path(str(ROOT / "host_tools/release/engine.py"))
key_of, keep, prune, KEPT = (ENGINE[name] for name in ("key_of", "keep", "prune", "KEPT"))


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "host_tools/kilotwin/runs").mkdir(parents=True)
    (tmp_path / "host_tools/kilotwin/runs/__init__.py").write_text("")
    (tmp_path / "requirements").mkdir()
    (tmp_path / "requirements/run.lock").write_text("numpy==2")
    (tmp_path / "engine.cpp").write_text("int one;")
    return tmp_path


def key(tree: Path) -> str:
    return str(key_of(tree, [Path("engine.cpp")]))


def test_the_same_sources_have_the_same_key(tree: Path) -> None:
    first = key(tree)
    os.utime(tree / "engine.cpp", (0, 0))
    (tree / "host_tools/kilotwin/runs/run.py").write_text("a module that needs no compiler")
    assert key(tree) == first


@pytest.mark.parametrize(
    "changed", ["engine.cpp", "requirements/run.lock", "host_tools/new/__init__.py"]
)
def test_what_the_engine_is_built_from_changes_the_key(changed: str, tree: Path) -> None:
    first = key(tree)
    (tree / changed).parent.mkdir(exist_ok=True)
    (tree / changed).write_text("changed")
    assert key(tree) != first


def test_compiler_flags_change_the_key(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = key(tree)
    monkeypatch.setenv("CXXFLAGS", "-O0")
    assert key(tree) != first


def test_the_newest_wheels_are_kept(tmp_path: Path) -> None:
    for age in range(KEPT + 2):
        made = tmp_path / f"made-{age}"
        made.mkdir()
        (made / "kilotwin.whl").write_text(f"{age}")
        kept = keep(made / "kilotwin.whl", tmp_path / "wheels" / f"key-{age}")
        assert kept.read_text() == f"{age}"
        os.utime(kept.parent, (age, age))
    prune(tmp_path / "wheels")
    left = sorted(folder.name for folder in (tmp_path / "wheels").iterdir())
    assert left == [f"key-{age}" for age in range(2, KEPT + 2)]
