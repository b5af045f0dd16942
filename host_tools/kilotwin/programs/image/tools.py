"""The tools that build for the ATmega328P, found."""

import shutil

from kilotwin.errors import RunError

_TOOLS = ("avr-gcc", "avr-nm", "avr-ar", "avr-objcopy")


def avr_gcc() -> str:
    """The path of avr-gcc; RunError with the command that installs it if it is not there."""
    found = {tool: shutil.which(tool) for tool in _TOOLS}
    for tool, path in found.items():
        if path is None:
            raise RunError(
                f"{tool} is not here; type: apt-get install gcc-avr avr-libc binutils-avr"
            )
    return str(found["avr-gcc"])
