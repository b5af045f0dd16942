"""Robot programs become guests: cached by content, errors in the compiler's words."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.programs import find_program
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native import guest as guest_build
from kilotwin.programs.native.guest import build

from ..conftest import BLINK

HERE = Path("/nowhere")

pytestmark = pytest.mark.usefixtures("cache")


@pytest.fixture(params=["gcc", "clang"])
def compiler(request: pytest.FixtureRequest, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs are compiled by each that is here."""
    name = str(request.param)
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not here")
    monkeypatch.setenv("KILOTWIN_CC", name)


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """A folder with spaces in its name and two sources that share a header."""
    folder = tmp_path / "my program"
    folder.mkdir()
    (folder / "blink.c").write_text(BLINK.replace("count++", "next_count()"))
    (folder / "blink.c").write_text('#include "count.h"\n' + (folder / "blink.c").read_text())
    (folder / "count.c").write_text('#include "count.h"\nint next_count(void) { return N; }\n')
    (folder / "count.h").write_text("#define N 1\nint next_count(void);\n")
    return folder


def test_a_program_is_compiled_once(program: Path) -> None:
    first = build(find_program(str(program), HERE))
    made = first.file.stat().st_mtime_ns
    assert build(find_program(str(program), HERE)) == first
    assert first.file.name == "my program.so"
    assert first.file.stat().st_mtime_ns == made


