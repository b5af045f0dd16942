"""`kilotwin new`: the files of a lab's repository."""

import json
import os
import pty
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files import origins, templates
from kilotwin.studies.scenario.runner import find

from ..conftest import Kilotwin

ROOT = Path(__file__).parents[3]
GIT = "git+https://example.org/kilotwin.git@v1"
EXTRAS = "[coverage,plot,test]"


@pytest.fixture
def wheel(tmp_path: Path) -> Path:
    """One that pip takes, of a package without anything."""
    (tmp_path / "made").mkdir()
    file = tmp_path / "made/kilotwin-1.2.3-py3-none-any.whl"
    info = {
        "METADATA": "Metadata-Version: 2.1\nName: kilotwin\nVersion: 1.2.3\n"
        "Provides-Extra: coverage\nProvides-Extra: plot\nProvides-Extra: test\n",
        "WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        "RECORD": "",
    }
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("kilotwin/__init__.py", "")
        for name, text in info.items():
            archive.writestr(f"kilotwin-1.2.3.dist-info/{name}", text)
    return file


@pytest.mark.parametrize("kind", templates.KINDS)
def test_a_repository_has_all_that_a_lab_needs(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "our-lab"
    written = {str(file) for file in templates.write(kind, folder, origins.find(GIT))}
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


@pytest.mark.parametrize("kind", templates.KINDS)
@pytest.mark.parametrize("compiler", ["clang", "gcc"])
def test_an_editor_finds_the_headers_of_each_program(
    kind: str, compiler: str, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not here")
    grid = ["--grid"] if kind == "grid" else []
    made = kilotwin("new", "lab", *grid, "--from", GIT)
    assert "  lab/compile_flags.txt\n" in made.stdout
    lab = tmp_path / "lab"
    flags = (lab / "compile_flags.txt").read_text().splitlines()
    properties = json.loads((lab / ".vscode/c_cpp_properties.json").read_text())
    (known,) = properties["configurations"]
    folders = [folder for folder in known["includePath"] if folder != "${workspaceFolder}/**"]
    assert [f"-I{folder}" for folder in folders] == [w for w in flags if w.startswith("-I")]
    assert [f"-D{define}" for define in known["defines"]] == [w for w in flags if w[:2] == "-D"]
    programs = sorted(lab.glob("*.c"))
    assert programs
    for program in programs:
        words = [compiler, *flags, "-Werror", "-fsyntax-only", program.name]
        done = subprocess.run(words, cwd=lab, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    ignored = (lab / ".gitignore").read_text().splitlines()
    assert {"compile_flags.txt", ".vscode/c_cpp_properties.json"} <= set(ignored)


def test_a_clone_writes_the_editors_files_of_its_own(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (tmp_path / "clone").mkdir()
    (tmp_path / "clone/mine.c").write_text("#include <kilolib.h>\n")
    made = json.loads(kilotwin("new", "clone", "--editor", "--json").stdout)
    assert made["files"] == [".clangd", ".vscode/c_cpp_properties.json", "compile_flags.txt"]
    assert all((tmp_path / "clone" / file).is_file() for file in made["files"])
    assert (tmp_path / "clone/mine.c").read_text() == "#include <kilolib.h>\n"
    refused = kilotwin("new", "nowhere", "--editor", expect=2)
    assert "there is no folder nowhere; leave out --editor to make it" in refused.stderr


def test_a_folder_that_holds_something_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab/mine.c").write_text("")
    with pytest.raises(InputError, match="the folder is not empty"):
        templates.write("robots", tmp_path / "lab", origins.find(GIT))
    with pytest.raises(InputError, match="name another folder"):
        templates.write("robots", tmp_path / "lab/mine.c/new", origins.find(GIT))
    assert [file.name for file in (tmp_path / "lab").iterdir()] == ["mine.c"]


@pytest.mark.parametrize("whole", [False, True])
def test_a_wheel_is_carried_and_pip_takes_it_from_there(
    whole: bool, wheel: Path, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    made = kilotwin("new", "lab", "--from", str(wheel.parent if whole else wheel))
    assert f"  lab/wheels/{wheel.name}\n" in made.stdout
    assert f"pip install Kilotwin from wheels/{wheel.name}, a copy; commit it too" in made.stdout
    lab = tmp_path / "lab"
    assert (lab / "wheels" / wheel.name).read_bytes() == wheel.read_bytes()
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    options = ["--no-index", "--no-deps", "--target", "../installed"]
    subprocess.run([*pip, *options, "-r", "requirements.txt"], cwd=lab, check=True)
    assert (tmp_path / "installed/kilotwin-1.2.3.dist-info").is_dir()


@pytest.mark.parametrize(
    ("where", "requirement"),
    [
        ("https://example.org/a/kilotwin-1.0.0-cp312-abi3-linux_x86_64.whl#sha256=12", "{}"),
        ("https://example.org/kilotwin-1.0.0.tar.gz", "{}"),
        (GIT, "{}"),
        ("https://example.org/group/kilotwin.git", "git+{}"),
        ("ssh://git@example.org/kilotwin", "git+{}"),
        ("git@example.org:group/kilotwin.git", "git+ssh://git@example.org/group/kilotwin.git"),
    ],
)
def test_an_address_is_written_as_pip_takes_it(
    where: str, requirement: str, tmp_path: Path
) -> None:
    origin = origins.find(where)
    assert origin.requirement == f"kilotwin{EXTRAS} @ {requirement.format(where)}"
    written = templates.write("robots", tmp_path / "lab", origin)
    assert (tmp_path / "lab/requirements.txt").read_text() == f"{origin.requirement}\n"
    assert not any("wheels" in file.parts for file in written)


def test_ci_has_the_python_of_the_wheel_and_what_compiles_sources(tmp_path: Path) -> None:
    files = (".github/workflows/robots.yml", ".gitlab-ci.yml", ".devcontainer/devcontainer.json")
    for name, where, python, compiled in (
        ("new", "https://example.org/kilotwin-1.0.0-cp312-abi3-linux_x86_64.whl", "3.12", False),
        ("old", "https://example.org/kilotwin-1.0.0-cp311-cp311-linux_x86_64.whl", "3.11", False),
        ("git", GIT, "3.11", True),
    ):
        templates.write("robots", tmp_path / name, origins.find(where))
        for file in files:
            text = (tmp_path / name / file).read_text()
            assert re.findall(r"python(?:-version: \"|s?:)(3\.\d+)", text) == [python], file
            assert ("libsimavr-dev" in text) == compiled, file


def test_packages_of_debian_are_those_that_a_clone_has() -> None:
    ours = re.findall(r"^[\w.+-]+", (ROOT / "requirements/run.apt").read_text(), re.MULTILINE)
    assert {*templates.PACKAGES, *templates.PACKAGES_TO_COMPILE} - {"gcc"} <= {*ours}


def test_ci_says_which_lines_have_run_as_the_readme_promises(tmp_path: Path) -> None:
    templates.write("robots", tmp_path / "lab", origins.find(GIT))
    for file in (".github/workflows/robots.yml", ".gitlab-ci.yml"):
        assert "kilotwin test --coverage " in (tmp_path / "lab" / file).read_text()
    assert "kilotwin test --coverage " in (ROOT / "README.md").read_text()


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ("nowhere/kilotwin-1.0.0-py3-none-any.whl", "there is no such file"),
        ("small.toml", "not a wheel, kilotwin-....whl"),
        ("kilotwin-2.whl", "it does not hold all of Kilotwin; type: make wheel"),
        ("empty", "the folder has no kilotwin-....whl; name one wheel"),
        ("https://example.org/kilotwin", "not the URL of a kilotwin-....whl"),
        ("https://me:secret@example.org/kilotwin.git", "has a user or a password in it"),
        ("git+https://secret@example.org/kilotwin.git", "has a user or a password in it"),
    ],
)
def test_what_is_no_wheel_is_refused_and_nothing_is_made(
    where: str, said: str, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "kilotwin-2.whl").write_text("")
    refused = kilotwin("new", "lab", "--from", where, expect=2)
    assert said in refused.stderr
    assert "secret" not in refused.stderr
    assert not (tmp_path / "lab").exists()


def test_a_folder_with_several_wheels_is_refused_with_their_names(
    wheel: Path, kilotwin: Kilotwin
) -> None:
    (wheel.parent / "kilotwin-1.3.0-py3-none-any.whl").write_bytes(b"")
    refused = kilotwin("new", "lab", "--from", str(wheel.parent), expect=2)
    assert f"has {wheel.name}, kilotwin-1.3.0-py3-none-any.whl; name one" in refused.stderr


def test_where_nobody_can_be_asked_it_says_what_to_type(kilotwin: Kilotwin) -> None:
    """This Kilotwin is a clone's, which CI cannot have."""
    refused = kilotwin("new", "lab", expect=2)
    assert "say where pip gets it: --from and a wheel" in refused.stderr


def test_on_a_terminal_it_asks(wheel: Path, fake_environment: dict[str, str]) -> None:
    terminal, inside = pty.openpty()
    try:
        os.write(terminal, f"{wheel}\n".encode())
        done = subprocess.run(
            [sys.executable, "-m", "kilotwin", "new", "lab"],
            cwd=wheel.parent,
            env=fake_environment,
            stdin=inside,
            capture_output=True,
            text=True,
            check=True,
            timeout=600,
        )
    finally:
        os.close(inside)
        os.close(terminal)
    assert "Where is its wheel: a file, a folder, a URL, or git's?" in done.stderr
    assert (wheel.parent / "lab/wheels" / wheel.name).exists()


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize(
    ("kept", "own"),
    [
        (None, None),
        ({"url": "file:///a%20clone", "dir_info": {"editable": True}}, None),
        ({"url": "file:///gone/kilotwin-1-py3-none-any.whl", "archive_info": {}}, None),
        ({"url": "WHEEL", "archive_info": {}}, "WHEEL"),
        ({"url": "https://example.org/k.whl", "archive_info": {}}, "https://example.org/k.whl"),
        (
            {"url": "https://example.org/k.git", "vcs_info": {"vcs": "git", "commit_id": "12ab"}},
            "git+https://example.org/k.git@12ab",
        ),
    ],
)
def test_one_that_was_installed_whole_knows_where_from(
    kept: object, own: str | None, whole: bool, wheel: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = installation(wheel.parent, whole)
    if kept is not None:
        (place / "direct_url.json").write_text(json.dumps(kept).replace("WHEEL", wheel.as_uri()))
    monkeypatch.setattr(metadata, "distribution", lambda _: metadata.Distribution.at(place))
    assert origins.own() == (own and own.replace("WHEEL", str(wheel)) if whole else None)


def installation(folder: Path, whole: bool) -> Path:
    """What pip keeps of one. That of a clone lacks the package itself."""
    place = folder / "kilotwin-1.2.3.dist-info"
    place.mkdir()
    if whole:
        (folder / "kilotwin").mkdir()
        (folder / "kilotwin/__init__.py").write_text("")
    return place
