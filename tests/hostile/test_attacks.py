"""Programs of attacks.c: calls of the kernel, files, instructions. Each is refused and named, fails
or goes on as said, and changes nothing outside and for no other robot, also without Landlock."""

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

KILOTWIN = Path(sys.executable).with_name("kilotwin")
HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TEXT = (HERE / "attacks.c").read_text()

EXPERIMENT = """\
duration_s = 4
arena.diameter_m = 6.0
[swarm]
profile = "kilobot"
cpu = "native"
[record]
sample_s = 0.5
[[robots]]
program = "{program}"
define = [
    'VICTIM="{folder}/outside/victim"', 'OUTSIDE="{folder}/outside"', 'FOLDER="{folder}"',
    'LANDLOCK={landlock}',
]
count = {count}
[[robots]]
program = "{here}/innocent.c"
count = 4
"""


def table_of(name: str, line: str) -> list[str]:
    """Matches of `line` in a table of attacks.c."""
    text = TEXT[TEXT.index(f" {name}[") :]
    return re.findall(line, text[: text.index("\n};")], re.MULTILINE)


CALLS = table_of("CALLS", r"^    \{.*\}, +// (.+)$")
FILES = table_of("FILES", r"^    \{(.+), \d+\},")
OTHERS = re.findall(r"^static void (\w+)\(void\) \{", TEXT, re.MULTILINE)[:-2]
ATTACKS = [*CALLS, *FILES, *OTHERS]

REFUSED = "it made a system call that is not allowed here, "
SEGMENTATION = "Segmentation fault"
SLEEPS = "or slept for 10 s, while its clock stood still"
# Ends of those of OTHERS that are stopped: a part of what is said.
STOPPED = {
    "open_by_32_bit_code": REFUSED,
    "sysenter": f"{SEGMENTATION}|Illegal instruction",  # by the processor's maker
    "into_32_bit_code": SEGMENTATION,
    "far_return_into_nothing": SEGMENTATION,
    "talk_to_a_port": SEGMENTATION,
    "read_a_control_register": SEGMENTATION,
    "write_a_model_register": SEGMENTATION,
    "trap_each_instruction": "Trace/breakpoint trap",
    "over_the_c_library": SEGMENTATION,
    "over_the_engine": SEGMENTATION,
    "sleep_for_a_mutex": SLEEPS,
    "sleep_for_orders": SLEEPS,
    "send_at_nowhere": SEGMENTATION,
}
# The kernel tells of this one without its number.
UNNUMBERED = "a call with a negative number"


@dataclass
class Ran:
    """A run of them all, or of as many robots that do nothing."""

    folder: Path
    has_landlock: bool
    stderr: str
    summary: dict[str, Any]

    def said(self) -> dict[int, list[tuple[str, str]]]:
        """Events of each robot: kind and text."""
        of: dict[int, list[tuple[str, str]]] = {}
        for line in (self.folder / "run/events.jsonl").read_text().splitlines():
            event = json.loads(line)
            of.setdefault(event["robot"], []).append((event["kind"], event["text"]))
        return of

    def innocents(self) -> tuple[list[dict[str, Any]], list[str]]:
        """Rows and prints of the others."""
        rows = pq.read_table(self.folder / "run/robots.parquet").to_pylist()
        names = [f"robot-{robot + 1}.log" for robot in range(len(ATTACKS), len(ATTACKS) + 4)]
        prints = [(self.folder / "run/prints" / name).read_text() for name in names]
        return [row for row in rows if row["robot"] >= len(ATTACKS)], prints


def run(folder: Path, program: Path, *words: str, landlock: bool = True) -> Ran:
    outside = folder / "outside"
    outside.mkdir(parents=True)
    (outside / "victim").write_text("mine")
    names = {"program": program, "folder": folder, "here": HERE, "count": len(ATTACKS)}
    (folder / "swarm.toml").write_text(EXPERIMENT.format(**names, landlock=int(landlock)))
    done = subprocess.run(
        [KILOTWIN, "run", "swarm.toml", "--out", "run", "--json", *words],
        env={**os.environ, **({} if landlock else {"KILOTWIN_WITHOUT_LANDLOCK": "1"})},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert done.returncode in (0, 4), done.stderr
    assert [file.name for file in outside.iterdir()] == ["victim"]
    assert (outside / "victim").read_text() == "mine"
    assert sorted(file.name for file in folder.iterdir()) == ["outside", "run", "swarm.toml"]
    return Ran(folder, landlock, done.stderr, json.loads(done.stdout))


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    """A run of robots that do nothing in their place."""
    return run(tmp_path_factory.mktemp("without") / "it", ROOT / "firmware/blank.c")


@pytest.fixture(scope="module", params=["with Landlock", "without Landlock"])
def attacked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Ran:
    landlock = request.param == "with Landlock"
    words = ["--confine=require"] if landlock else []
    folder = tmp_path_factory.mktemp("attacked") / "it"
    return run(folder, HERE / "attacks.c", *words, landlock=landlock)


def test_there_are_as_many_attacks_as_said() -> None:
    assert min(len(CALLS), len(FILES), len(OTHERS)) > 20
    assert len(ATTACKS) > 170


def test_each_is_refused_and_named_or_goes_on_as_said(attacked: Ran) -> None:
    said = attacked.said()
    for robot, attack in enumerate(ATTACKS):
        ends = [text for kind, text in said.get(robot, []) if kind in ("crash", "endless")]
        wanted = REFUSED if attack in CALLS else STOPPED.get(attack, "")
        if attack == UNNUMBERED:
            wanted = "Bad system call"
        assert len(ends) == bool(wanted), (attack, said.get(robot))
        assert all(re.search(wanted, text) for text in ends), (attack, ends)
    failed = {robot["robot"] for robot in attacked.summary["robots_failed"]}
    assert failed == {
        robot for robot, attack in enumerate(ATTACKS) if attack in CALLS or attack in STOPPED
    }


def test_no_file_outside_is_opened(attacked: Ran) -> None:
    texts = [text for said in attacked.said().values() for _, text in said]
    opens = [text for text in texts if text.startswith("open ")]
    if attacked.has_landlock:
        assert opens == ["open -13"] * (len(FILES) + 1)  # and open_by_a_wide_number()


def test_the_records_of_others_are_those_of_a_run_without(attacked: Ran, without: Ran) -> None:
    rows, prints = attacked.innocents()
    assert len(rows) > 30
    assert (rows, prints) == without.innocents()


def test_nothing_of_it_reaches_the_terminal(attacked: Ran) -> None:
    assert "\x1b" not in attacked.stderr
    assert attacked.summary["peak_bytes"] < 1 << 29