FORGETS = """\
#include <kilolib.h>
static int doubled(int value) { if (value > 3) return 2 * value; }
static void setup(void) {}
static void loop(void) { set_motors(doubled(kilo_ticks), 0); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""


@pytest.mark.usefixtures("compiler")
def test_a_missing_return_is_named_by_its_line_each_time(tmp_path: Path) -> None:
    (tmp_path / "forgets.c").write_text(FORGETS)
    for _ in range(2):
        said: list[str] = []
        build(find_program(str(tmp_path / "forgets.c"), HERE), said.append)
        assert "forgets.c:2:" in said[-1]
        assert "-Wreturn-type" in said[-1]
    (tmp_path / "whole.c").write_text(FORGETS.replace("if (value > 3) ", ""))
    build(find_program(str(tmp_path / "whole.c"), HERE), said.append)
    assert not any("whole.c:2:" in text for text in said)


def test_the_guest_exports_its_table_and_nothing_else(program: Path) -> None:
    guest = build(find_program(str(program), HERE))
    symbols = subprocess.run(
        ["nm", "-D", "--defined-only", guest.file], capture_output=True, text=True, check=True
    )
    assert [line.split()[-1] for line in symbols.stdout.splitlines()] == ["kt_table"]
    ctypes.CDLL(str(guest.file))


@pytest.mark.parametrize("file", ["blink.c", "count.c", "count.h"])
def test_a_change_of_any_file_compiles_anew(program: Path, file: str) -> None:
    before = build(find_program(str(program), HERE))
    (program / file).write_text((program / file).read_text() + "\n/* changed */\n")
    assert build(find_program(str(program), HERE)).key != before.key


def test_a_file_that_is_not_included_changes_nothing(program: Path) -> None:
    before = build(find_program(str(program), HERE))
    (program / "notes.h").write_text("not included")
    assert build(find_program(str(program), HERE)).key == before.key


def test_flags_compile_anew(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = build(find_program(str(program), HERE))
    monkeypatch.setenv("KILOTWIN_CFLAGS", "-O0")
    assert build(find_program(str(program), HERE)).key != before.key


@pytest.mark.skipif(shutil.which("clang") is None, reason="clang is not here")
def test_either_compiler_will_do(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KILOTWIN_CC", "clang")
    assert "clang" in build(find_program(str(program), HERE)).compiler


@pytest.mark.usefixtures("compiler")
def test_a_compile_error_is_shown_as_the_compiler_wrote_it(tmp_path: Path, cache: Path) -> None:
    source = tmp_path / "broken.c"
    source.write_text("#include <kilolib.h>\nint main(void) { return nothing; }\n")
    with pytest.raises(InputError) as caught:
        build(find_program(str(source), HERE))
    assert str(caught.value) == f"{source}: does not compile; mend what the compiler says"
    assert f"{source}:2:25: error: " in caught.value.detail
    assert "undeclared" in caught.value.detail
    assert "-Wno" not in caught.value.detail  # no complaint about our options
    assert not list(cache.rglob("*.so"))


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize(
    ("version", "knows"),
    [("gcc (Debian 12.2.0-14) 12.2.0", False), ("gcc (GCC) 14.1.0", True), ("gcc of mine", False)],
)
def test_gcc_is_told_only_what_its_version_knows(
    version: str, knows: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler, told, source = tmp_path / "cc", tmp_path / "told", tmp_path / "blink.c"
    compiler.write_text(
        f'#!/bin/sh\n[ "$1" = --version ] && echo "{version}" && exit\n'
        f'echo "$@" >> "{told}"\nexec gcc "$@"\n'
    )
    compiler.chmod(0o755)
    monkeypatch.setenv("KILOTWIN_CC", str(compiler))
    monkeypatch.setenv("KILOTWIN_CONFINE", "off")  # it writes where a compiler does not
    source.write_text(BLINK)
    build(find_program(str(source), HERE))
    assert ("-Wno-return-mismatch" in told.read_text()) == knows


def test_a_missing_header_is_a_compile_error(tmp_path: Path) -> None:
    source = tmp_path / "lost.c"
    source.write_text('#include "nowhere.h"\n')
    with pytest.raises(InputError) as caught:
        build(find_program(str(source), HERE))
    assert "nowhere.h" in caught.value.detail


@pytest.mark.usefixtures("compiler")
def test_what_nobody_has_is_named_with_the_files_that_want_it(program: Path) -> None:
    blink = (program / "blink.c").read_text()
    (program / "blink.c").write_text(blink.replace("next_count()", "fly_away() + next_count()"))
    (program / "count.c").write_text("extern int lost;\nint *next_count(void) { return &lost; }\n")
    with pytest.raises(InputError) as caught:
        build(find_program(str(program), HERE))
    assert str(caught.value) == (
        f"{program}: neither the program nor the API has fly_away, lost; write what is missing, "
        "or add the file that has it"
    )
    line = 1 + blink.splitlines().index(next(x for x in blink.splitlines() if "next_count" in x))
    assert caught.value.detail.splitlines() == [
        f"{program}/blink.c:{line}: undefined reference to 'fly_away'",
        f"{program}/count.c:2: undefined reference to 'lost'",
    ]


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("sleep(1)", r"a robot has no sleep\(\): delay\(1000\) waits 1,000 ms; a loop\(\) that"),
        ("usleep(5)", r"a robot has no usleep\(\): delay"),
        ("millis()", r"a robot has no millis\(\): kilo_ticks counts 31 a second"),
    ],
)
def test_what_a_pc_or_another_board_has_is_answered_with_what_a_robot_has(
    tmp_path: Path, call: str, said: str
) -> None:
    source = tmp_path / "mine.c"
    blink = BLINK.replace("#include <kilolib.h>", "#include <kilolib.h>\n#include <unistd.h>", 1)
    source.write_text(blink + f"void wait(void) {{ {call}; }}\n")
    for make in (build, build_image):
        with pytest.raises(InputError, match=said):
            make(find_program(str(source), HERE))


@pytest.mark.usefixtures("compiler")
def test_what_only_a_table_wants_is_named_too(tmp_path: Path) -> None:
    source = tmp_path / "table.c"
    source.write_text("void fly(void);\nvoid (*const todo[])(void) = {fly};\n" + BLINK)
    with pytest.raises(InputError, match=r"has fly; write") as caught:
        build(find_program(str(source), HERE))
    assert caught.value.detail.startswith(f"{source}:")


def test_a_program_without_main_is_told_what_it_lacks(program: Path) -> None:
    (program / "blink.c").unlink()
    with pytest.raises(InputError) as caught:
        build(find_program(str(program), HERE))
    assert str(caught.value) == (
        f"{program}: has no main(); add the one that every program needs: it calls kilo_init() and "
        "kilo_start(setup, loop)"
    )
    assert caught.value.detail == ""
    with pytest.raises(InputError, match=r"calls module_init\(\) and module_start\(setup, loop\)"):
        build(find_program(str(program), HERE, api="module"))


def test_programs_side_by_side_in_a_folder_are_told_apart(program: Path) -> None:
    shutil.copy(program / "blink.c", program / "other.c")
    with pytest.raises(InputError, match=r"blink.c and other.c each have a main\(\)"):
        build(find_program(str(program), HERE))


def test_a_compiler_that_is_not_there_is_named(
    program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CC", "no-such-cc")
    with pytest.raises(InputError, match="KILOTWIN_CC=no-such-cc: there is no such compiler"):
        build(find_program(str(program), HERE))


def test_without_any_compiler_one_is_told_what_to_type(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(RunError, match="apt-get install gcc"):
        guest_build.find_compiler()


def test_a_cache_that_cannot_be_written_is_named(
    program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CACHE", "/proc/cache")
    with pytest.raises(RunError, match="set KILOTWIN_CACHE"):
        build(find_program(str(program), HERE))


def test_our_own_firmware_is_a_guest() -> None:
    assert build(find_program("firmware/aggregation", HERE)).name == "aggregation"


@pytest.mark.usefixtures("compiler")
def test_old_c_builds_as_upstream_takes_it(tmp_path: Path) -> None:
    """No prototypes, no types, one variable in two files, values of the wrong type."""
    (tmp_path / "main.c").write_text("""
