"""Runs whose world several threads step, confined as users have them: the result is the same."""

import json
from pathlib import Path

import pytest

from .conftest import Kilotwin

FAILED = 4
WALK = "firmware/examples/random_walk_counter.c"

FILE = """\
name = "threads"
duration_s = 20
seed = 3
[arena]
shape = "rectangle"
width_m = 1.2
height_m = 1.0
[swarm]
profile = "kilobot"
[[robots]]
program = "{walk}"
count = 40
cpu = "{cpu}"
[[robots]]
program = "{fails}"
define = ["FAILS={natively}"]
count = 4
cpu = "{cpu}"
[medium]
kind = "{medium}"
"""

FAILS = """\
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static void setup(void) { debug_init(); }

static void loop(void) {
#if FAILS
    if (kilo_ticks > 100 && kilo_uid == 42)
        for (volatile uint8_t *lost = (uint8_t *)setup;; lost += 4096) *lost = 1;
    if (kilo_ticks > 200 && kilo_uid == 44)
        for (volatile uint16_t i = 0;; i++) continue;
#endif
    printf("%d at %ld\\n", kilo_uid, (long)kilo_ticks);
    delay(1000);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


@pytest.mark.parametrize("cpu", ["native", "translated"])
@pytest.mark.parametrize("medium", ["ideal", "kilobot"])
def test_threads_change_neither_the_result_nor_what_is_told(
    kilotwin: Kilotwin, tmp_path: Path, cpu: str, medium: str
) -> None:
    fails = tmp_path / "fails.c"
    fails.write_text(FAILS)
    file = tmp_path / "threads.toml"
    walk = Path(WALK).resolve()
    natively = int(cpu == "native")  # a chip goes on
    keys = {"walk": walk, "fails": fails, "natively": natively, "cpu": cpu, "medium": medium}
    file.write_text(FILE.format(**keys))
    told = []
    for threads in (1, 2, 3, 8):
        out = tmp_path / str(threads)
        words = ["run", file, "--no-twin", "--json", "--out", out]
        expect = FAILED if natively else 0
        done = kilotwin(*words, "--set", f"engine.threads={threads}", expect=expect)
        summary = json.loads(done.stdout)
        prints = sorted(file.read_text() for file in out.glob("prints/*"))
        told.append([summary["result_hash"], summary["stats"], prints])
    assert told[1:] == told[:1] * 3


def test_a_number_of_threads_that_cannot_be_is_refused(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (tmp_path / "fails.c").write_text(FAILS)
    file = tmp_path / "threads.toml"
    keys = {"walk": "fails.c", "fails": "fails.c", "natively": 1, "cpu": "native"}
    text = FILE.format(**keys, medium="ideal")
    file.write_text(text + "[engine]\nthreads = 0\n")
    told = kilotwin("run", file, "--out", tmp_path / "run", expect=2)
    assert "engine.threads" in told.stderr
    assert "1" in told.stderr
    assert "32" in told.stderr
