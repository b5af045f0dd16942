"""`kilotwin check --each`: thirty hand-ins of a class, in one table."""

import csv
import json
from pathlib import Path

from .conftest import Kilotwin

GOOD = """\
/* {name} */
#include <kilolib.h>
static message_t out;
static message_t *tx(void) {{ return &out; }}
static void setup(void) {{ out.type = NORMAL; out.crc = message_crc(&out); }}
static void loop(void) {{ set_color(RGB(0, 1, 0)); }}
int main(void) {{ kilo_init(); kilo_message_tx = tx; kilo_start(setup, loop); return 0; }}
"""
KINDS = {
    "good": ("", ""),
    "typo": ("set_color(RGB(0, 1, 0));", "set_color(RGB(0, 1, 0))"),
    "red": ("RGB(0, 1, 0)", "RGB(1, 0, 0)"),
    "silent": ("out.crc = message_crc(&out);", ""),
    "stuck": ("set_color(RGB(0, 1, 0));", "while (kilo_ticks < 1000000) {{ }}"),
    "crash": (
        "set_color(RGB(0, 1, 0));",
        "static int *at; if (kilo_ticks > 31) *at = *(at + 30000);",
    ),
}
SCENARIO = """\
name = "green"
duration_s = 3
arena.diameter_m = 0.3
swarm = { profile = "kilobot", cpu = "native", program = "solution.c", size = 2 }
[[expect]]
that = "led.green == robots"
at_s = 2
"""
REASONS = {
    "typo": "FAILS line 6: expected",
    "red": "led.green",
    "silent": "has no checksum",
    "stuck": "led.green",
}


def hand_ins(folder: Path, number: int) -> list[Path]:
    """So many programs, each kind in turn, and the task beside them."""
    (folder / "hand-ins").mkdir()
    (folder / "green.toml").write_text(SCENARIO)
    (folder / "solution.c").write_text(GOOD.format(name="solution"))
    files = []
    for index in range(number):
        kind = list(KINDS)[index % len(KINDS)]
        old, new = KINDS[kind]
        file = folder / "hand-ins" / f"{index:02}-{kind}.c"
        file.write_text((GOOD.replace(old, new) if old else GOOD).format(name=file.name))
        files.append(file)
    return files


def test_thirty_hand_ins_have_a_line_each_and_a_summary(kilotwin: Kilotwin, tmp_path: Path) -> None:
    files = hand_ins(tmp_path, 30)
    words = ("--scenarios", "green.toml", "--time", "2", "--csv", "marks/m.csv", "-q")
    names = [file.relative_to(tmp_path) for file in files]
    done = kilotwin("check", "--each", *names, *words, expect=1, folder=tmp_path)
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["program", "build", "port", "size", "scenarios", "result"]
    assert len(lines) == 32
    assert lines[-1] == "30 programs: 5 pass, 25 fail"
    for line, name in zip(lines[1:-1], names, strict=True):
        assert line.startswith(str(name))
        kind = name.stem.partition("-")[2]
        assert ("passes" in line) == (kind == "good")
        assert REASONS.get(kind, "") in line, line
    rows = list(csv.DictReader((tmp_path / "marks/m.csv").read_text().splitlines()))
    assert [row["passes"] for row in rows].count("yes") == 5
    assert rows[0]["scenarios_met"] == rows[0]["scenarios"] == "1"
    assert (rows[1]["build"], rows[1]["size"]) == ("FAIL", "-")


def test_what_is_not_there_is_a_line_and_stops_no_other(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (good,) = hand_ins(tmp_path, 1)
    (tmp_path / "empty").mkdir()
    words = ("empty", "gone.c", good.relative_to(tmp_path), "--time", "1", "--json", "-q")
    done = kilotwin("check", "--each", *words, expect=1, folder=tmp_path)
    told = json.loads(done.stdout)
    assert [one["fails"] for one in told["programs"]] == [True, True, False]
    assert "gone.c" in told["programs"][1]["steps"][0]["found"][0]["message"]


def test_csv_is_of_a_table(kilotwin: Kilotwin, tmp_path: Path) -> None:
    (good,) = hand_ins(tmp_path, 1)
    done = kilotwin("check", good, "--csv", tmp_path / "m.csv", expect=2)
    assert "--csv: is the table of --each; add --each" in done.stderr