#include "kilolib.h"
int shared;
message_t message;
int *place;
char *name;
long number;
static counter = 5;
message_t *answer() { return &message; }
void hear(message_t *m) { shared += m->data[0]; }
void setup() { place = &number; name = 3; number = name; }
int nothing() { return; }
void something() { return 3; }
void loop() { helper(3); counter += nothing(); }
main(int argc, char **argv) {
    kilo_message_tx = answer;
    kilo_message_rx = hear;
    kilo_init();
    kilo_start(setup, loop);
}
""")
    (tmp_path / "other.c").write_text("int shared;\nvoid helper(int n) { shared = n; }\n")
    guest = build(find_program([str(tmp_path / name) for name in ("main.c", "other.c")], HERE))
    symbols = symbols_of(guest.file)
    assert symbols["kt_state_begin"] <= symbols["shared"] < symbols["kt_state_end"]
    assert guest.name == "main"


def symbols_of(file: Path) -> dict[str, int]:
    lines = subprocess.run(["nm", file], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in lines.splitlines()]
    return {row[2]: int(row[0], 16) for row in rows if len(row) == 3}


@pytest.mark.usefixtures("compiler")
def test_an_inline_function_need_not_be_inlined(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CFLAGS", "-O0")
    (tmp_path / "in.c").write_text(
        BLINK.replace(
            "static int count;", "inline int one(void) { return 1; }\nstatic int count;"
        ).replace("count++", "count += one()")
    )
    assert build(find_program(str(tmp_path / "in.c"), HERE)).file.exists()


@pytest.mark.usefixtures("compiler")
def test_a_function_may_be_declared_by_width_and_defined_by_name(tmp_path: Path) -> None:
    """On an AVR int is int16_t and long is int32_t; what only the PC needs stays as it is."""
    source = tmp_path / "widths.c"
    source.write_text("""
#include <string.h>
#include "kilolib.h"
extern volatile unsigned long kilo_ticks;
int16_t half(int16_t number);
uint32_t sizes[6];
uint8_t length;
void setup(void) {
    length = strlen("unsigned int");
    sizes[0] = sizeof(int);
    sizes[1] = sizeof(unsigned long int);
    sizes[2] = sizeof(long long);
    sizes[3] = sizeof(unsigned char);
    sizes[4] = sizeof(long double);
    sizes[5] = half(-6) + 10;
}
void loop(void) {}
int half(int number) { return number / 2; }
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
""")
    with World(program=str(source), count=1, arena=1.0, cpu="native") as world:
        world.command("run")
        world.run(1)
        assert world.variable(0, "sizes") == [2, 4, 8, 1, 16, 7]
        assert world.variable(0, "length") == len("unsigned int")


def test_what_upstreams_headers_let_pass_builds(tmp_path: Path) -> None:
    """No prototypes, macros that leave nothing behind, variables by their name, more headers."""
    (tmp_path / "main.c").write_text("""
#include <kilombo.h>
#include "debug.h"
#include "ohc.h"
#include "ringbuffer.h"
printf("a macro without a semicolon")
typedef struct { int count; } USERDATA;
extern USERDATA myuserdata;
REGISTER_USERDATA(USERDATA)
RB_create(heard, gpsmsg_t, 4);
void setup() {
    spinup_motors(255, 255);
    rand_seed(rand_hard(1) + rand_soft(10));
    printf("so is this") RB_init(heard);
}
void loop() {
    RB_back(heard).x = get_voltage(0) + get_ambientlight(1) + get_temperature(2);
    RB_pushback(heard);
    myuserdata.count = heard.count;
}
int main() {
    debug_init()
    kilo_init(1);
    kilo_start(setup, loop);
    return 0;
}
""")
    with World(program=str(tmp_path / "main.c"), count=1, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.variable(0, "myuserdata") == {"count": 4}


@pytest.mark.usefixtures("compiler")
def test_only_what_avr_gcc_knows_is_known_without_a_header(tmp_path: Path) -> None:
    (tmp_path / "known.c").write_text("""
