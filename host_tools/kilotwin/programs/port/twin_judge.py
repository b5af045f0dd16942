"""The process that finds a twin's verdict: pickled program and guest on stdin, JSON on stdout.
What the program itself does it leaves to a paired run, which is confined.

`python -m kilotwin.programs.port.twin_judge PARENT`. It ends with its parent.
"""

import json
import pickle
import sys
from dataclasses import asdict

from kilotwin import _emulator
from kilotwin.errors import InputError, KilotwinError, RunError
from kilotwin.experiment.programs import Program
from kilotwin.programs.image.image import Image, build_image
from kilotwin.programs.native.guest import Guest
from kilotwin.programs.port import paired_run
from kilotwin.programs.port.disassembly import Disassembly
from kilotwin.programs.port.paired_run import Measured
from kilotwin.programs.port.roles import find_roles, own_lines
from kilotwin.programs.port.trial import Trial, paired, waits
from kilotwin.programs.port.twin import TWIN_S, Ear, TwinVerdict
from kilotwin.units import ticks

_SEED = 1
_TIMEOUT_S = 60.0


def main() -> None:
    """Judges what is on stdin."""
    _emulator.end_with_parent(int(sys.argv[1]))
    program, guest, ear = pickle.load(sys.stdin.buffer)
    sys.stdout.write(json.dumps(asdict(verdict(program, guest, ear))))


def verdict(program: Program, guest: Guest, ear: Ear | None = None) -> TwinVerdict:
    """Both run for TWIN_S, or to the first difference, with the messages of `ear`."""
    name = program.written
    try:
        image = build_image(program)
    except InputError as error:
        return TwinVerdict(name, False, f"which does not build for the ATmega328P: {error}")
    except RunError as error:
        return TwinVerdict(name, None, f"{error}")
    try:
        return judged(name, _measured(program, guest, image, ear), ear)
    except KilotwinError as error:
        return TwinVerdict(name, None, f"{error}")


def _measured(program: Program, guest: Guest, image: Image, ear: Ear | None) -> Measured:
    code = Disassembly.of(image)
    wanted = paired(
        Trial(TWIN_S, _SEED, ear),
        guest,
        image,
        # With no function to follow: else a reading of the battery is not the same on both.
        follow=[],
        waits=waits(code, find_roles(own_lines(program))),
        to_difference=True,
        look_ticks=ticks(TWIN_S),
    )
    return paired_run.run(wanted, _TIMEOUT_S)


def judged(name: str, measured: Measured, ear: Ear | None = None) -> TwinVerdict:
    """The verdict by what was measured."""
    if failure := measured.native_failure or measured.avr_failure:
        where = "here" if measured.native_failure else "on the robot"
        return TwinVerdict(name, False, f"it cannot go on {where}: {failure}")
    if measured.difference is not None:
        got = "" if ear is None else f", with the messages that robot {ear.uid} got"
        first = f"first at tick {measured.difference.tick:,}: {measured.difference.text}{got}"
        why = f'`kilotwin port {name}` says why, cpu = "translated" runs it as the robot does'
        return TwinVerdict(name, False, f"{first}; {why}")
    how_many = f"{measured.compared:,} decisions in {TWIN_S:g} s"
    return TwinVerdict(name, True, f"{how_many} are as on its ATmega328P")


if __name__ == "__main__":
    main()
