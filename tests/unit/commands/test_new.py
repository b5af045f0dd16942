"""`kilotwin new`: the files of a lab's repository."""

import re
import tomllib
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files import templates
from kilotwin.scenario.runner import find


@pytest.mark.parametrize("kind", templates.KINDS)
def test_a_repository_has_all_that_a_lab_needs(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "our-lab"
    written = {str(file) for file in templates.write(kind, folder)}
    assert written >= {
        *(".github/workflows/robots.yml", ".gitlab-ci.yml", ".devcontainer/devcontainer.json"),
        *(".gitignore", "README.md", "requirements.txt", "pytest.ini"),
        templates.KINDS[kind]["PROGRAM"],
    }
    texts = {name: (folder / name).read_text() for name in written}
    assert [name for name, text in texts.items() if re.search(r"@[A-Z]+@", text)] == []
    assert texts["README.md"].startswith("# our-lab\n")
    for name in re.findall(r"^\| `([\w./]+)`", texts["README.md"], re.MULTILINE):
        assert (folder / name).exists(), name
    (scenario,) = find([folder])
    assert scenario.parent.name == "scenarios"
    tables = tomllib.loads(scenario.read_text())
    assert len(tables.pop("expect")) >= 3
    plain = Experiment.load(next(folder.glob("*.toml")))
    expected = Experiment.load(scenario)
    assert plain.identity() == expected.identity(), "the scenario is the experiment"


def test_a_folder_that_holds_something_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab/mine.c").write_text("")
    with pytest.raises(InputError, match="the folder is not empty"):
        templates.write("robots", tmp_path / "lab")
    with pytest.raises(InputError, match="name another folder"):
        templates.write("robots", tmp_path / "lab/mine.c/new")
    assert [file.name for file in (tmp_path / "lab").iterdir()] == ["mine.c"]
