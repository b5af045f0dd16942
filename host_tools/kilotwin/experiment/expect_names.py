"""The names that an `[[expect]]` may look at, and their values at a sample."""

import difflib
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.colours import LED_COLOURS, LED_VALUES, led_byte
from kilotwin.experiment.expression import Value
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.states import Counts, States
from kilotwin.units import seconds

if TYPE_CHECKING:
    from kilotwin._emulator import Samples

MEANINGS = {
    "time_s": "seconds since the begin",
    "robots": "how many robots there are",
    "failed": "robots whose program crashed, overflowed its stack or computed for ever",
    "not_resting": "robots that rest on no site",
    "resting.SITE": "robots that rest on a site",
    "site.SITE": "robots on a site, whatever they do",
    "state.STATE": "robots in a state of [states]",
    "led.COLOUR": "robots whose LED has a colour: off, red, bright_red ...",
}
"""The names and their meanings, beside the experiment's metrics."""

_NO_LETTER = re.compile(r"[^A-Za-z0-9_]")


class Names:
    """Those of one experiment. Where a site's or state's name is no word, both `site["a b"]` and
    `site.a_b` are it."""

    def __init__(self, experiment: ExperimentSchema) -> None:
        self._metrics = frozenset(experiment.metric)
        sites = {site.name: number for number, site in enumerate(experiment.site, start=1)}
        states = States.of(experiment)
        self._resting = _by_word("resting", {name: n - 1 for name, n in sites.items()})
        self._on_site = _by_word("site", sites)
        self._in_state = _by_word(
            "state", {name: n for n, name in enumerate(states.names[: states.known])}
        )
        leds = {name: led_byte(*colour) for name, colour in LED_COLOURS.items()}
        self._led = _by_word("led", leds)
        plain = [name for name in MEANINGS if "." not in name]
        tables = (self._resting, self._on_site, self._in_state, self._led)
        self.known: tuple[str, ...] = (
            *experiment.metric,
            *(name for name in plain if name not in self._metrics),
            *(name for table in tables for name in table),
        )
        """All of them, the experiment's metrics first."""

    def problem_of(self, wanted: Iterable[str]) -> str:
        """The complaint about the first of these names that there is not; "" if all are there."""
        for name in wanted:
            if name not in self.known:
                near = difflib.get_close_matches(name, self.known, n=1)
                hint = f"did you mean '{near[0]}'? There are" if near else "there are"
                return f"there is no '{name}'; {hint}: {self._listed(name)}"
        return ""

    def _listed(self, name: str) -> str:
        """The names of the same kind, or in short all that there are."""
        kind, dot, _ = name.partition(".")
        same = [known for known in self.known if dot and known.startswith(f"{kind}.")]
        if same:
            return ", ".join(same)
        own = [known for known in self.known if not known.startswith("led.")]
        return ", ".join([*own, "led.COLOUR"])

    def values(
        self,
        wanted: Iterable[str],
        samples: "Samples",
        k: int,
        counts: Counts,
        *,
        metrics: Mapping[str, NDArray[np.float64]],
        failed: int,
    ) -> dict[str, Value]:
        """The values of known names at the k-th of some samples of the engine, whose counts and
        metrics these are; `failed` robots have none of their program."""
        found: dict[str, Value] = {}
        led, site = samples["led"][k] & (LED_VALUES - 1), samples["site"][k]
        for name in wanted:
            if name in self._metrics:
                value = float(metrics[name][k])
                found[name] = None if np.isnan(value) else value
            elif name in self._resting:
                found[name] = float(counts.resting[k, self._resting[name]])
            elif name in self._on_site:
                found[name] = float(np.count_nonzero(site == self._on_site[name]))
            elif name in self._in_state:
                found[name] = float(counts.in_state[k, self._in_state[name]])
            elif name in self._led:
                found[name] = float(np.count_nonzero(led == self._led[name]))
            else:
                found[name] = {
                    "time_s": seconds(int(samples["tick"][k])),
                    "robots": float(len(led)),
                    "failed": float(failed),
                    "not_resting": float(counts.not_resting[k]),
                }[name]
        return found


def _by_word(kind: str, numbers: Mapping[str, int]) -> dict[str, int]:
    """`site.a_b` and `site.a b`, by number; a name that is a word itself goes before."""
    words = {f"{kind}.{_NO_LETTER.sub('_', name)}": number for name, number in numbers.items()}
    return {**words, **{f"{kind}.{name}": number for name, number in numbers.items()}}
