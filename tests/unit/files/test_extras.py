"""Libraries that a plain install leaves out are named when they are missing."""

import tomllib
from pathlib import Path

import pytest

from kilotwin.errors import RunError
from kilotwin.files import extras

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


def package(library: str) -> str:
    return library.lower().replace("_", "-")


def name_of(requirement: str) -> str:
    """Without its lower bound."""
    return requirement.partition(">=")[0].lower()


def test_each_library_that_is_imported_has_a_lower_bound() -> None:
    extra = [one for name in EXTRAS.keys() - {"all"} for one in EXTRAS[name]]
    assert [one for one in [*PROJECT["dependencies"], *extra] if ">=" not in one] == []


@pytest.mark.parametrize("library", extras.EXTRAS)
def test_the_extra_that_is_named_brings_the_library(library: str) -> None:
    named = {name_of(one) for one in EXTRAS[extras.EXTRAS[library]]}
    assert package(library) in named


def test_no_extra_brings_a_library_that_is_not_explained() -> None:
    brought = {name_of(one) for extra in EXTRAS.keys() - {"all"} for one in EXTRAS[extra]}
    assert brought == set(map(package, extras.EXTRAS))


def test_all_brings_every_extra() -> None:
    (everything,) = EXTRAS["all"]
    names = sorted(EXTRAS.keys() - {"all"})
    assert everything == f"kilotwin[{','.join(names)}]"


def test_what_is_missing_is_said_with_what_to_type(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(extras.EXTRAS, "no_such_library", "plot")
    extras.require("json")
    with pytest.raises(RunError, match=r"no_such_library is not .*pip install 'kilotwin\[plot\]'"):
        extras.require("json", "no_such_library")


def test_an_import_that_fails_is_explained_only_if_an_extra_brings_it() -> None:
    part = ModuleNotFoundError(name="scipy.stats")
    assert "pip install 'kilotwin[stats]'" in str(extras.explained(part))
    other = ModuleNotFoundError(name="kilotwin.nothing")
    with pytest.raises(ModuleNotFoundError):
        extras.explained(other)
