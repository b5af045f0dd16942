"""The modules of a Kilogrid."""

import signal
import subprocess
import time
from collections.abc import Callable
from typing import Any

from .conftest import KILOTWIN, ROOT, Person, Words

SITES = "kilogrid_modules/sites"
INTERRUPTED = 130
Told = Callable[..., Any]


def test_11_all_modules_answer(told: Told, can: Words, modules: int) -> None:
    """CAN adapters, bit rate, cables and addresses of all modules are right."""
    found = told("grid", "ls", *can)
    assert len(found["modules"]) == modules
    assert found["silent"] == []


def test_12_modules_are_flashed_and_each_is_verified(told: Told, can: Words, modules: int) -> None:
    """The modules' boot loader takes a program over CAN, says what it has, and starts it."""
    outcome = told("flash", "modules", SITES, *can)
    assert len(outcome["modules"]) == modules
    assert {module["result"] for module in outcome["modules"]} == {"verified"}
    assert all(module["answers"] for module in outcome["modules"])


def test_13_modules_say_how_they_are(told: Told, can: Words, modules: int) -> None:
    """The runtime answers for its health, and no bus has errors."""
    answers = told("grid", "health", *can)
    assert len(answers) == modules
    assert {answer["state"] for answer in answers} <= {"IDLE", "SETUP"}
    assert {answer["transmit_errors"] for answer in answers} == {0}


def test_14_a_flash_that_was_broken_off_goes_on(told: Told, can: Words, tmp_path: Any) -> None:
    """Ctrl-C in mid-flash leaves modules in their loaders, and the same command finishes."""
    other = str(tmp_path / "other.hex")
    told("build", "tests/system/programs/cell_module.c", "--for", "module", "--hex", other)
    started = subprocess.Popen(
        [KILOTWIN, "flash", "modules", other, *can], cwd=ROOT, stderr=subprocess.PIPE, text=True
    )
    assert started.stderr is not None
    for line in started.stderr:
        if line.startswith("lap 1"):
            time.sleep(0.5)
            started.send_signal(signal.SIGINT)
            break
    assert started.wait(30) == INTERRUPTED
    assert told("flash", "modules", other, *can)["failed"] == []
    assert told("flash", "modules", SITES, *can)["failed"] == []


def test_15_a_module_whose_power_fails_is_not_stuck(
    told: Told, can: Words, person: Person, tmp_path: Any
) -> None:
    """After a power cut in mid-flash a module waits in its loader, and is flashed the next time."""
    other = str(tmp_path / "other.hex")
    told("build", "tests/system/programs/cell_module.c", "--for", "module", "--hex", other)
    person("when 'lap 1' is shown, take the power of one module away for a second; ready?")
    subprocess.run([KILOTWIN, "flash", "modules", other, *can], cwd=ROOT, check=False)
    person("do all modules have power again?")
    assert told("flash", "modules", other, *can)["failed"] == []
    assert told("flash", "modules", SITES, *can)["failed"] == []


def test_16_a_bus_that_is_pulled_out_is_told(told: Told, can: Words, person: Person) -> None:
    """An unplugged bus ends in one line or a list, with its exit code, and nothing is stuck."""
    person("when 'calling' is shown, pull the CAN cable at the computer; ready?")
    done = subprocess.run([KILOTWIN, "flash", "modules", SITES, *can], cwd=ROOT, check=False)
    assert done.returncode in (3, 4)
    person("plug it in again; done?")
    assert told("flash", "modules", SITES, *can)["failed"] == []
