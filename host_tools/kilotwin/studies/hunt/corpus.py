"""The corpus: variations that reached something new, to be varied further."""

import random
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from kilotwin.studies.hunt.variation import Variation

Feature = tuple[Any, ...]
"""Something that a trial reached: of a program's code, or of an LED."""


@dataclass
class Corpus:
    """Variations in the order in which they came, and all features that were reached."""

    variations: list[Variation] = field(default_factory=list)
    reached: set[Feature] = field(default_factory=set)

    def learn(self, variation: Variation, reached: Iterable[Feature]) -> int:
        """Keeps the variation if it reached something new; how much that is."""
        new = set(reached) - self.reached
        if new:
            self.reached |= new
            self.variations.append(variation)
        return len(new)

    def choose(self, chance: random.Random) -> Variation:
        """One of them, the newest more often."""
        number = len(self.variations)
        return self.variations[number - 1 - int(number * chance.random() ** 2)]
