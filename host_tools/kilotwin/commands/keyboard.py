"""Keys of a terminal, one by one as they are pressed."""

import contextlib
import sys
import termios
import tty
from collections.abc import Iterator

_END = ("", "\x03", "\x04")


@contextlib.contextmanager
def keys() -> Iterator[Iterator[str]]:
    """The keys of stdin's terminal, which is as it was afterwards. Ctrl-C and Ctrl-D end them."""
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)
    try:
        yield _pressed()
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _pressed() -> Iterator[str]:
    with contextlib.suppress(KeyboardInterrupt):
        while (key := sys.stdin.read(1)) not in _END:
            yield key
