"""Disks, folders and outputs that fail: one clear line, an exit code, nothing half-written."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa
import pytest

from .conftest import KILOTWIN, ROOT, SIMPLIFIED, Kilotwin

SHORT = ("run", SIMPLIFIED, "--set", "duration_s=1")
NO_SPACE = "no space left on device"
as_root = pytest.mark.skipif(os.geteuid() != 0, reason="mounts a disk, which takes root")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 1 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", folder], check=False
    )
    if mounted.returncode != 0:
        pytest.skip("mounts a disk, which is not allowed here")
    yield folder
    subprocess.run(["umount", folder], check=True)


def fill(disk: Path) -> None:
    room = os.statvfs(disk)
    (disk / "filled").write_bytes(bytes(room.f_bavail * room.f_bsize - 4096))


@as_root
def test_a_run_that_fills_the_disk_says_so_in_its_manifest(
    kilotwin: Kilotwin, small_disk: Path
) -> None:
    folder = small_disk / "run"
    long = ("--set", "duration_s=30000", "--set", "record.sample_s=1")
    done = kilotwin("run", SIMPLIFIED, *long, "--out", folder, expect=1)
    assert NO_SPACE in done.stderr
    assert "Traceback" not in done.stderr
    manifest = json.loads((folder / "manifest.json").read_text())
    assert (manifest["status"], manifest["exit_code"]) == ("failed", 1)
    assert NO_SPACE in manifest["reason"]
    assert [file.name for file in folder.glob(".*")] == []
    assert [file.name for file in small_disk.iterdir()] == ["run"]


@as_root
def test_a_full_disk_is_found_before_the_run(kilotwin: Kilotwin, small_disk: Path) -> None:
    fill(small_disk)
    done = kilotwin(*SHORT, "--out", small_disk / "run", expect=2)
    assert NO_SPACE in done.stderr
    assert [file.name for file in small_disk.iterdir()] == ["filled"]


@as_root
def test_a_full_cache_is_not_blamed_on_the_program(kilotwin: Kilotwin, small_disk: Path) -> None:
    fill(small_disk)
    done = kilotwin(*SHORT, env={"KILOTWIN_CACHE": str(small_disk)}, expect=1)
    assert f"cannot keep compiled programs ({NO_SPACE}); set KILOTWIN_CACHE" in done.stderr
    assert "does not compile" not in done.stderr


@as_root
def test_a_full_temporary_folder_is_not_blamed_on_the_program(
    kilotwin: Kilotwin, small_disk: Path, tmp_path: Path
) -> None:
    fill(small_disk)
    env = {"TMPDIR": str(small_disk), "KILOTWIN_CACHE": str(tmp_path / "cache")}
    done = kilotwin(*SHORT, env=env, expect=1)
    assert f"{small_disk}: {NO_SPACE} to compile in; make room, or set TMPDIR" in done.stderr


@as_root
def test_a_cache_that_may_not_be_read_is_named(tmp_path: Path) -> None:
    """As in containers whose user is not the image's."""
    home = tmp_path / "home"
    (home / ".cache").mkdir(parents=True)
    home.chmod(0o700)
    python = ["setpriv", "--reuid", "65534", "--clear-groups", "env", "-u", "KILOTWIN_CACHE"]
    python += ["-u", "XDG_CACHE_HOME", f"HOME={home}", sys.executable, "-c"]
    code = (
        "from pathlib import Path\n"
        "from kilotwin.programs.cache import cache_folder, is_built\n"
        "is_built(cache_folder() / 'x')\n"
    )
    if subprocess.run([*python, ""], check=False).returncode != 0:
        pytest.skip("this Python may not be run by another user")
    done = subprocess.run([*python, code], capture_output=True, text=True, check=False)
    assert "cannot keep compiled programs (permission denied); set KILOTWIN_CACHE" in done.stderr


@pytest.mark.parametrize(
    ("name", "what"),
    [("x" * 300, "(file name too long); name another folder"), ("bad\udcff", "not UTF-8")],
    ids=["long", "not UTF-8"],
)
def test_a_folder_of_an_impossible_name_is_refused(
    kilotwin: Kilotwin, tmp_path: Path, name: str, what: str
) -> None:
    done = kilotwin(*SHORT, "--out", tmp_path / name, expect=2)
    assert what in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_deleted_working_folder_is_named(environment: dict[str, str], tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    command = f'rmdir "{folder}"; exec "{KILOTWIN}" run x.toml'
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "the folder that you are in has been deleted; change to another" in done.stderr


def test_output_that_cannot_be_written_is_an_error(environment: dict[str, str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [KILOTWIN, "--help"],
            cwd=ROOT,
            env=environment,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr == f"kilotwin: output: {NO_SPACE}; see to the disk\n"


def test_a_table_of_another_program_is_named(kilotwin: Kilotwin, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    kilotwin(*SHORT, "--out", folder)
    table = folder / "robots.arrows"
    with pa.ipc.open_stream(table) as reader:
        other = reader.read_all().drop_columns(["x_m"])
    with pa.OSFile(str(table), "wb") as file, pa.ipc.new_stream(file, other.schema) as writer:
        writer.write_table(other)
    done = kilotwin("plot", "map", folder, "-o", tmp_path / "map.png", expect=2)
    assert f"{table}: column x_m is missing, or not float" in done.stderr
