"""pyproject.toml owns the version and the address; what cannot read them there says the same."""

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import kilotwin

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
VERSION = PROJECT["version"]


def test_the_engine_and_the_package_have_the_version() -> None:
    assert kilotwin.__version__ == version("kilotwin") == VERSION


def test_the_citation_names_the_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, re.MULTILINE) == [VERSION]


def test_the_citation_names_the_repository_where_to_write() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    address = PROJECT["urls"]["Repository"]
    assert re.findall(r"^repository-code: (.*)$", citation, re.MULTILINE) == [address]
    assert "`CITATION.cff` names (`repository-code`)" in (ROOT / "docs/security.md").read_text()


def test_the_changelog_begins_with_the_version() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## \[(.*?)\]", changelog, re.MULTILINE)[0] == VERSION
