"""The space of a search: keys of an experiment with their ranges, as `--over` writes them."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting, parse_setting
from kilotwin.experiment.validation_errors import is_whole_number

_RANGE = re.compile(
    r"(?P<low>-?[\d.eE+-]*\d)\.\.(?P<high>-?[\d.eE+-]*\d\.?\d*)(?::(?P<step>[\d.eE+-]+))?"
    r"(?P<log>,log)?"
)
_FORMS = "KEY=1..4, KEY=10..50:10, KEY=0.001..1,log or KEY=a|b|c"
_DIGITS = 6

Point = dict[str, Any]
"""A value for each key."""


@dataclass(frozen=True)
class Axis:
    """One key: numbers from `low` to `high`, or one of `choices`."""

    key: str
    low: float = 0.0
    high: float = 0.0
    step: float | None = None
    log: bool = False
    whole: bool = False
    choices: tuple[Any, ...] = ()

    def value(self, number: Any) -> Any:
        """As an experiment has it: a whole number, or one of six digits, or a choice."""
        if self.choices:
            return number
        return round(number) if self.whole else float(f"{number:.{_DIGITS}g}")

    @property
    def text(self) -> str:
        """As it was written."""
        if self.choices:
            return f"{self.key}={'|'.join(map(str, self.choices))}"
        step = "" if self.step is None else f":{self.step:g}"
        return f"{self.key}={self.low:g}..{self.high:g}{step}{',log' * self.log}"


def whole_numbers_of(file: Path) -> Callable[[tuple[str, ...]], bool]:
    """Whether a key of that experiment takes whole numbers only. Of its program's own parameters
    the experiment knows."""

    def takes_whole(key: tuple[str, ...]) -> bool:
        if key[0] == "parameters":
            return Experiment.load(file).takes_whole_numbers(key)
        return is_whole_number(key)

    return takes_whole


def parse_axes(
    texts: list[str], takes_whole: Callable[[tuple[str, ...]], bool] = is_whole_number
) -> list[Axis]:
    """InputError of what is none, of a key that comes twice, and of none at all."""
    if not texts:
        raise InputError(f"--over: which keys? Add --over {_FORMS}")
    axes = [_parse(text, takes_whole) for text in texts]
    for index, axis in enumerate(axes):
        if axis.key in [other.key for other in axes[:index]]:
            raise InputError(f"--over {axis.text}: {axis.key} comes twice; keep one")
    return axes


def _parse(text: str, takes_whole: Callable[[tuple[str, ...]], bool]) -> Axis:
    key, equals, spec = text.partition("=")
    if not equals or not key:
        raise InputError(f"--over {text}: not of the form {_FORMS}")
    if matched := _RANGE.fullmatch(spec):
        return _range(text, key, matched, whole=takes_whole(tuple(key.split("."))))
    choices = tuple(parse_setting(f"{key}={word}").value for word in spec.split("|"))
    if len(choices) < 2:
        raise InputError(f"--over {text}: not of the form {_FORMS}")
    return Axis(key, choices=choices)


def _range(text: str, key: str, matched: re.Match[str], *, whole: bool) -> Axis:
    words = [matched["low"], matched["high"], *filter(None, [matched["step"]])]
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        raise InputError(f"--over {text}: not of the form {_FORMS}") from None
    low, high, step = (*numbers, None)[:3]
    assert low is not None
    assert high is not None
    is_log = bool(matched["log"])
    if not low < high or not all(map(math.isfinite, numbers)):
        raise InputError(f"--over {text}: the range must lead up, as {key}=1..4")
    if is_log and (low <= 0 or step is not None):
        raise InputError(f"--over {text}: with log a range begins above 0, and has no step")
    if step is not None and not 0 < step <= high - low:
        raise InputError(f"--over {text}: the step must be above 0, and within the range")
    if whole and any(number % 1 for number in numbers):
        raise InputError(f"--over {text}: {key} takes whole numbers; write them as 10..50")
    return Axis(key, low, high, step, is_log, whole)


def settings_of(point: Point) -> list[Setting]:
    """The same as `--set` does."""
    return [
        Setting(tuple(key.split(".")), value, f"--over {key}, at {value}")
        for key, value in point.items()
    ]
