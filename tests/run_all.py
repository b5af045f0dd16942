"""Runs the native tests (ctest) and the Python tests (pytest) and ends with one plain line.

Both run even if the first fails. The exit code is 0 only if nothing failed and both ran something.
"""

import argparse
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


def run(name: str, command: list[str], report: Path) -> tuple[Count, bool]:
    print(f"== {name}", flush=True)
    report.unlink(missing_ok=True)
    code = subprocess.run(command, cwd=ROOT, check=False).returncode
    count = read_junit(report)
    return count, code == 0 and count.passed > 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--long", action="store_true", help="run only the long tests")
    arguments = parser.parse_args()

    started = time.monotonic()
    total, good = Count(), True
    jobs = []
    if not arguments.long:
        report = BUILD / "native.xml"
        command = ["ctest", "--test-dir", "build/native", "--output-on-failure", "--no-tests=error"]
        command += ["--parallel", str(os.cpu_count()), "--output-junit", str(report)]
        jobs.append(("native tests", command, report))
    report = BUILD / "pytest.xml"
    marker = "long" if arguments.long else "not long"
    command = [sys.executable, "-m", "pytest", "-m", marker, f"--junitxml={report}", "tests"]
    jobs.append(("Python tests", command, report))

    for name, command, report in jobs:
        count, passed = run(name, command, report)
        total.add(count)
        good = good and passed
    seconds = time.monotonic() - started
    print(f"\nAll tests took {seconds:.0f} s.")
    print(f"{total.passed} passed, {total.failed} failed, {total.skipped} skipped")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
