"""A worker's cgroup, in a folder that looks like the kernel's."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from kilotwin.files import memory_group

EXPERIMENT = """\
duration_s = 0.1
arena.diameter_m = 1.0
[swarm]
cpu = "native"
profile = "kilobot"
program = "blink.c"
size = 1
"""
RUN = """\
import sys
from pathlib import Path
from kilotwin.commands.cli import main
from kilotwin.files import memory_group
memory_group.ROOT, memory_group.OWN = Path(sys.argv.pop(1)), Path(sys.argv.pop(1))
main()
"""


@pytest.fixture
def parent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The group above that of this process, in which others may be made."""
    (tmp_path / "own").write_text("4:memory:/old\n0::/user/app/mine\n")
    parent = tmp_path / "root/user/app"
    (parent / "mine").mkdir(parents=True)
    (parent / "cgroup.subtree_control").write_text("cpu memory pids\n")
    monkeypatch.setattr(memory_group, "ROOT", tmp_path / "root")
    monkeypatch.setattr(memory_group, "OWN", tmp_path / "own")
    return parent


def test_a_group_is_made_beside_that_of_the_process_and_limited(parent: Path) -> None:
    group = parent / f"kilotwin-{os.getpid()}"
    assert memory_group.make(1000) == str(group / "cgroup.procs")
    assert (group / "memory.max").read_text() == str(1000 + (256 << 20))
    assert (group / "memory.swap.max").read_text() == "0"


def test_there_is_none_where_memory_is_not_counted_or_nothing_can_be_made(parent: Path) -> None:
    (parent / "cgroup.subtree_control").write_text("cpu pids\n")
    assert memory_group.make(1000) == ""
    memory_group.OWN.write_text("4:memory:/old\n")
    assert memory_group.make(1000) == ""
    assert not memory_group.remove(os.getpid())


def test_a_group_goes_with_its_process_and_says_whether_memory_ran_out(parent: Path) -> None:
    group = parent / "kilotwin-77"
    group.mkdir()
    assert not memory_group.remove(77)
    assert not group.exists()
    group.mkdir()
    (group / "memory.events").write_text("low 0\nmax 3\noom 1\noom_kill 1\n")
    assert memory_group.remove(77)


@pytest.mark.usefixtures("guest_cache")
def test_a_worker_joins_its_group_before_its_programs_run(parent: Path, tmp_path: Path) -> None:
    (tmp_path / "it.toml").write_text(EXPERIMENT)
    (tmp_path / "blink.c").write_bytes(Path("firmware/examples/blink.c").read_bytes())
    places = [str(memory_group.ROOT), str(memory_group.OWN)]
    command = [sys.executable, "-c", RUN, *places, "run", "it.toml", "--out", "run", "--quiet"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (group,) = parent.glob("kilotwin-*")
    assert (group / "cgroup.procs").read_text() == "0"
