"""Experiments as they are written down: with poses, as tomli_w writes all others."""

from typing import Any

import pytest
import tomli_w

from kilotwin.experiment.toml_text import _MARK, toml_of

POSES = [[0.1, -2e-07, 3.0], [1e22, -0.0, 1.5]]


@pytest.mark.parametrize(
    "robots",
    [
        None,
        [],
        [{"program": "a.c", "count": 2}],
        [{"program": "a.c", "count": 2, "poses": []}],
        [{"program": "a.c", "count": 2, "poses": POSES}],
        [
            {"poses": POSES, "program": ["a.c", "b.c"], "count": 2},
            {"program": f'poses = "{_MARK}"', "count": 1},
            {"program": _MARK, "poses": POSES[:1], "count": 1},
        ],
    ],
)
def test_an_experiment_is_written_as_by_the_library(robots: list[dict[str, Any]] | None) -> None:
    tables: dict[str, Any] = {"name": f'"{_MARK}"', "arena": {"shape": "circle"}, "seed": 1}
    if robots is not None:
        tables["robots"] = robots
    tables["medium"] = {"loss": 0.0}
    before = repr(tables)
    assert toml_of(tables) == tomli_w.dumps(tables)
    assert repr(tables) == before
