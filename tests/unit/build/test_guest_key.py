"""The key under which a guest is kept covers all that went into it."""

from pathlib import Path

import pytest

from kilotwin.experiment.programs import Api, find_program
from kilotwin.programs.native import guest as guest_build

from ..conftest import BLINK


@pytest.mark.parametrize("api", ["kilobot", "kilogrid", "module"])
def test_every_file_of_ours_that_the_compiler_reads_is_part_of_the_key(
    api: Api, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("KILOTWIN_CFLAGS", raising=False)
    (tmp_path / "blink.c").write_text(BLINK)
    compiler = guest_build.find_compiler()
    version = guest_build.compiler_version(compiler)
    wanted = find_program("blink.c", tmp_path, api=api)
    builder = guest_build.Builder(wanted, compiler, version)
    read = builder._read_by(builder._side, builder._side_flags)
    if builder._helpers:
        read += builder._read_by(builder._helpers, builder._helper_flags)
    assert len(read) > 50
    hashed = {file.resolve() for file in builder._ours()}
    assert {file.resolve() for file in read} <= hashed


def test_a_header_of_ours_that_changes_changes_the_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("KILOTWIN_CFLAGS", raising=False)
    (tmp_path / "blink.c").write_text(BLINK)
    (tmp_path / "ours.h").write_text("#define A 1\n")
    program = find_program("blink.c", tmp_path)
    compiler = guest_build.find_compiler()
    builder = guest_build.Builder(program, compiler, "gcc")
    builder._helpers = [tmp_path / "helper.c"]  # whose folder has the header
    builder._helpers[0].write_text("")
    first = builder.key()
    assert builder.key() == first
    (tmp_path / "ours.h").write_text("#define A 2\n")
    assert builder.key() != first
