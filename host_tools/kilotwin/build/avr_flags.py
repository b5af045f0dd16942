"""The chip's compiler flags, from firmware/avr.mk, for the builds that the host does itself."""

import re
from functools import cache

from kilotwin.errors import KilotwinError
from kilotwin.files import resources

_FILE = "firmware/avr.mk"


@cache
def avr_words(name: str) -> tuple[str, ...]:
    """The words of a variable of firmware/avr.mk; KilotwinError if it has none of that name."""
    text = resources.path(_FILE).read_text()
    found = re.search(rf"^{name}\s*:=(.*)$", text, re.MULTILINE)
    if found is None:
        raise KilotwinError(f"{_FILE} lacks {name}; install kilotwin again")
    return tuple(found.group(1).split())


def clock_define() -> str:
    """The chip's clock in Hz as a macro, `-DF_CPU=...`."""
    return next(word for word in avr_words("AVR_CHIP") if word.startswith("-DF_CPU="))
