"""`kilotwin build`: what it prints, what it refuses."""

import ctypes
import json
from pathlib import Path

from ..conftest import Kilotwin


def test_it_says_where_the_guest_is_and_how_large(kilotwin: Kilotwin, folder: Path) -> None:
    shown = kilotwin("build", "blink.c").stdout.splitlines()
    assert shown[0].startswith("blink: ")
    assert Path(shown[0].removeprefix("blink: ")).exists()
    assert "bytes per robot" in shown[1]
    assert "bytes of code" in shown[2]


def test_json_has_it_all(kilotwin: Kilotwin, folder: Path) -> None:
    report = json.loads(kilotwin("build", "blink.c", "-o", "own.so", "--json").stdout)
    assert report["program"] == "blink"
    assert report["file"] == "own.so"
    assert report["sources"] == [str(folder / "blink.c")]
    assert 32 < report["state_bytes"] < 2000
    assert report["text_bytes"] > 100
    ctypes.CDLL(str(folder / "own.so"))


def test_several_files_headers_and_macros(kilotwin: Kilotwin, folder: Path) -> None:
    (folder / "inc").mkdir()
    (folder / "inc" / "far.h").write_text("int far(void);\n")
    (folder / "far.c").write_text('#include "far.h"\nint far(void) { return N; }\n')
    words = ["build", "blink.c", "far.c", "-D", "N=3", "--json"]
    report = json.loads(kilotwin(*words, "-I", "inc").stdout)
    assert [Path(source).name for source in report["sources"]] == ["blink.c", "far.c"]
    done = kilotwin(*words, expect=2)
    assert "blink.c" in done.stderr.splitlines()[-1] or "far.h" in done.stderr


def test_the_compilers_words_come_below_our_line(kilotwin: Kilotwin, folder: Path) -> None:
    (folder / "bad.c").write_text("int main(void) { return nothing; }\n")
    first, *others = [
        line
        for line in kilotwin("build", "bad.c", expect=2).stderr.splitlines()
        if not line.startswith("compiling")
    ]
    assert first == f"kilotwin: {folder}/bad.c: does not compile; mend what the compiler says"
    assert any(line.startswith(f"{folder}/bad.c:1:") for line in others)


def test_what_is_not_there_is_named(kilotwin: Kilotwin) -> None:
    for words, said in [
        (["nowhere.c"], "program 'nowhere.c' is not there"),
        (["blink.c", "-I", "nowhere"], "include 'nowhere' is not there"),
        (["blink.c", "-D", "3"], "'3' defines no macro"),
        (["blink.c", "-o", "no/where.so"], "-o no/where.so: no such file or directory"),
    ]:
        assert said in kilotwin("build", *words, expect=2).stderr.splitlines()[-1]
