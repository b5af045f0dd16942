"""docs/porting.md has a section for each finding: code that gets it, and code that does not."""

import re
from pathlib import Path

import pytest

from kilotwin.programs.port.check import Report, check
from kilotwin.programs.port.findings import CHECKS
from kilotwin.programs.port.trial import Trial

TEXT = (Path(__file__).parents[2] / "docs/porting.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^### \[([\w-]+)\]\n(.*?)(?=^##)", TEXT, re.MULTILINE | re.DOTALL))
# Functions that a page does not show in each of its pieces.
FUNCTIONS = {
    "void setup(": "static void setup(void) {}\n",
    "void loop(": "static void loop(void) {}\n",
}
CALLBACKS = {
    "on_message(": "    kilo_message_rx = on_message;\n",
    "on_transmit(": "    kilo_message_tx = on_transmit;\n",
}
HEADERS = ("kilolib.h", "math.h", "stdlib.h", "avr/interrupt.h", "avr/pgmspace.h")
# Findings of a run; the others are found in the code.
OF_A_RUN = {
    *("stops", "stack-meets-data", "fails-here", "differs-in-passes", "differs", "array-bounds"),
    *("int-overflow", "float-to-int", "long-callback", "ticks-lost", "differs-in-time"),
}
TRIAL_S = 8


def pieces(name: str) -> list[str]:
    return re.findall(r"^```c\n(.*?)^```", SECTIONS[name], re.MULTILINE | re.DOTALL)


def whole(piece: str) -> str:
    """The program that a piece of the page is from."""
    functions = "".join(text for name, text in FUNCTIONS.items() if name not in piece)
    callbacks = "".join(text for name, text in CALLBACKS.items() if name in piece)
    includes = "".join(f"#include <{header}>\n" for header in HEADERS)
    return (
        f"{includes}{piece}{functions}int main(void) {{\n    kilo_init();\n{callbacks}"
        "    kilo_start(setup, loop);\n    return 0;\n}\n"
    )


def checked(piece: str, name: str, folder: Path) -> Report:
    (folder / "piece.c").write_text(whole(piece))
    trial = Trial(TRIAL_S) if name in OF_A_RUN else None
    return check([str(folder / "piece.c")], [], [], trial, lambda _: None)


def test_each_finding_has_its_section_and_no_other_has() -> None:
    assert tuple(SECTIONS) == CHECKS


def test_each_finding_is_in_the_overview_with_its_link() -> None:
    assert re.findall(r"\[([\w-]+)\]\(#\1\)", TEXT) == list(CHECKS)


@pytest.mark.parametrize("name", CHECKS)
def test_the_first_piece_gets_the_finding_and_the_second_gets_none(
    name: str, tmp_path: Path
) -> None:
    bad, good = pieces(name)
    report = checked(bad, name, tmp_path)
    assert name in {finding.check for finding in report.findings}
    assert f"[{name}]" in report.text()
    assert "docs/porting.md" in report.text()
    assert checked(good, name, tmp_path).findings == ()