#include "kilolib.h"
#if defined(__linux__) || defined(__unix__) || !defined(__AVR__)
#error this is a robot
#endif
int linux, unix;
void setup(void) {
    __builtin_avr_sei();
    __builtin_avr_delay_cycles(8000);
    linux = __builtin_avr_swap(0x12);
}
void loop(void) {}
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
""")
    with World(program=str(tmp_path / "known.c"), count=1, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.variable(0, "linux") == 0x21


def test_a_jump_to_0_starts_the_program_again(tmp_path: Path) -> None:
    source = tmp_path / "jump.c"
    source.write_text(BLINK.replace("delay(500)", '__asm__ volatile("jmp 0x0000")'))
    with World(program=str(source), count=1, arena=1.0, cpu="native") as world:
        world.run(1)
        assert [event["kind"] for event in world.events] == ["note"]


@pytest.mark.parametrize("name", ["with $igns & = (signs).c", ".c", "@a,b;c.c"])
def test_any_name_will_do(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(BLINK)
    assert build(find_program(str(tmp_path / name), HERE)).file.exists()


def test_a_programs_own_headers_are_not_hidden_by_ours(tmp_path: Path) -> None:
    """But a kilolib.h is, which may be a simulator's, and <time.h> is not what lies beside."""
    for folder in ("source", "include", "simulator"):
        (tmp_path / folder).mkdir()
    (tmp_path / "source" / "time.h").write_text("#define TIME 1\n")
    (tmp_path / "include" / "debug.h").write_text("#define OWN TIME\n")
    (tmp_path / "simulator" / "kilolib.h").write_text("#error no robot\n")
    main = tmp_path / "source" / "main.c"
    lines = ["<time.h>", '"time.h"', '"debug.h"', '"kilolib.h"']
    text = "".join(f"#include {line}\n" for line in lines)
    main.write_text(text + BLINK.replace("count++", "count += OWN + time(NULL)"))
    folders = [str(tmp_path / "simulator"), str(tmp_path / "include")]
    assert build(find_program(str(main), HERE, folders)).name == "main"


def test_headers_and_macros_may_come_from_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "headers").mkdir()
    (tmp_path / "headers" / "far.h").write_text("#define COLOUR RGB(LEVEL, 0, 0)\n")
    source = tmp_path / "far.c"
    source.write_text('#include "far.h"\n' + BLINK.replace("RGB(1, 1, 1)", "COLOUR"))
    words = [str(source)], HERE, [str(tmp_path / "headers")]
    first = build(find_program(*words, ["LEVEL=1"]))
    assert build(find_program(*words, ["LEVEL=2"])).key != first.key
    with pytest.raises(InputError, match="does not compile"):
        build(find_program(*words))


LIVES = """
void loop(void) {}
int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


@pytest.mark.usefixtures("compiler")
def test_a_program_may_write_into_its_texts(tmp_path: Path) -> None:
    """On an AVR they lie in RAM. Each robot has its own."""
    source = tmp_path / "texts.c"
    source.write_text(
        """
#include <string.h>
#include "kilolib.h"
char *name = "robot 0";
uint8_t was, word;
void setup(void) {
    char *words = "stop,go";
    was = name[6];
    name[6] += kilo_uid + 1;
    word = strtok(words, ",")[3];
}
"""
        + LIVES
    )
    with World(program=str(source), count=3, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.events == []
        assert [world.variable(robot, "was") for robot in range(3)] == [ord("0")] * 3
        assert world.variable(0, "word") == ord("p")


@pytest.mark.usefixtures("compiler")
def test_constructors_run_for_each_robot_before_main(tmp_path: Path) -> None:
    source = tmp_path / "early.c"
    source.write_text(
        """
