"""Runs the native tests (ctest) and the Python tests (pytest) and ends with one plain line.

They run side by side. pytest has a process more than there are cores, since tests that type a
person's commands (tests/system) often wait for a table that runs in real time; a file's tests stay
in one process. What the native tests print comes when pytest is done. The exit code is 0 only if
nothing failed and each ran something.
"""

import contextlib
import os
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"


@dataclass
class Count:
    passed: int = 0
    failed: int = 0
    skipped: int = 0

    def add(self, other: "Count") -> None:
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped


def read_junit(path: Path) -> Count:
    """Counts of a JUnit file as ctest or pytest writes it; all zero if it was not written."""
    count = Count()
    if not path.is_file():
        return count
    root = ET.parse(path).getroot()
    for suite in root.iter("testsuite"):
        tests, skipped = int(suite.get("tests", 0)), int(suite.get("skipped", 0))
        # ctest counts a test that is not built as "disabled", pytest a broken fixture as "errors".
        failed = int(suite.get("failures", 0)) + int(suite.get("errors", 0))
        skipped += int(suite.get("disabled", 0))
        count.add(Count(tests - failed - skipped, failed, skipped))
    return count


@dataclass
class Job:
    """Tests that run in a process; `output` is shown at the end, None: as it comes."""

    name: str
    report: Path
    process: "subprocess.Popen[bytes]"
    output: Path | None

    @staticmethod
    def start(name: str, command: list[str], report: Path, output: Path | None = None) -> "Job":
        report.unlink(missing_ok=True)
        with output.open("wb") if output else contextlib.nullcontext() as file:
            process = subprocess.Popen(command, cwd=ROOT, stdout=file, stderr=file)
        return Job(name, report, process, output)

    def finish(self) -> tuple[Count, bool]:
        code = self.process.wait()
        if self.output is not None:
            print(f"== {self.name}\n{self.output.read_text(errors='replace')}", flush=True)
        count = read_junit(self.report)
        return count, code == 0 and count.passed > 0


def main() -> int:
    started = time.monotonic()
    total, good = Count(), True
    jobs = []
    report = BUILD / "native.xml"
    command = ["ctest", "--test-dir", "build/engine", "--output-on-failure", "--no-tests=error"]
    command += ["--parallel", str(os.cpu_count()), "--output-junit", str(report)]
    jobs.append(Job.start("native tests", command, report, BUILD / "native-tests.log"))
    report = BUILD / "pytest.xml"
    command = [sys.executable, "-m", "pytest", "-m", "not long", f"--junitxml={report}", "tests"]
    command += ["--numprocesses", str((os.cpu_count() or 1) + 1), "--dist", "loadfile"]
    print("== Python tests", flush=True)
    jobs.append(Job.start("Python tests", command, report))

    for job in reversed(jobs):
        count, passed = job.finish()
        total.add(count)
        good = good and passed
    seconds = time.monotonic() - started
    print(f"\nAll tests took {seconds:.0f} s.")
    print(f"{total.passed} passed, {total.failed} failed, {total.skipped} skipped")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
