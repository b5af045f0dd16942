"""The sources of the documentation site: links lead to copies, pages are all in its table."""

import importlib
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SITE = runpy.run_path(str(ROOT / "host_tools/release/site.py"))
gather = SITE["gather"]
TABLE = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[2]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "docs/images").mkdir(parents=True)
    (tmp_path / "docs/images/map.png").write_bytes(b"picture")
    (tmp_path / "docs/wire.md").write_text("[DBC](../protocol/k.dbc) [home](../README.md#run)")
    (tmp_path / "protocol").mkdir()
    (tmp_path / "protocol/k.dbc").write_text("frames")
    (tmp_path / "README.md").write_text("![map](docs/images/map.png) [wire](docs/wire.md)")
    (tmp_path / "CHANGELOG.md").write_text("[mail](mailto:a@b) [web](https://example.org/x)")
    return tmp_path


def test_links_lead_to_pages_and_pictures_and_copies(tree: Path, tmp_path: Path) -> None:
    gather(tree, tmp_path / "site")
    site = tmp_path / "site"
    assert (site / "README.md").read_text() == "![map](images/map.png) [wire](wire.md)"
    assert (site / "wire.md").read_text() == "[DBC](files/protocol/k.dbc) [home](README.md#run)"
    assert (site / "files/protocol/k.dbc").read_text() == "frames"
    assert (site / "images/map.png").read_bytes() == b"picture"
    assert (site / "CHANGELOG.md").read_text() == (tree / "CHANGELOG.md").read_text()


def test_a_link_to_nothing_is_refused(tree: Path, tmp_path: Path) -> None:
    (tree / "docs/wire.md").write_text("[gone](../protocol/gone.dbc)")
    with pytest.raises(FileNotFoundError, match=r"gone\.dbc"):
        gather(tree, tmp_path / "site")


def test_every_page_is_in_the_table_once() -> None:
    listed = re.findall(r"([\w]+\.md)$", TABLE, re.MULTILINE)
    pages = [*(file.name for file in (ROOT / "docs").glob("*.md")), "README.md", "CHANGELOG.md"]
    assert sorted(listed) == sorted(pages)


def test_names_of_the_reference_exist_and_have_docstrings() -> None:
    text = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    names = re.findall(r"^::: (\S+)$", text, re.MULTILINE)
    assert "kilotwin.World" in names
    for name in names:
        module, _, last = name.rpartition(".")
        found = getattr(importlib.import_module(module), last)
        assert found.__doc__, name
