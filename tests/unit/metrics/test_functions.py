"""Metrics that are functions of the user's, called here and from another process."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.metrics.functions import LocalFunctions, RemoteFunctions, answer
from kilotwin.metrics.sample import Row

from ..conftest import SMALL, Load

ROW = Row(
    305,
    np.array([0.0, 1.0], dtype=np.float32),
    np.array([0.0, 1.0], dtype=np.float32),
    np.array([0.5, -0.5], dtype=np.float32),
    np.array([0, 3], dtype=np.uint8),
    np.array([0, 2], dtype=np.uint8),
    np.zeros((1, 3), dtype=np.float32),
    np.ones((2, 2, 2), dtype=np.uint8),
)

SEES_ALL = """\
def seen(sample):
    assert sample.positions_m.tolist() == [[0.0, 0.0], [1.0, 1.0]]
    assert sample.headings_rad.tolist() == [0.5, -0.5]
    assert sample.leds.tolist() == [0, 3]
    assert sample.states.tolist() == ["RGB(0,0,0)", "RGB(3,0,0)"]
    assert sample.sites.tolist() == ["", "white"]
    assert sample.objects.shape == (1, 3)
    assert sample.cells.shape == (2, 2, 2)
    return sample.time_s
"""


@pytest.fixture
def experiment(load: Load, folder: Path) -> Any:
    def with_function(text: str, name: str = "seen") -> Experiment:
        (folder / "analysis.py").write_text(text)
        return load(SMALL, f"metric.mine.function=analysis.py:{name}")

    return with_function


def test_a_function_is_given_all_that_is_seen(experiment: Any) -> None:
    functions = LocalFunctions(experiment(SEES_ALL))
    assert functions.measure(ROW, ["mine"]) == {"mine": pytest.approx(305 * 0.032768)}
    assert functions.failed == {}


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ("return 1 / 0", "analysis.py:2: ZeroDivisionError: division by zero"),
        ("return float('nan')", "analysis.py:1: seen returned nan; return None where"),
        ("return sample.leds", "analysis.py:1: seen returned an array of shape (2,); a metric is"),
        ("return 'many'", "analysis.py:1: seen returned 'many', a str; a metric is one number"),
        ("return [1.0]", "seen returned [1.0], a list; a metric is one number"),
        ("sample.leds[0] = 1", "analysis.py:2: ValueError: assignment destination is read-only"),
        ("raise SystemExit", "analysis.py:2: SystemExit"),
    ],
)
def test_one_that_fails_is_blamed_by_line_and_not_called_again(
    experiment: Any, body: str, complaint: str
) -> None:
    functions = LocalFunctions(experiment(f"def seen(sample):\n    {body}\n"))
    assert functions.measure(ROW, ["mine"]) == {"mine": None}
    assert complaint in functions.failed["mine"]
    assert "(at 9.994 s)" in functions.failed["mine"]
    assert functions.measure(ROW, ["mine"]) == {"mine": None}


@pytest.mark.parametrize("value", ["1", "True", "np.float32(1)", "np.array(1.0)", "np.bool_(1)"])
def test_any_kind_of_one_number_will_do(experiment: Any, value: str) -> None:
    text = f"import numpy as np\ndef seen(sample):\n    return {value}\n"
    functions = LocalFunctions(experiment(text))
    assert functions.measure(ROW, ["mine"]) == {"mine": 1.0}
    assert functions.failed == {}


def test_none_is_no_value_and_no_failure(experiment: Any) -> None:
    functions = LocalFunctions(experiment("def seen(sample): return None"))
    assert functions.measure(ROW, ["mine"]) == {"mine": None}
    assert functions.failed == {}


def test_a_function_in_another_process_says_the_same(experiment: Any) -> None:
    local = LocalFunctions(experiment(SEES_ALL))
    answers = io.BytesIO()

    def ask(message: dict[str, Any]) -> None:
        line = answer(local, json.loads(json.dumps(message)))
        answers.seek(0)
        answers.write(line)
        answers.seek(0)

    remote = RemoteFunctions(ask, answers)
    assert remote.measure(ROW, ["mine"]) == LocalFunctions(experiment(SEES_ALL)).measure(
        ROW, ["mine"]
    )
    assert remote.failed == {}


def test_without_a_parent_there_is_no_value(experiment: Any) -> None:
    remote = RemoteFunctions(lambda _: None, io.BytesIO())
    assert remote.measure(ROW, ["mine"]) == {"mine": None}


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"names": ["mine"], "row": {}},
        {"names": ["mine"], "row": {**ROW.packed(), "led": ["<f8", [2], ""]}},
        {"names": ["mine"], "row": {**ROW.packed(), "led": ["|u1", [9], ""]}},
        {"names": ["mine"], "row": {**ROW.packed(), "tick": "now"}},
    ],
)
def test_what_no_worker_says_is_not_answered(experiment: Any, message: dict[str, Any]) -> None:
    with pytest.raises((ValueError, TypeError, KeyError)):
        answer(LocalFunctions(experiment(SEES_ALL)), message)


def test_a_file_that_cannot_be_loaded_is_refused_before_the_run(experiment: Any) -> None:
    with pytest.raises(InputError, match=r"analysis\.py:1: NameError: .* \(while it was loaded\)"):
        LocalFunctions(experiment("x = y\ndef seen(sample): return 0"))
