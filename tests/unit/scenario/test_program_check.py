"""`kilotwin check`: what it finds wrong with a program, and how CI services are told."""

import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from kilotwin.errors import InputError
from kilotwin.files.junit import Case, Suite, write_junit
from kilotwin.files.sarif import Result, write_sarif
from kilotwin.studies.scenario import program_check as checks
from kilotwin.studies.scenario.judge import judge
from kilotwin.studies.scenario.one_run import run_once
from kilotwin.studies.scenario.report import suite
from kilotwin.studies.scenario.runner import prepare

PROGRAM = """\
#include <kilolib.h>
static message_t out;
static message_t *tx(void) { return &out; }
static void setup(void) { out.crc = 1; }
static void loop(void) { set_color(RGB(1, 0, 0)); }
int main(void) { kilo_init(); kilo_message_tx = tx; kilo_start(setup, loop); return 0; }
"""
SCENARIO = """\
# Not met.
name = "scenario"
duration_s = 5
arena.diameter_m = 0.3
swarm = { profile = "kilobot", cpu = "native", program = "../my.c", size = 2 }
record.sample_s = 1
[[expect]]
that = "led.green == 2"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a program whose messages have a wrong CRC, and a scenario that is not met."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.c").write_text(PROGRAM)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios/green.toml").write_text(SCENARIO)
    return tmp_path


def test_every_finding_has_a_row_a_case_and_an_annotation(folder: Path) -> None:
    words = ("my.c", "--time", "2", "--flash", "100", "--sarif", "out/c.sarif", "--junit", "c.xml")
    done = subprocess.run(
        [sys.executable, "-m", "kilotwin", "check", *words, "-q"],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 1, done.stderr
    assert "ok    build" in done.stdout
    assert "FAIL  port" in done.stdout
    assert "[no-crc]" in done.stdout
    assert "more than the budget of 100 [size-flash]" in done.stdout
    assert "led.green = 0 at 5" in done.stdout
    run = json.loads(Path("out/c.sarif").read_text())["runs"][0]
    found = {result["ruleId"]: result for result in run["results"]}
    assert {"no-crc", "size-flash", "scenario"} <= found.keys()
    where = found["scenario"]["locations"][0]["physicalLocation"]
    assert where["artifactLocation"]["uri"] == "scenarios/green.toml"
    assert where["region"]["startLine"] == 7
    assert {rule["id"] for rule in run["tool"]["driver"]["rules"]} == found.keys()
    failed = {suite.get("name"): suite.get("failures") for suite in ET.parse("c.xml").getroot()}
    assert failed["check build"] == "0"
    assert failed["check size"] == "1"
    assert failed["check scenario"] == "1"


def test_a_program_that_does_not_compile_has_the_compilers_lines(folder: Path) -> None:
    (folder / "my.c").write_text("int main(void) { return nothing; }\n")
    step = checks.on_this_computer(checks.program_of(["my.c"], [], []), lambda _: None)
    assert step.fails
    (found, *_) = step.found
    assert (found.rule, found.line) == ("compile", 1)
    assert "nothing" in found.message
    with pytest.raises(InputError, match="is not there"):
        checks.program_of(["other.c"], [], [])


def test_scenarios_are_those_of_the_program_and_broken_ones_fail(folder: Path) -> None:
    (folder / "scenarios/broken.toml").write_text(SCENARIO.replace("led.green", "led.gren"))
    (folder / "other.c").write_text(PROGRAM)
    (folder / "scenarios/other.toml").write_text(SCENARIO.replace("my.c", "other.c"))
    files, unfit = checks.scenarios_beside(checks.program_of(["my.c"], [], []))
    assert [file.name for file in files] == ["green.toml"]
    (step,) = unfit
    assert (step.fails, step.found[0].line) == (True, 8)
    assert "did you mean 'led.green'" in step.text()


def test_a_crash_is_annotated_at_its_line_and_not_at_the_scenarios(folder: Path) -> None:
    loop = "static void loop(void) {\n    *(volatile int *)0x123456789000 = 1;\n}"
    (folder / "my.c").write_text(PROGRAM.replace(PROGRAM.splitlines()[4], loop))
    (scenario,) = prepare([folder / "scenarios/green.toml"], [], 60, lambda _: None)
    scenario.ran = {task.seed: run_once(task) for task in scenario.tasks}
    scenario.verdicts = judge(scenario.experiment, list(scenario.ran.values()))
    crash, that = checks.of_scenario(scenario).found
    assert (crash.file, crash.line) == (str(folder / "my.c"), 6)
    assert "crash at my.c:6 in loop(): Segmentation fault" in crash.message
    assert that.line == 7
    case = suite(scenario).cases[0]
    assert (case.file, case.line) == (str(folder / "my.c"), 6)


def test_what_no_service_can_read_is_left_out_and_a_full_disk_is_said(tmp_path: Path) -> None:
    cases = [Case("odd \x00 name", "said \x1b[31m", "detail"), Case("good", line=3, file="a.c")]
    write_junit(tmp_path / "j.xml", [Suite("s", cases, 2.0)])
    odd, good = ET.parse(tmp_path / "j.xml").getroot()[0]
    assert odd.get("name") == "odd ? name"
    assert (good.get("file"), good.get("line"), good.get("time")) == ("a.c", "3", "1.000")
    write_sarif(tmp_path / "s.sarif", [Result("rule", "note", "all of it")], tmp_path)
    assert "locations" not in (tmp_path / "s.sarif").read_text()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"--junit .*name another file"):
        write_junit(tmp_path / "file/j.xml", [])
    with pytest.raises(InputError, match=r"--sarif .*name another file"):
        write_sarif(tmp_path / "file/s.sarif", [], tmp_path)
