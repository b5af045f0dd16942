"""A programmer on a pseudo terminal in front of a simulated chip: `kilotwin serve programmer`."""

from collections.abc import Callable
from pathlib import Path

from kilotwin.table.flash import chip_file
from kilotwin.table.ports.pseudo_terminal import PseudoTerminal

_WAIT_S = 0.1

Notify = Callable[[str], None]


class ServedProgrammer:
    """An STK500v2 with one chip, which `file` keeps; without a file it is gone at the end."""

    def __init__(self, file: Path | None, link: Path | None, notify: Notify) -> None:
        """Opens the port and makes the file. InputError if either cannot be."""
        self._file, self._notify = file, notify
        self._programmer = chip_file.plug_in(file)
        self._saved = chip_file.contents(self._programmer)
        if file is not None:
            chip_file.save(file, self._programmer)
        self.terminal = PseudoTerminal(link)
        self._open = False

    def step(self) -> None:
        """Waits a moment for the other side, and answers it."""
        data = self.terminal.read(_WAIT_S)
        if data:
            self._open = True
            answer = self._programmer.receive(data)
            # The file is whole before the last answer, after which a host may read it.
            if not self._programmer.programming:
                self._keep()
            self.terminal.write(answer)
        elif data is None or not self._programmer.programming:
            self._rest(closed=data is None)

    def close(self) -> None:
        """Unplugs the port; the chip stays in its file."""
        self.terminal.close()
        self._programmer.hang_up()
        self._keep()

    def _rest(self, *, closed: bool) -> None:
        if closed and self._open:
            self._open = False
            self._programmer.hang_up()
        self._keep()

    def _keep(self) -> None:
        now = chip_file.contents(self._programmer)
        if now == self._saved:
            return
        self._saved = now
        if self._file is not None:
            chip_file.save(self._file, self._programmer)
            self._notify(f"the chip has changed: {self._file}")
