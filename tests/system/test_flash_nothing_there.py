"""`kilotwin flash` of what is not plugged in says so before it builds anything."""

import os
from pathlib import Path

import pytest

from .conftest import WALKER, Kilotwin


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["robots", "--via", "grid", "--can", "socketcan:can77", "--size", "4x4"], "can77 up type"),
        (["robots", "--via", "ohc:/dev/nothing7"], "/dev/nothing7 is not there; plug it in"),
        (["robots", "--via", "dispatcher:/dev/nothing7@9600"], "/dev/nothing7 is not there; plug"),
        (
            ["robot", "--via", "isp", "-P", "/dev/nothing7"],
            "/dev/nothing7 is not there; plug it in",
        ),
        (["robot", "--via", "isp"], "no programmer avrispmkII at usb; plug it in"),
    ],
)
def test_a_port_that_is_not_there_is_found_before_the_program_is_built(
    words: list[str], said: str, kilotwin: Kilotwin, tmp_path: Path
) -> None:
    (tmp_path / "walker.c").write_text(WALKER)
    kind, *options = words
    cache = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = kilotwin("flash", kind, tmp_path / "walker.c", *options, env=cache, expect=3)
    assert said in done.stderr
    assert "compiling" not in done.stderr
