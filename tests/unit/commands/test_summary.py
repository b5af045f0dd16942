"""The end of `kilotwin run` speaks of the user's program, and says what to type next."""

from pathlib import Path
from typing import Any

import pytest

from kilotwin.commands.terminal import next_text, summary_text

FAILED = {
    "robot": 3,
    "kind": "crash",
    "text": "at walk.c:7",
    "tick": 9,
    "file": "walk.c",
    "line": 7,
}


def summary(**more: Any) -> dict[str, Any]:
    return {
        "experiment": "mine",
        "seed": 1,
        "simulated_s": 60.0,
        "wall_s": 0.1,
        "robot_s_per_cpu_s": 6000,
        "robots": 10,
        "informed": {},
        "resting": {},
        "not_resting": 10,
        "states": {"RGB(0,3,0)": 6, "RGB(3,0,0)": 4},
        "prints": {"number": 0, "last": None},
        "robots_failed": [],
        "result_hash": "0123456789abcdef",
        "run_folder": "/elsewhere/my run",
        **more,
    }


def row(text: str, label: str) -> str:
    """The text beside a label."""
    [found] = [line for line in text.splitlines() if line.startswith(f"  {label} ")]
    return found.removeprefix(f"  {label}").strip()


def test_robots_are_counted_by_what_they_show_and_rest_only_where_sites_are() -> None:
    text = summary_text(summary())
    assert row(text, "robots") == "6 RGB(0,3,0), 4 RGB(3,0,0)"
    assert "resting" not in text
    sites = {"resting": {"black": 6}, "informed": {"black": 2}, "not_resting": 4}
    text = summary_text(summary(**sites, states={"walking": 3, "resting": 7}))
    assert row(text, "robots") == "7 resting, 3 walking"
    assert row(text, "resting on black") == "6   (2 robots are informed for it)"
    assert row(text, "not resting") == "4"


def test_of_many_colours_the_most_frequent_are_named() -> None:
    states = {"RGB(0,0,0)": 1, **{f"RGB(1,{k},0)": 2 for k in range(4)}, "RGB(2,2,2)": 9}
    states |= {"RGB(3,3,3)": 1, "RGB(3,2,1)": 1}
    said = row(summary_text(summary(states=states)), "robots")
    assert said.startswith("9 RGB(2,2,2), 2 RGB(1,0,0)")
    assert said.endswith("1 off, 2 others")


@pytest.mark.parametrize(
    ("number", "text", "said"),
    [
        (1, "hello\n", '1 line, the last "hello": /elsewhere/my run/prints/'),
        (2310, "a b " * 40, f'2,310 lines, the last "{("a b " * 14).strip()} ...": '),
    ],
)
def test_prints_are_counted_and_the_last_is_shown(number: int, text: str, said: str) -> None:
    told = summary_text(summary(prints={"number": number, "last": {"text": text}}))
    assert row(told, "prints").startswith(said)
    assert "prints" not in summary_text(summary())


def test_robots_that_failed_are_counted_once() -> None:
    told = summary(robots_failed=[FAILED, {**FAILED, "tick": 12}, {**FAILED, "robot": 5}])
    assert row(summary_text(told), "failed") == "2 of 10 robots: see below"
    assert next_text(told, seen=False) == (
        "to see where robots failed, type: kilotwin view '/elsewhere/my run'"
    )


def test_the_last_line_says_what_to_type_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told = summary(run_folder=str(tmp_path / "runs/my"))
    assert next_text(told, seen=False) == "to see it, type: kilotwin view runs/my"
    assert next_text(told, seen=True) == (
        "to have it as a video, type: kilotwin plot video runs/my -o run.gif"
    )
