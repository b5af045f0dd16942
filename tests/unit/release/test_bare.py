"""What `make bare` hands in of this machine, and what it makes of commands' output."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BARE = runpy.run_path(str(ROOT / "tests/bare.py"))


@pytest.mark.parametrize(
    "text",
    [
        "# deb http://other/\ndeb [signed-by=/a.gpg] http://mirror/debian bookworm main\n",
        "Types: deb\nURIs: http://mirror/debian\nSuites: bookworm\n",
    ],
)
def test_packages_come_from_the_mirror_that_apt_uses(text: str) -> None:
    assert BARE["mirror"](text) == "http://mirror/debian"


def test_without_a_source_of_packages_it_says_so() -> None:
    with pytest.raises(BARE["BareRootError"], match="no source"):
        BARE["mirror"]("# nothing\n")


def test_settings_of_registries_are_handed_in_and_nothing_else() -> None:
    handed = {"HTTPS_PROXY", "no_proxy", "PIP_CERT", "UV_INDEX_URL", "SSL_CERT_FILE"}
    handed |= {"NODE_EXTRA_CA_CERTS", "npm_config_registry", "REQUESTS_CA_BUNDLE"}
    kept_out = {"HOME", "PATH", "LANG", "PYTHONPATH", "KILOTWIN_CC", "CXXFLAGS", "VIRTUAL_ENV"}
    assert set(BARE["settings"](dict.fromkeys(handed | kept_out, "x"))) == handed


def test_the_steps_are_those_of_the_containerfile() -> None:
    text = "# a\nFROM debian:12\nRUN apt-get update && \\\n    apt-get install git\nCOPY . /k\n"
    assert list(BARE["instructions"](text)) == [
        ("FROM", "debian:12"),
        ("RUN", "apt-get update &&      apt-get install git"),
        ("COPY", ". /k"),
    ]
    own = list(BARE["instructions"]((ROOT / "Containerfile").read_text(encoding="utf-8")))
    assert {word for word, _ in own} <= {"FROM", "RUN", "COPY", "WORKDIR", "CMD"}
    assert ("RUN", "make run") in own


def test_the_commands_are_readmes() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert BARE["commands"](readme) == ["make run", "make test"]


def test_a_step_lasts_until_the_next_and_equal_ones_are_added() -> None:
    lines = ["set-up: Python packages into .venv", "noise", "set-up: the native tests"]
    lines += ["set-up: Python packages of make test"]
    rows = BARE["steps_of"](iter(zip([10.0, 11.0, 14.0, 15.0], lines, strict=True)), 21.0)
    assert [(row.name.strip(), row.seconds) for row in rows] == [
        ("Python packages", 10.0),
        ("native tests are built", 1.0),
    ]
    assert BARE["steps_of"](iter([(1.0, "nothing known")]), 9.0) == []
