"""`make release` refuses what is no release, and leaves notes and checksums of what is one."""

import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "host_tools/release/release.py"
CHANGELOG = "# Changelog\n\n## [1.1.0] - soon\n\n- Added: this.\n\n## [1.0.0] - then\n\n- First.\n"

PROJECT = """
[project]
version = "1.1.0"
urls = {Repository = "https://git.example.com/kilotwin"}
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A clean checkout of version 1.1.0 whose wheel was made."""
    (tmp_path / "host_tools/release").mkdir(parents=True)
    shutil.copy(SCRIPT, tmp_path / "host_tools/release")
    (tmp_path / "pyproject.toml").write_text(PROJECT)
    (tmp_path / "CHANGELOG.md").write_text(CHANGELOG)
    (tmp_path / ".gitignore").write_text("build\n")
    (tmp_path / "build/wheel").mkdir(parents=True)
    (tmp_path / "build/wheel/kilotwin-1.1.0.tar.gz").write_bytes(b"sources")
    git(tmp_path, "init", "-q")
    git(tmp_path, "config", "user.email", "me@example.org")
    git(tmp_path, "config", "user.name", "Me")
    commit(tmp_path)
    return tmp_path


def git(tree: Path, *arguments: str) -> None:
    subprocess.run(["git", *arguments], cwd=tree, check=True)


def commit(tree: Path) -> None:
    git(tree, "add", ".")
    git(tree, "commit", "-q", "-m", "tree: begin")


def release(tree: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "host_tools/release/release.py", *arguments]
    return subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)


def test_a_clean_tree_is_released_with_its_notes_and_checksums(tree: Path) -> None:
    assert release(tree).returncode == 0
    made = tree / "build/release"
    assert (made / "NOTES").read_text() == "- Added: this.\n"
    expected = f"{sha256(b'sources').hexdigest()}  kilotwin-1.1.0.tar.gz\n"
    assert (made / "SHA256SUMS").read_text() == expected
    assert (made / "kilotwin-1.1.0.tar.gz").read_bytes() == b"sources"


def test_a_check_makes_nothing(tree: Path) -> None:
    assert release(tree, "--check").returncode == 0
    assert not (tree / "build/release").exists()


def test_changes_that_are_not_committed_are_refused_and_named(tree: Path) -> None:
    (tree / "CHANGELOG.md").write_text(CHANGELOG + "more\n")
    refused = release(tree)
    assert refused.returncode == 1
    assert "M CHANGELOG.md" in refused.stderr


def test_a_version_without_notes_is_refused(tree: Path) -> None:
    (tree / "pyproject.toml").write_text(PROJECT.replace("1.1.0", "1.2.0"))
    commit(tree)
    assert "CHANGELOG.md has no section [1.2.0]" in release(tree).stderr


def test_a_version_that_has_been_tagged_is_refused(tree: Path) -> None:
    git(tree, "tag", "v1.1.0")
    assert "v1.1.0 is a tag already" in release(tree).stderr


def test_a_placeholder_of_the_repositorys_address_is_refused(tree: Path) -> None:
    (tree / "pyproject.toml").write_text(PROJECT.replace("git.example.com", "example.org"))
    commit(tree)
    refused = release(tree, "--check")
    assert refused.returncode == 1
    assert "https://example.org/kilotwin in pyproject.toml (project.urls)" in refused.stderr
