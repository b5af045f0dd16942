"""The chip's compiler flags, from firmware/avr.mk, for the builds that the host does itself."""

import re
from functools import cache

from kilotwin.errors import KilotwinError
from kilotwin.files import resources

_FILE = "firmware/avr.mk"
_REFERENCE = re.compile(r"\$\((\w+)\)")


@cache
def avr_words(name: str) -> tuple[str, ...]:
    """The words of a variable of firmware/avr.mk, those that it refers to among them.

    KilotwinError if it has none of that name.
    """
    text = resources.path(_FILE).read_text()
    found = re.search(rf"^{name}\s*:=(.*)$", text, re.MULTILINE)
    if found is None:
        raise KilotwinError(f"{_FILE} lacks {name}; install kilotwin again")
    text = _REFERENCE.sub(lambda name: " ".join(avr_words(name[1])), found.group(1))
    return tuple(text.split())


def clock_define() -> str:
    """The chip's clock in Hz as a macro, `-DF_CPU=...`."""
    return next(word for word in avr_words("AVR_CHIP") if word.startswith("-DF_CPU="))
