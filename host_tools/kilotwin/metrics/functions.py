"""Metrics that are Python functions of the user's: called, and blamed when they fail.

A function that fails is not called again in that run: it costs its metric, not the run.
"""

import json
import math
from collections.abc import Callable
from numbers import Real
from typing import Any, BinaryIO, Protocol

import numpy as np

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.files import shown
from kilotwin.experiment.python_code import PythonName, blamed_line, load_name, what_happened
from kilotwin.metrics.sample import Row, Sample, SampleMaker

Values = dict[str, float | None]


class Functions(Protocol):
    """All functions of an experiment's metrics."""

    failed: dict[str, str]
    """Place and cause of each failure, by the metric whose function failed."""

    def measure(self, row: Row, names: list[str]) -> Values:
        """The values of these metrics; None of what has none, or has failed."""


class LocalFunctions:
    """Functions that are called in this process."""

    def __init__(self, experiment: Experiment) -> None:
        """InputError if one cannot be loaded."""
        self.failed: dict[str, str] = {}
        self._make = SampleMaker(experiment.keys)
        self._functions = {name: _load(named) for name, named in experiment.functions.items()}
        self._named = experiment.functions

    def measure(self, row: Row, names: list[str]) -> Values:
        """Calls them, each with the same sample."""
        if not names:
            return {}
        sample = self._make.sample(row)
        return {name: self._value(name, sample) for name in names}

    def _value(self, name: str, sample: Sample) -> float | None:
        if name in self.failed:
            return None
        function, named = self._functions[name], self._named[name]
        try:
            value = function(sample)
        except (Exception, SystemExit) as error:
            what = f"{blamed_line(error, named.file)}: {what_happened(error)}"
        else:
            what = _unfit(value)
            if not what:
                return None if value is None else float(value)
            code = getattr(function, "__code__", None)
            line = "" if code is None else f":{code.co_firstlineno}"
            what = f"{shown(named.file)}{line}: {named.name} returned {what}"
        self.failed[name] = f"{what} (at {sample.time_s:.3f} s)"
        return None


def _load(named: PythonName) -> Callable[[Sample], Any]:
    try:
        function = load_name(named)
    except (Exception, SystemExit) as error:
        where = blamed_line(error, named.file)
        raise InputError(f"{where}: {what_happened(error)} (while it was loaded)") from None
    if not callable(function):
        raise InputError(f"{shown(named.file)}: '{named.name}' is no function")
    found: Callable[[Sample], Any] = function
    return found


def _unfit(value: Any) -> str:
    """A returned value that is no number, for messages; "" of a number, or of None."""
    if value is None:
        return ""
    if isinstance(value, np.ndarray) and value.shape:
        return f"an array of shape {value.shape}; a metric is one number"
    if not isinstance(value, Real | np.bool_ | np.ndarray):
        return f"{value!r:.40}, a {type(value).__name__}; a metric is one number"
    if not math.isfinite(value):
        return f"{value}; return None where there is no value"
    return ""


class RemoteFunctions:
    """Functions that the parent of this process calls.

    A run's worker is confined for the sake of robots' programs; the user's own functions import and
    read what they like, so they are called outside of it.
    """

    def __init__(self, ask: Callable[[dict[str, Any]], None], answers: BinaryIO) -> None:
        """`ask` sends a message to the parent; `answers` is where its lines are read."""
        self.failed: dict[str, str] = {}
        self._ask = ask
        self._answers = answers

    def measure(self, row: Row, names: list[str]) -> Values:
        """One question, one answer; no values once the parent is gone."""
        if not names:
            return {}
        self._ask({"type": "measure", "names": names, "row": row.packed()})
        line = self._answers.readline()
        if not line.endswith(b"\n"):
            return dict.fromkeys(names)
        answer = json.loads(line)
        self.failed |= answer["failed"]
        values: Values = answer["values"]
        return values


def answer(functions: Functions, message: dict[str, Any]) -> bytes:
    """The parent's answer; ValueError, TypeError or KeyError of a message that is none."""
    names = [name for name in message["names"] if isinstance(name, str)]
    values = functions.measure(Row.unpacked(message["row"]), names)
    return json.dumps({"values": values, "failed": functions.failed}).encode() + b"\n"
