"""The `[[expect]]` tables of an experiment: what `kilotwin test` wants to see of it."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from kilotwin.experiment.expression import Expression
from kilotwin.experiment.schema.section import Section, Share

Seconds = Annotated[float, Field(ge=0, le=1e9)]
Rate = Annotated[float, Field(ge=0, le=1000)]
Runs = Annotated[int, Field(ge=1, le=10_000)]

KINDS = (
    "that",
    "share",
    "no_crash",
    "no_busy_wait",
    "no_undefined",
    "no_mistake",
    "messages_per_robot_s",
)
"""Keys of which an [[expect]] has one: what is expected."""

SHARE_RUNS = 20
"""Runs of an [[expect]] with a share that does not say how many."""


def _expression(text: str) -> str:
    Expression.of(text)
    return text


def _range(bounds: list[float]) -> list[float]:
    if bounds[0] > bounds[1]:
        raise ValueError("must be [least, most]")
    return bounds


Bounds = Annotated[list[Rate], Field(min_length=2, max_length=2), AfterValidator(_range)]
Condition = Annotated[str, AfterValidator(_expression)]


class Expect(Section):
    """Something that `kilotwin test` expects of a run; the run itself does not depend on it.

    Each has one of `that`, `share`, `no_crash`, `no_busy_wait`, `no_undefined`, `no_mistake` and
    `messages_per_robot_s`.
    """

    that: Condition | None = None
    """A condition, as "resting.black >= 60": docs/testing.md. It must hold in each run."""
    share: Condition | None = None
    """The same; the share of runs in which it holds is judged."""
    at_least: Share | None = None
    """share: fails if the whole 95 % interval is below."""
    at_most: Share | None = None
    """share: fails if the whole 95 % interval is above."""
    runs: Runs | None = None
    """How many runs, with seeds from `seed` on. If left out: 20 for a share, else one, or all runs
    of other expectations."""
    at_s: Seconds | None = None
    """When it must hold: at the nearest sample. Without any time: at the end of the run."""
    within_s: Seconds | None = None
    """It must hold at a sample of that time, from after_s on."""
    throughout_s: Seconds | None = None
    """It must hold at all samples of that time, from after_s on."""
    after_s: Seconds | None = None
    """within_s, throughout_s: from when; 0 if left out."""
    no_crash: bool | None = None
    """Whether a crash, a stack overflow or an endless computation fails; true unless an expect says
    false."""
    no_busy_wait: bool | None = None
    """Whether a program that is busy for 10 s without returning fails; true unless an expect says
    false."""
    no_undefined: bool | None = None
    """Whether undefined behaviour fails, where `--sanitize` looks for it; true unless an expect
    says false."""
    no_mistake: bool | None = None
    """Whether a mistake fails that nothing stops on the robot: division by zero, a pointer that is
    NULL or wild, a jump to nowhere, a stack that meets the variables; false unless an expect says
    true."""
    messages_per_robot_s: Bounds | None = None
    """[least, most] messages per second of each robot over the whole run; with the ideal medium,
    the mean of all robots."""

    @property
    def kind(self) -> str:
        """Which of KINDS it has; the first of several."""
        return next((kind for kind in KINDS if getattr(self, kind) is not None), "")

    @property
    def condition(self) -> str | None:
        """The text of `that` or `share`."""
        return self.that or self.share

    @property
    def times(self) -> int:
        """In how many runs it is looked at."""
        return self.runs or (SHARE_RUNS if self.share is not None else 1)

    def text(self) -> str:
        """As it is written, in one line, for messages."""
        given: dict[str, Any] = self.model_dump(exclude_none=True)
        return ", ".join(f"{key} = {_toml(value)}" for key, value in given.items())


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:g}" if isinstance(value, int | float) else str(value)
