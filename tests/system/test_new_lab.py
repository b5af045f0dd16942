"""A repository made by `kilotwin new`: its own CI steps are green, and red for planted faults."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from kilotwin.files import origins, templates

pytestmark = pytest.mark.long

STEP = re.compile(r"^\s*- (?:run: )?((?:kilotwin|pytest) .*)$", re.MULTILINE)
ORIGIN = origins.find("git+https://example.org/kilotwin.git")  # the steps do not install it
CI = (".github/workflows/robots.yml", ".gitlab-ci.yml")

Shell = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def shell(environment: dict[str, str]) -> Shell:
    """Types a line in a folder, with `kilotwin` and `pytest` on the path, and no network."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

    def type_(line: str, folder: Path) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            line,
            shell=True,
            cwd=folder,
            env={**environment, "PATH": path, "http_proxy": "http://127.0.0.1:9"},
            capture_output=True,
            text=True,
            check=False,
            timeout=600,
        )

    return type_


@pytest.mark.parametrize("kind", templates.KINDS)
def test_the_steps_of_both_ci_services_are_green(kind: str, shell: Shell, tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    templates.write(kind, folder, ORIGIN)
    steps = {ci: STEP.findall((folder / ci).read_text()) for ci in CI}
    assert steps[CI[0]] == steps[CI[1]]
    assert len(steps[CI[0]]) == 3
    readme = re.search(r"^```\n(.*?)^```", (folder / "README.md").read_text(), re.M | re.S)
    assert readme is not None
    lines = [line.partition("#")[0].strip() for line in readme[1].splitlines()[1:]]
    for line in dict.fromkeys([*steps[CI[0]], *lines]):
        done = shell(line, folder)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
    assert {file.name for file in (folder / "build").iterdir()} == {
        *("check.sarif", "check.xml", "coverage", "pytest.xml", "scenarios.xml")
    }
    assert (folder / "build/coverage/index.html").exists()


# Each fault: the text, the one in its place, and the words that pytest must have for it.
FAULTS: dict[str, tuple[str, str, str]] = {
    "hang": (
        "    set_color(has_it",
        "    while (has_it) without.data[1] ^= 1;\n    set_color(has_it",
        "it has been busy for 10 s without coming back",
    ),
    "crash": (
        "    set_color(has_it",
        "    if (has_it) (*(void (*)(void))0xFFFF0000)();\n    set_color(has_it",
        "crash at spread.c:35 in loop(): ",
    ),
    "wrong colour": ("RGB(0, 1, 0)", "RGB(0, 0, 1)", "RGB(0,0,1)"),
    "lost CRC": (
        "    without.crc = message_crc(&without);\n    with.crc = message_crc(&with);\n",
        "",
        "has no checksum: message_crc() is never called",
    ),
    "int overflow on the chip": (
        "STEP_TICKS 62",
        "STEP_TICKS (62 * 600 / 600)",
        "int",
    ),
    "stack": (
        "static void loop(void) {\n",
        "static void loop(void) {\n    volatile uint8_t path[1900];\n"
        "    for (uint16_t i = 0; i < sizeof path; i++) path[i] = 1;\n",
        "stack",
    ),
    "silent robot": (
        "return has_it ? &with",
        "return kilo_uid == 7 ? 0 : has_it ? &with",
        "robot 7 sent 0 messages/s",
    ),
    "too slow": (
        "in->data[0]) has_it",
        "in->data[0] && kilo_ticks > 3000) has_it",
        "within_s = 50: reached = 0.05",
    ),
    "too large": (
        "static uint32_t stepped_at;\n\n",
        "static uint32_t stepped_at;\n\n#include <avr/pgmspace.h>\n"
        "static const uint8_t table[9000] PROGMEM = {1};\n"
        "uint8_t from_table(uint16_t at) { return pgm_read_byte(&table[at]); }\n",
        "more than the budget of 8,000",
    ),
    "misses the statistic": (
        "in->data[0]) has_it",
        "in->data[0] && kilo_uid != 9 && kilo_uid != 10 && kilo_uid != 11) has_it",
        "a share of 0 [0, 0.17], which is below 0.8",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_turns_it_red_and_is_named(
    fault: str, shell: Shell, tmp_path: Path
) -> None:
    folder = tmp_path / "lab"
    templates.write("robots", folder, ORIGIN)
    program = folder / "spread.c"
    before, after, said = FAULTS[fault]
    text = program.read_text()
    assert text.count(before) == 1
    program.write_text(text.replace(before, after))
    done = shell("pytest -q", folder)
    assert done.returncode == 1, done.stdout + done.stderr
    assert said in done.stdout
