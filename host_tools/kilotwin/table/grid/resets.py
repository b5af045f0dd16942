"""Tells a module that lost power from one whose program lets answers wait.

An original module does not say whether it was reset, and a program that pauses in loop() answers a
poll late, as a module does that has just started. Two things tell them apart. A module that was
reset was silent for 1.2 s at least. And it is idle then: it has no reports, and answers each poll
within a step of its lights, 70 ms. So a module that was silent so long is watched, and taken for
reset when some answers in a row are prompt. Each answer that is not shows that programs pause here;
then more of them are waited for, since a program that pauses is prompt now and then.
"""

from enum import Enum

from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.table.grid.poller import Answer

BOOT_S = 1.2
"""How long a module is silent after a reset."""
# A step of an idle module's lights, an answer's way, a host that is a little late.
_PROMPT_S = 0.2
# Prompt answers in a row: of the first module, and once many have shown that they pause.
_FEWEST, _MOST = 4, 32


class ResetVerdict(Enum):
    """Facts that an answer tells of its module."""

    RUNS = "runs"
    WATCH = "watch"
    """Its next answers are to be seen too."""
    RESET = "reset"


class ResetWatch:
    """All modules of a grid, by the answers to their polls."""

    def __init__(self) -> None:
        self._prompt: dict[Module, int] = {}
        self._pausing: set[Module] = set()

    @property
    def needed(self) -> int:
        """How many answers in a row must be prompt."""
        return min(_FEWEST << min(len(self._pausing), 8), _MOST)

    @property
    def pausing(self) -> int:
        """How many modules have shown that they pause."""
        return len(self._pausing)

    def forget(self, module: Module | None = None) -> None:
        """Watches this module no more, or none."""
        if module is None:
            self._prompt.clear()
        else:
            self._prompt.pop(module, None)

    def take(self, answer: Answer) -> ResetVerdict:
        """Judges a module by an answer; all of a module that is watched are to come here."""
        module = answer.module
        if answer.records:
            # Reports that it had from robots are lost in a reset, and an idle module takes none.
            self._prompt.pop(module, None)
            return ResetVerdict.RUNS
        if module not in self._prompt:
            if not answer.missed or answer.silent_s < BOOT_S:
                return ResetVerdict.RUNS
            self._prompt[module] = 0
            return ResetVerdict.WATCH
        if answer.missed or answer.late_s > _PROMPT_S:
            self._pausing.add(module)
            self._prompt[module] = 0
            return ResetVerdict.WATCH
        self._prompt[module] += 1
        if self._prompt[module] < self.needed:
            return ResetVerdict.WATCH
        del self._prompt[module]
        return ResetVerdict.RESET
