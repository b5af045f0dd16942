"""`kilotwin build`: guests and images, what it prints, what it refuses."""

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


def test_a_hex_file_is_built_and_shown(kilotwin: Kilotwin, folder: Path) -> None:
    done = kilotwin("build", "blink.c", "--hex", "my.hex", "--quiet")
    assert done.stderr == ""
    text = done.stdout.splitlines()
    assert text[0] == "blink, for a robot: my.hex, my.elf"
    shown = kilotwin("build", "--show", "my.hex").stdout.splitlines()
    assert shown[0] == "my.hex:"
    assert {text[1], *text[3:]} == set(shown[1:])
    report = json.loads(kilotwin("build", "blink.c", "--hex", "my.hex", "--json").stdout)
    assert report["sources"] == [str(folder / "blink.c")]
    assert (
        json.loads(kilotwin("build", "--show", "my.hex", "--json").stdout)["build_id"]
        == (report["build_id"])
    )


def test_flash_is_the_same_number_as_that_of_port(kilotwin: Kilotwin) -> None:
    built = json.loads(kilotwin("build", "blink.c", "--hex", "my.hex", "--json").stdout)
    ported = json.loads(kilotwin("port", "blink.c", "--no-run", "--json").stdout)
    assert (built["flash_bytes"], built["ram_bytes"]) == (
        ported["flash_bytes"],
        ported["ram_bytes"],
    )


def test_a_hex_file_of_several_files_with_headers_and_macros(
    kilotwin: Kilotwin, folder: Path
) -> None:
    (folder / "inc").mkdir()
    (folder / "inc" / "far.h").write_text("int far(void);\n")
    (folder / "far.c").write_text('#include "far.h"\nint far(void) { return N; }\n')
    words = ["build", "blink.c", "far.c", "-D", "N=3", "-I", "inc", "--hex", "my.hex", "--json"]
    report = json.loads(kilotwin(*words).stdout)
    assert [Path(source).name for source in report["sources"]] == ["blink.c", "far.c"]


def test_the_compilers_words_on_a_hex_file_come_below_our_line(
    kilotwin: Kilotwin, folder: Path
) -> None:
    (folder / "bad.c").write_text("int main(void) { return nothing; }\n")
    done = kilotwin("build", "bad.c", "--hex", "my.hex", "--quiet", expect=2)
    first, *others = done.stderr.splitlines()
    said = "does not compile for the robot; mend what the compiler says"
    assert first == f"kilotwin: {folder}/bad.c: {said}"
    assert any(line.startswith(f"{folder}/bad.c:1:") for line in others)
    assert not (folder / "my.hex").exists()


def test_words_that_do_not_go_together_are_refused(kilotwin: Kilotwin, folder: Path) -> None:
    (folder / "cell.c").write_text("#include <module.h>\nint main(void) { module_start(0, 0); }\n")
    for words, said in [
        ([], "build takes a program, or --show and a .hex file; name one of them"),
        (["blink.c", "--show", "my.hex"], "build takes a program, or --show"),
        (["blink.c", "--hex", "my.hex", "-o", "my.so"], "-o my.so: names the file of a guest"),
        (["--show", "my.hex"], "my.hex: no such file or directory; name a .hex file"),
        (["--show", "blink.c"], "blink.c:1: a line of Intel HEX begins with a colon"),
        (["cell.c", "--hex", "my.hex"], "not for a robot; add --for module"),
        (["nowhere.c", "--hex", "my.hex"], "program 'nowhere.c' is not there"),
    ]:
        assert said in kilotwin("build", "--quiet", *words, expect=2).stderr
    assert "'moon' is not one of" in kilotwin("build", "blink.c", "--for", "moon", expect=2).stderr