#include "kilolib.h"
uint8_t order[3], count;
__attribute__((constructor(200))) static void second(void) { order[count++] = 2; }
__attribute__((constructor(101))) static void first(void) { order[count++] = 1; }
__attribute__((constructor)) static void third(void) {
    order[count++] = 3;
    set_color(RGB(1, 0, 0));
}
void setup(void) {}
"""
        + LIVES
    )
    with World(program=str(source), count=2, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.events == []
        assert [world.variable(robot, "order") for robot in range(2)] == [[1, 2, 3]] * 2


@pytest.mark.usefixtures("compiler")
def test_assembly_of_the_avr_is_left_out_where_it_does_not_compile(tmp_path: Path) -> None:
    source = tmp_path / "assembly.c"
    source.write_text(
        """
#include <avr/interrupt.h>
#include "kilolib.h"
#define SWAP(x) asm volatile("swap %0" : "=r"(x) : "0"(x))
uint8_t number = 5, text, handled;
static inline uint8_t status(void) {
    uint8_t sreg = 7;
    __asm__ __volatile__(
        "in __tmp_reg__, __SREG__ \\n\\t"  // a comment, and a )
        "cli" "\\n\\t"
        "out __SREG__, __tmp_reg__"
        : "=r"(sreg) : "I"(0x3F) : "memory", "r0");
    return sreg;
}
void __attribute__((interrupt, used)) __vector_13(void) { handled++; }
void setup(void) {
    register uint8_t value asm("r24") = 3;
    SWAP(value);
    asm("nop");
    text = sizeof("asm(\\"swap\\") )");
    number += value + status();
}
"""
        + LIVES
    )
    with World(program=str(source), count=1, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.events == []
        assert world.variable(0, "number") == 15
        assert world.variable(0, "text") == len('asm("swap") )') + 1


def test_a_program_that_spoils_its_heap_goes_on(tmp_path: Path) -> None:
    """Written beyond a block, freed twice, freed what never was a block."""
    source = tmp_path / "heap.c"
    source.write_text(
        """
#include <stdlib.h>
#include <string.h>
#include "kilolib.h"
uint8_t *volatile block;
uint8_t got, none[4], here;
void setup(void) {
    __malloc_margin = 64;
    for (uint8_t i = 0; i < 10; i++) {
        block = malloc(4);
        memset(block, i & 1 ? 0 : 255, 40);
    }
    free(block);
    free(block);
    free(block + 1);
    free(none + 1);
    free(&here);
    got = malloc(100) != NULL && realloc(block + 8, 3) == NULL;
}
"""
        + LIVES
    )
    with World(program=str(source), count=1, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.events == []
        assert world.variable(0, "got") == 1


@pytest.mark.usefixtures("compiler")
def test_more_of_avr_libc_is_there(tmp_path: Path) -> None:
    """Borders of the memory, fuses by avr/io.h alone, input from a program's own stream."""
    source = tmp_path / "more.c"
    source.write_text(
        """
#include <avr/io.h>
#include <limits.h>
#include <stdio.h>
#include "kilolib.h"
#if __AVR_LIBC_VERSION__ < 10600UL
#error too old
#endif
FUSES = {.low = LFUSE_DEFAULT, .high = HFUSE_DEFAULT, .extended = EFUSE_DEFAULT};
extern int __heap_start, *__brkval;
extern uint8_t _end, __stack, __bss_end, __data_start;
uint8_t modes = SLEEP_MODE_PWR_DOWN;
int left, number, other, letter, more;
char text[3];
static int give(FILE *stream) {
    static uint8_t at;
    (void)stream;
    return "12 x\\n345\\nab"[at++];
}
static FILE input = FDEV_SETUP_STREAM(NULL, give, _FDEV_SETUP_READ);
static int free_ram(void) {
    int here;
    return (int)&here - (__brkval == 0 ? (int)&__heap_start : (int)__brkval);
}
void setup(void) {
    left = free_ram() + (SP - (uint16_t)&_end) + (&__bss_end - &__data_start) + __stack;
    stdin = &input;
    more = fscanf(stdin, "%d", &number) + (LONG_LONG_MAX > 0);
    letter = getchar();
    ungetc('9', stdin);
    scanf("%d", &other);
    fread(text, 1, 2, stdin);
}
"""
        + LIVES
    )
    with World(program=str(source), count=1, arena=1.0, cpu="native") as world:
        world.run(1)
        assert world.events == []
        seen = [world.variable(0, name) for name in ("number", "letter", "other", "more")]
        assert seen == [12, ord("3"), 945, 2]
        assert world.variable(0, "text")[:2] == [ord("a"), ord("b")]
