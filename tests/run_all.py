"""Runs the native tests (ctest) and the Python tests (pytest) and ends with one plain line.

They run side by side. Python tests that mostly wait, for a table in real time or for a browser,
have the marker `waits` and a wide pool of processes of their own, which goes first where both want
a core; those that compute have a process more than there are cores. In both a process that has
nothing to do takes tests from the one that has most, so that a long file does not come last alone.
What the native tests and the wide pool print comes when the others are done. Last come the names of
the tests that failed, since a log that CI keeps may be cut in the middle. The exit code is 0 only
if nothing failed and each ran something.
"""

import contextlib
import os
import subprocess
import sys
import tempfile
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


def read_failures(path: Path) -> list[str]:
    """A line for each test of a JUnit file that failed: its name, and the first line of why."""
    if not path.is_file():
        return []
    lines = []
    for case in ET.parse(path).getroot().iter("testcase"):
        for reason in [*case.findall("failure"), *case.findall("error")]:
            # ctest gives a class the name of its test.
            named = dict.fromkeys([case.get("classname", ""), case.get("name", "")])
            why = (reason.get("message") or "").strip().partition("\n")[0]
            lines.append(f"{'::'.join(filter(None, named))}: {why}"[:300])
    return lines


@dataclass
class Job:
    """Tests that run in a process; `output` is shown at the end, None: as it comes."""

    name: str
    report: Path
    process: "subprocess.Popen[bytes]"
    output: Path | None

    @staticmethod
    def start(
        name: str, command: list[str], report: Path, output: Path | None = None, **more: str
    ) -> "Job":
        """`more`: of the process's environment."""
        report.unlink(missing_ok=True)
        with output.open("wb") if output else contextlib.nullcontext() as file:
            process = subprocess.Popen(
                command, cwd=ROOT, env={**os.environ, **more}, stdout=file, stderr=file
            )
        return Job(name, report, process, output)

    def finish(self) -> tuple[Count, bool]:
        code = self.process.wait()
        if self.output is not None:
            print(f"== {self.name}\n{self.output.read_text(errors='replace')}", flush=True)
        count = read_junit(self.report)
        return count, code == 0 and count.passed > 0


CORES = os.cpu_count() or 1
# Which tests, and in how many processes; the last pool's are seen as they go.
POOLS = {
    "waits": ("not long and waits", 3 * CORES),
    "computes": ("not long and not waits", CORES + 1),
}
_YIELD = ["nice", "-n", "5"]


def native_tests() -> Job:
    report = BUILD / "native.xml"
    command = ["ctest", "--test-dir", "build/engine", "--output-on-failure", "--no-tests=error"]
    command += ["--parallel", str(CORES), "--timeout", "1200", "--output-junit", str(report)]
    return Job.start("native tests", [*_YIELD, *command], report, BUILD / "native-tests.log")


def files_that_wait() -> list[str]:
    """Files that name the marker, so that each process of the wide pool reads them alone."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return [str(file.relative_to(ROOT)) for file in files if "mark.waits" in file.read_text()]


def python_tests(pool: str, guests: str) -> Job:
    """`guests`: the folder for compiled programs, the same for all pools."""
    marked, processes = POOLS[pool]
    report = BUILD / f"pytest-{pool}.xml"
    files = files_that_wait() if pool == "waits" else ["tests"]
    command = [sys.executable, "-m", "pytest", "-m", marked, f"--junitxml={report}", *files]
    command += ["--numprocesses", str(processes), "--dist", "worksteal"]
    is_shown = pool == list(POOLS)[-1]
    return Job.start(
        f"Python tests: {pool}",
        command if pool == "waits" else [*_YIELD, *command],
        report,
        None if is_shown else BUILD / f"pytest-{pool}.log",
        TESTS_GUESTS=guests,
    )


def main() -> int:
    started = time.monotonic()
    total, good = Count(), True
    failures: list[str] = []
    with tempfile.TemporaryDirectory(prefix="kilotwin-tests-") as guests:
        jobs = [native_tests(), *(python_tests(pool, guests) for pool in POOLS)]
        print(f"== {jobs[-1].name}", flush=True)
        for job in reversed(jobs):
            count, passed = job.finish()
            total.add(count)
            failures += read_failures(job.report)
            good = good and passed
    seconds = time.monotonic() - started
    print(f"\nAll tests took {seconds:.0f} s.")
    for line in failures:
        print(f"failed: {line}")
    print(f"{total.passed} passed, {total.failed} failed, {total.skipped} skipped")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
