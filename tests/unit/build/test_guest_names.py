"""A program may call its own things what it likes, but for what a robot's headers declare.

The names tried are all that our headers and our half of a guest mention, and all that the PC's libc
exports: a guest that got one of those, or the emulator that got one of a guest's, would show.
"""

import re
import subprocess
from pathlib import Path

import pytest

from kilotwin import World

ROOT = Path(__file__).parents[3]
API = ["kilolib.h", "message.h", "message_crc.h"]
TALKER = """
#include "kilolib.h"
message_t message;
message_t *answer(void) {
    message.crc = message_crc(&message);
    return &message;
}
void setup(void) {}
void loop(void) {}
int main(void) {
    kilo_init();
    kilo_message_tx = answer;
    kilo_start(setup, loop);
    return 0;
}
"""
# Keywords, and macros that a compiler has defined.
TAKEN = """
auto break case char const continue default do double else enum extern float for goto if inline int
long register restrict return short signed sizeof static struct switch typedef typeof union unsigned
void volatile while asm main F_CPU AVR
"""
# Names of stdint.h and of this test; the last one makes a program one for the Kilogrid.
OTHERS = re.compile(r"u?int\w+_t$|U?INT\w*_(MIN|MAX|C)$|KILOTWIN_|kt_|KT_|own_|IR_message_t$")
OWN = """
static uint16_t own_heard;
static message_t own_message;
static void own_hear(message_t *message, distance_measurement_t *distance) {
    (void)message;
    if (estimate_distance(distance) < 255) own_heard++;
}
static message_t *own_answer(void) {
    own_message.crc = message_crc(&own_message);
    return &own_message;
}
static void own_setup(void) { spinup_motors(); }
static void own_loop(void) { set_color((uint8_t)kilo_ticks); }
int main(void) {
    kilo_init();
    kilo_message_rx = own_hear;
    kilo_message_tx = own_answer;
    kilo_start(own_setup, own_loop);
    return 0;
}
"""


def words(text: str) -> set[str]:
    return set(re.findall(r"\b[A-Za-z]\w*\b", re.sub(r"//.*", "", text)))


def names() -> list[str]:
    header = ROOT / "firmware/kilolib/include"
    api = set().union(*(words((header / name).read_text()) for name in API))
    ours = [*header.glob("*.h"), *(ROOT / "emulator/robots/native").rglob("*.[ch]")]
    mentioned = set().union(*(words(file.read_text()) for file in ours))
    for library in ("libc.so.6", "libm.so.6"):
        file = run("gcc", f"-print-file-name={library}").strip()
        mentioned |= words(run("nm", "-D", "--defined-only", "--format=just-symbols", file))
    return sorted(word for word in mentioned - api - words(TAKEN) if not OTHERS.match(word))


def run(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("form", ["int %s = 5;", "int %s(int a, int b) { return a + b; }"])
def test_names_are_the_programs_own(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KILOTWIN_CFLAGS", "-O0")
    tried = names()
    assert {"write", "malloc", "index", "time", "y1", "gamma", "put", "flags"} <= {*tried}
    lines = [form % name for name in tried]
    own = tmp_path / "own.c"
    own.write_text("\n".join(['#include "kilolib.h"', *lines, OWN]))
    (tmp_path / "talker.c").write_text(TALKER)
    kinds = [{"program": str(own), "count": 1}, {"program": str(tmp_path / "talker.c"), "count": 2}]
    native = [{**kind, "cpu": "native"} for kind in kinds]
    with World(robots=native, arena=(0.12, 0.12)) as world:
        world.run(10)
        assert world.events == []
        assert world.variable(0, "own_heard") > 10
