"""The child process of a run: steps the engine, writes the run folder, reports.

It answers with one JSON object per line on stdout: folder, once there is one, started, progress,
then done or error (run.py has them). The parent ends a run early by closing its stdin, which the
parent's own death does too. Robot programs run in this process; one that brings it down leaves the
parent to close the folder.

As `python -m kilotwin.session.worker PARENT` it takes a pickled Job on stdin first
(worker_process.py).
"""

import contextlib
import json
import os
import pickle
import select
import signal
import sys
from collections.abc import Callable
from typing import Any

from kilotwin import _emulator
from kilotwin.errors import (
    EXIT_INTERRUPTED,
    EXIT_ROBOTS_FAILED,
    InputError,
    KilotwinError,
    RunError,
    cause_of,
)
from kilotwin.files import extras
from kilotwin.programs.coverage.marks import marks_of_all
from kilotwin.runs.folder import INTERRUPTED, add_to_manifest, close_manifest
from kilotwin.runs.writer import RunWriter
from kilotwin.session.confined_worker import confine_worker
from kilotwin.session.job import Job
from kilotwin.session.recorder import Report
from kilotwin.session.trial import Trial

# Time to close the folder when the parent has died; a program that never returns has no more.
_GRACE_S = 10.0


def main() -> None:
    """Runs the job of stdin, for the parent whose process id is the argument."""
    serve(pickle.load(sys.stdin.buffer), int(sys.argv[1]))


def serve(job: Job, parent: int) -> None:
    """Runs the job for the process `parent`; stdin and stdout are pipes to it."""
    _emulator.end_with_parent(parent, _GRACE_S)
    # Ctrl-C is for the parent, which then closes our stdin.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Output of libraries and programs must not get between the reports.
    reports = os.dup(1)
    os.dup2(2, 1)

    def report(message: dict[str, Any]) -> None:
        # A parent that died is noticed by `stopped`, with the folder in order.
        with contextlib.suppress(BrokenPipeError):
            line = memoryview(json.dumps(message).encode() + b"\n")
            while line:
                line = line[os.write(reports, line) :]

    def stopped() -> bool:
        return bool(select.select([0], [], [], 0)[0])

    try:
        simulate(job, report, stopped, confine_worker)
    except ModuleNotFoundError as error:
        lacks = extras.explained(error)
        report({"type": "error", "exit_code": lacks.exit_code, "message": str(lacks)})
    except KilotwinError as error:
        report({"type": "error", "exit_code": error.exit_code, "message": str(error)})


def simulate(
    job: Job,
    report: Report,
    stopped: Callable[[], bool],
    confine: Callable[[Job], dict[str, Any]] | None = None,
) -> None:
    """Runs the experiment to its end or until `stopped`. A refused one leaves no folder.

    `confine` is called before the first program is loaded; what it returns goes into the manifest.
    It is for a process that does nothing else.
    """

    def make_writer() -> RunWriter:
        writer = _make_folder(job)
        report({"type": "folder"})
        return writer

    def confine_now() -> None:
        if confine is not None:
            add_to_manifest(job.folder, confine(job))

    trial = Trial(job, report, make_writer, confine_now)
    try:
        interrupted = not trial.run(stopped)
        summary = trial.summary(interrupted)
        trial.close()
        trial.writer.close(clean=not interrupted)
        exit_code = _exit_code(summary)
        close_manifest(job.folder, summary["status"], exit_code, summary=summary)
    except OSError as error:
        raise RunError(f"{job.folder}: cannot write ({cause_of(error)}); see to the disk") from None
    marks = marks_of_all(job.all_guests) if job.covered else []
    report({"type": "done", "exit_code": exit_code, "summary": summary, "marks": marks})


def _exit_code(summary: dict[str, Any]) -> int:
    if summary["status"] == INTERRUPTED:
        return EXIT_INTERRUPTED
    grid = summary.get("grid", {})
    failed = summary["robots_failed"] or summary["undefined"] or grid.get("modules_failed")
    failed = failed or grid.get("undefined")
    return EXIT_ROBOTS_FAILED if failed else 0


def _make_folder(job: Job) -> RunWriter:
    engine = {
        "version": _emulator.VERSION,
        "build": _emulator.BUILD,
        "box2d": _emulator.BOX2D_VERSION,
        "guest_abi": _emulator.GUEST_ABI,
    }
    try:
        return RunWriter(job.folder, job.experiment, {**job.manifest, "engine": engine})
    except OSError as error:
        raise InputError(f"--out {job.folder}: {cause_of(error)}; name another folder") from None


if __name__ == "__main__":
    main()
