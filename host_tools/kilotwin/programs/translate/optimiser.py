"""Faster code of translations, made beside a run that goes on long enough for it.

As `python -m kilotwin.programs.translate.optimiser FILE...` it is the process that makes them, at
the lowest priority.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from kilotwin.programs.native.guest import Guest

# No run is known to be long before it has gone on for so much wall time.
_BEGIN_S = 1.0
# Time that gcc takes for a byte of C on an idle core: 1.9 s for 63 KB, 11 s for 244 KB.
_S_PER_BYTE = 4e-5


class Optimiser:
    """Makes the optimised code of guests that have none yet, once a run is known to be long: when
    the rest of it takes longer than the compiler. Left as a context, the compiler is ended.
    """

    def __init__(self, guests: Iterable[Guest]) -> None:
        self._targets = [guest.optimised for guest in guests if guest.optimised is not None]
        self._takes_s = sum(map(_seconds_of, self._targets))
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def note(self, ran_s: float, left_s: float) -> None:
        """The run has gone on for so much wall time, and will go on for as long as `left_s`."""
        if self._targets and ran_s >= _BEGIN_S and left_s > self._takes_s:
            self._start(self._targets)
            self._targets = []

    def close(self) -> None:
        """Ends the compiler, if it has not ended."""
        self._targets = []
        if self._process is not None:
            self._process.terminate()
            self._process.wait()
            self._process = None

    def _start(self, targets: Sequence[Path]) -> None:
        command = [sys.executable, "-P", "-m", "kilotwin.programs.translate.optimiser"]
        self._process = subprocess.Popen(
            [*command, *map(str, targets)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            process_group=0,
        )


def _seconds_of(target: Path) -> float:
    from kilotwin.programs.translate.translation import sources_of

    return _S_PER_BYTE * max(file.stat().st_size for file in sources_of(target).glob("*.c"))


def main() -> None:
    """Makes the files that the arguments name."""
    from kilotwin.programs.translate.translation import optimise

    # SystemExit leaves optimise(), which ends its compiler.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    os.nice(19)
    for target in sys.argv[1:]:
        optimise(Path(target))


if __name__ == "__main__":
    main()
