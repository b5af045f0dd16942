"""A robot's state is what its LED shows; an experiment's [states] name the colours."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.experiment.colours import LED_COLOURS, LED_VALUES, led_byte, led_rgb
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.spec.aggregation import runs_aggregation

RESTING = "resting"

# firmware/aggregation
AGGREGATION = {
    "walking": LED_COLOURS["off"],
    "entering": LED_COLOURS["white"],
    "resting": LED_COLOURS["bright-white"],
    "leaving": LED_COLOURS["green"],
    "avoiding": LED_COLOURS["red"],
}


@dataclass(frozen=True)
class States:
    """`names[of_led[led]]` is the state of an LED byte.

    The first `known` names are the experiment's. The other names are plain colours, "RGB(r,g,b)",
    so that no colour a robot shows is lost.
    """

    names: list[str]
    of_led: NDArray[np.uint8]
    known: int

    @staticmethod
    def of(experiment: ExperimentSchema) -> "States":
        """The experiment's own [states], else those of aggregation where robots run it."""
        if experiment.states is not None:
            named = {name: (r, g, b) for name, (r, g, b) in experiment.states.items()}
        else:
            named = AGGREGATION if runs_aggregation(experiment) else {}
        return _states(tuple(named.items()))

    def of_robots(self, led: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Index into `names` for each LED byte; the two highest bits mean nothing."""
        return np.take(self.of_led, led & (LED_VALUES - 1))

    @property
    def resting(self) -> int:
        """The index of the state `resting`, or one that no robot has."""
        known = self.names[: self.known]
        return known.index(RESTING) if RESTING in known else len(self.names)


@functools.lru_cache
def _states(named: tuple[tuple[str, tuple[int, int, int]], ...]) -> States:
    """Kept, since each of many short trials asks for the same."""
    index_of = {led_byte(*colour): index for index, (_, colour) in enumerate(named)}
    names = [name for name, _ in named]
    for led in range(LED_VALUES):
        if led not in index_of:
            index_of[led] = len(names)
            names.append("RGB({},{},{})".format(*led_rgb(led)))
    of_led = np.array([index_of[led] for led in range(LED_VALUES)], dtype=np.uint8)
    return States(names, of_led, len(named))


@dataclass(frozen=True)
class Counts:
    """How many robots, per sample: resting on each site, not so, and in each known state; and by
    the state in the newest sample, colours without a meaning too."""

    resting: NDArray[np.int64]  # [k, sites]
    not_resting: NDArray[np.int64]  # [k]
    in_state: NDArray[np.int64]  # [k, known states]
    shown: dict[str, int]

    def last(self, keys: ExperimentSchema) -> dict[str, Any]:
        """The newest sample: robots `resting`, by the name of each site, and `not_resting`."""
        names = [site.name for site in keys.site]
        return {
            "resting": dict(zip(names, self.resting[-1].tolist(), strict=True)),
            "not_resting": int(self.not_resting[-1]),
        }


def count(states: States, led: NDArray[np.uint8], site: NDArray[np.uint8], sites: int) -> Counts:
    """Robots at rest on a site: the LED shows resting and the centre is inside the site."""
    state = states.of_robots(led)
    on_site = np.where(state == states.resting, site, 0)
    resting = _tally(on_site, range(1, sites + 1))
    in_state = _tally(state, range(states.known))
    newest = np.bincount(state[-1], minlength=len(states.names)) if len(state) else ()
    shown = {
        name: int(number) for name, number in zip(states.names, newest, strict=False) if number
    }
    return Counts(resting, led.shape[1] - resting.sum(axis=1), in_state, shown)


def _tally(shown: NDArray[np.uint8], values: range) -> NDArray[np.int64]:
    """[k, values]: in each row, how many are of each value."""
    counts = np.zeros((len(shown), len(values)), dtype=np.int64)
    for column, value in enumerate(values):
        counts[:, column] = np.count_nonzero(shown == value, axis=1)
    return counts
