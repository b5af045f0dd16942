"""The process of a paired run: a PairedRun on stdin, a Measured on stdout, both JSON.

`python -m kilotwin.programs.port.paired_worker PARENT`. It ends with its parent.
"""

import os
import sys
from pathlib import Path

from kilotwin import _emulator
from kilotwin.files import confinement
from kilotwin.files.confined_process import confine_process
from kilotwin.programs.port.paired_run import Measured, PairedRun


def main() -> None:
    """Runs what is ordered."""
    _emulator.end_with_parent(int(sys.argv[1]))
    wanted = PairedRun.model_validate_json(sys.stdin.buffer.read())
    answers = os.dup(1)
    os.dup2(2, 1)  # what the program prints past the API is no answer
    os.write(answers, _measured(wanted).model_dump_json().encode())


def _measured(wanted: PairedRun) -> Measured:
    try:
        if confinement.mode() != "off":
            _confine(wanted)
        test = _emulator.DifferentialTest(
            guest=wanted.guest,
            tier="native",
            elf=wanted.elf,
            name=wanted.name,
            seed=wanted.seed,
            uid=wanted.uid,
            before_run=[],
            slack_s=wanted.slack_s,
            waits=wanted.waits,
            follow=wanted.follow,
            sums=wanted.sums,
            heard=[(tick, bytes.fromhex(message), mm) for tick, message, mm in wanted.heard],
        )
    except _emulator.EngineError as error:
        return Measured(error=str(error))
    while test.tick < wanted.ticks:
        before = test.tick
        test.run(min(wanted.look_ticks, wanted.ticks - test.tick))
        if test.tick < before + 1 or _is_decided(wanted, test):
            break
    return Measured.model_validate(test, from_attributes=True)


def _confine(wanted: PairedRun) -> None:
    missing = confine_process(1, readable=[Path(wanted.guest), Path(wanted.elf)])
    if missing and confinement.mode() == "require":
        raise _emulator.EngineError(f"--confine=require: {missing[0]}; use a newer kernel")


def _is_decided(wanted: PairedRun, test: _emulator.DifferentialTest) -> bool:
    watched = test.watched
    if wanted.to_difference and test.difference is not None:
        return True
    return watched is not None and watched["room_bytes"] < 0


if __name__ == "__main__":
    main()
