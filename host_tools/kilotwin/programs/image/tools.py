"""The tools that build for the ATmega328P, found."""

import shutil

from kilotwin.errors import RunError
from kilotwin.experiment.processor import missing_tool


def avr_gcc() -> str:
    """The path of avr-gcc; RunError with the command that installs it if it is not there."""
    if lacks := missing_tool():
        raise RunError(lacks)
    return str(shutil.which("avr-gcc"))
