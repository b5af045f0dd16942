"""Sources that mean harm where they are compiled, linked, loaded, or told of: each is refused by
name, or is a program like any other, and shows and changes nothing outside its folders."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

KILOTWIN = Path(sys.executable).with_name("kilotwin")

EXPERIMENT = """\
duration_s = 0.1
arena.diameter_m = 1.0
[swarm]
profile = "kilobot"
cpu = "native"
program = "programs/one/mine.c"
size = 1
"""
SECRET = "mysecret"
TRAP = "static void trap(void) { __builtin_trap(); }\n"
MAIN = """
#include <kilolib.h>
static void setup(void) {}
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
TITLE = r"\033]0;owned\007"

DOES_NOT_COMPILE = "does not compile; mend what the compiler says"
NOT_READ = "it may read the program's folders"
CANNOT_BE_LOADED = "program mine cannot be loaded: it has "
# By name: what stands before MAIN, where OUTSIDE is a folder, and what is said of it.
REFUSED = {
    "include": ('#include "OUTSIDE/key"', NOT_READ),
    "include of a folder above": ('#include "../../../outside/key"', DOES_NOT_COMPILE),
    "include of a device": ('#include "/dev/zero"', NOT_READ),
    "include of the compiler's memory": ('#include "/proc/self/environ"', NOT_READ),
    "question for a file": ('#if __has_include("OUTSIDE/key")\n#endif', NOT_READ),
    "line of another file": ('#line 1 "OUTSIDE/key"\n#error here', DOES_NOT_COMPILE),
    "precompiled header": ('#pragma GCC pch_preprocess "OUTSIDE/key"', DOES_NOT_COMPILE),
    "orders for a terminal": ('#error "\x1b]0;owned\x07"', r'#error "\x1b]0;owned\x07"'),
    "the engine's table": ("int kt_table = 7;", "multiple definition of `kt_table'"),
    "the engine's functions": ("const void *kt_host = 0;", "multiple definition of `kt_host'"),
    "all memory": ("char all[1L << 40];", DOES_NOT_COMPILE),
    "much memory": (
        "char much[1 << 30]; char *at(void) { return much; }",
        "it takes more memory, time or room than a compiler gets",
    ),
    "code that can be written over": (
        '__asm__(".section .own, \\"awx\\"; .globl own; own: .byte 0x90; .previous");',
        CANNOT_BE_LOADED + "code that can be written over",
    ),
    "variables of a thread": (
        "__thread int mine = 3; int get(void) { return mine; }",
        CANNOT_BE_LOADED + "variables of a thread",
    ),
}
# Sources that are left out, or do nothing.
HARMLESS = {
    "incbin": '__asm__(".pushsection .rodata; .incbin \\"OUTSIDE/key\\"; .popsection");',
    "plugin": '#pragma GCC optimize("-fplugin=OUTSIDE/key")',
    "dump": '#pragma GCC optimize("-fdump-tree-all=OUTSIDE/new")',
    "warning of the linker": (
        'void exit(int); __attribute__((used, section(".gnu.warning.exit"))) '
        f'static char text[] = "{TITLE}"; __attribute__((used)) void end(void) {{ exit(1); }}'
    ),
    "initialisers before others": (
        '__attribute__((used, section(".preinit_array"))) static void (*at)(void) = trap;'
    ),
    "stack that is code": '__asm__(".section .note.GNU-stack, \\"x\\", @progbits; .previous");',
    "a function of the C library": (
        "void *memcpy(void *to, const void *from, unsigned long n) { return 0; }"
    ),
    "another library": (
        '__asm__(".section .deplibs, \\"MS\\", @progbits, 1; .asciz \\"evil\\"; .previous");'
    ),
}


def run(folder: Path, text: str, *before: str) -> "subprocess.CompletedProcess[str]":
    outside, cache = folder / "outside", folder.parent / "cache"
    outside.mkdir()
    (outside / "key").write_text(SECRET)
    source = folder / "programs/one/mine.c"
    source.parent.mkdir(parents=True)
    source.write_text(TRAP + text.replace("OUTSIDE", str(outside)) + MAIN)
    (folder / "it.toml").write_text(EXPERIMENT)
    done = subprocess.run(
        [*before, KILOTWIN, "run", "it.toml", "--out", "run", "--json", "--quiet"],
        env={**os.environ, "KILOTWIN_CACHE": str(cache)},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert [file.name for file in outside.iterdir()] == ["key"]
    assert (outside / "key").read_text() == SECRET
    assert SECRET not in done.stdout + done.stderr
    assert all(SECRET.encode() not in file.read_bytes() for file in cache.glob("*/*.so"))
    assert "\x1b" not in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done


@pytest.mark.parametrize("name", REFUSED)
def test_a_source_that_means_harm_is_refused_and_named(name: str, tmp_path: Path) -> None:
    text, said = REFUSED[name]
    done = run(tmp_path, text)
    assert done.returncode == 2
    assert said in done.stderr
    assert "mine" in done.stderr.splitlines()[0]


@pytest.mark.parametrize("name", HARMLESS)
def test_what_means_harm_and_does_none_is_a_program_like_any(name: str, tmp_path: Path) -> None:
    assert run(tmp_path, HARMLESS[name]).returncode == 0


def test_an_initialiser_is_run_with_its_robot_and_stops_it(tmp_path: Path) -> None:
    text = '__attribute__((used, section(".init_array.1"))) static void (*at)(void) = trap;'
    done = run(tmp_path, text)
    assert done.returncode == 4
    assert "crash at mine.c:1 in trap(): Illegal instruction" in done.stderr


def test_a_compiler_that_computes_for_too_long_is_ended_once_and_for_all(tmp_path: Path) -> None:
    limited = ("sh", "-c", 'ulimit -t 3; exec "$@"', "sh")  # in place of 300 s
    done = run(tmp_path, "#include __FILE__\n#include __FILE__\n", *limited)
    assert done.returncode == 1
    assert "it takes more time, or more memory, than a compiler gets" in done.stderr
