"""Programs whose words are changed for this computer: all of what they wrote, to the last line.

A preprocessor puts a marker behind a comment of eight lines and more, and on both sides of what a
system header's macro stands for; what follows it is the program's own still.
"""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.programs.native.robot_assembly import without_assembly
from kilotwin.programs.native.robot_widths import with_robots_widths

pytestmark = pytest.mark.usefixtures("cache")

COMMENT = "/*\n" + " * A long story.\n" * 9 + " */\n"
BEFORE = {
    "nothing": "",
    "a long comment": COMMENT,
    "many empty lines": "\n" * 12,
    "a macro of a system header": "#include <stddef.h>\nvoid *nothing = NULL;\n",
    "a header of its own, with a comment": '#include "own.h"\n',
    "line ends of other alphabets in a text": 'const char *text = "a\x0bb\x85c\u2028d";\n',
}
BEHIND = """
void setup(void) { result = f(); }
void loop(void) {}
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""
# The example of docs/limits.md.
LIMITS = (Path(__file__).parents[3] / "docs/limits.md").read_text()
DECLARED, DEFINED = re.findall(r"declares `(.*?)` and defines `(.*?)`", LIMITS)[0]
WIDTHS = f"{DECLARED}\n{DEFINED} {{ return 7; }}\n"
ASSEMBLY = 'int f() {\n    asm("cli"\n' + COMMENT + '    );\n    asm("sei");\n    return 7;\n}\n'


@pytest.fixture(params=["gcc", "clang"])
def compiler(request: pytest.FixtureRequest) -> str:
    """Each that is here: their markers differ."""
    if shutil.which(request.param) is None:
        pytest.skip(f"{request.param} is not here")
    return str(request.param)


@pytest.mark.parametrize("before", BEFORE.values(), ids=BEFORE)
def test_words_are_changed_behind(before: str, compiler: str, tmp_path: Path) -> None:
    (tmp_path / "own.h").write_text(f"{COMMENT}int16_t f();\n{COMMENT}")
    source = tmp_path / "program.c"
    source.write_text(f"int first;\n{before}{ASSEMBLY}")
    done = subprocess.run([compiler, "-E", source], capture_output=True, text=True, check=True)
    assert "short f()" in with_robots_widths(done.stdout, [])
    assert "asm" not in without_assembly(done.stdout, [])


@pytest.mark.parametrize("words", [WIDTHS, ASSEMBLY + "int16_t f();\n"])
def test_a_program_builds_whatever_is_before_these_words(
    words: str, compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CC", compiler)
    (tmp_path / "own.h").write_text(f"{COMMENT}int16_t f();\n{COMMENT}")
    program = tmp_path / "program.c"
    before = "".join(BEFORE.values())
    program.write_text(f'#include "kilolib.h"\n{COMMENT}int result;\n{before}{words}{BEHIND}')
    with World(program=str(program), count=1, arena=1.0) as world:
        world.run(1)
        assert world.events == []
        assert world.variable(0, "result") == 7


PREPROCESSED = """\
# 1 "program.c"
int a;
# 9 "/headers/kilolib.h" 1
int b; asm("b");
# 12 "program.c" 2
int c; asm("c"
# 20 "program.c"
  );
int d =
# 22 "/usr/include/limits.h" 3 4
int
# 22 "program.c"
;
"""


def test_headers_are_left_alone() -> None:
    changed = with_robots_widths(PREPROCESSED, ["/headers/"])
    expected = PREPROCESSED
    for own in ("int a", "int c", "int d"):
        expected = expected.replace(own, own.replace("int", "short"))
    assert changed == expected


def test_what_is_behind_left_out_assembly_keeps_its_line() -> None:
    changed = without_assembly(PREPROCESSED, ["/headers/"])
    assert changed == PREPROCESSED.replace('asm("c"\n', "\n").replace("  );\n", ";\n")
