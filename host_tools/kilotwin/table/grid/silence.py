"""Tells modules that have gone silent from those whose programs pause in loop().

A module answers polls between two passes of its program's loop(), so that one which waits there for
seconds misses several polls and then answers. Two answers in a row that both come so late show a
pause. From then on modules, which all have one program, may be silent for twice as long as that.
"""

from collections.abc import Mapping

from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.table.grid.poller import Answer

SILENT_S = 4.0
"""Time without an answer after which a module is reported: longer than most programs pause."""
_PAUSES = 2.0
_SAME_S = 1e-6


class SilenceWatch:
    """All modules of a grid, by how long they do not answer."""

    def __init__(self) -> None:
        self._silent: dict[Module, None] = {}
        self._late_s: dict[Module, float] = {}
        self._patience_s = SILENT_S

    @property
    def silent(self) -> list[Module]:
        """Modules that were reported and have not answered since, in the order of that."""
        return list(self._silent)

    def newly_silent(self, unanswered_s: Mapping[Module, float]) -> list[Module]:
        """Modules to be reported now, of those that have not answered for so many seconds."""
        newly = [
            module
            for module, seconds in unanswered_s.items()
            if module not in self._silent and seconds > self._patience_s
        ]
        self._silent.update(dict.fromkeys(newly))
        return newly

    def take_late(self, answer: Answer) -> bool:
        """Takes an answer after several missed ones; whether it shows that the program pauses."""
        module = answer.module
        before_s = self._late_s.get(module)
        self._late_s[module] = answer.at_s
        if before_s is None or abs(answer.at_s - answer.silent_s - before_s) > _SAME_S:
            return False
        self._patience_s = max(self._patience_s, _PAUSES * answer.silent_s)
        return True

    def is_back(self, module: Module) -> bool:
        """Whether a module that answers had been reported; it no longer is."""
        if module not in self._silent:
            return False
        del self._silent[module]
        return True
