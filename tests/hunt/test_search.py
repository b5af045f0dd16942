"""The search of a hunt, with trials that are functions of their variations."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from kilotwin.studies.hunt.folder import State, opened
from kilotwin.studies.hunt.search import (
    GENERATION_LEAST,
    Budget,
    Search,
    breaking,
    signature,
)
from kilotwin.studies.hunt.shrink import Whole
from kilotwin.studies.hunt.trial import Fault, Outcome, Tier
from kilotwin.studies.hunt.variation import LATE, Addition, Put, Variation
from kilotwin.studies.pool.pool import Pool

CRASH = Fault("no_crash = true", "walk.c", 7, "robot 1 (walk) at 1.2 s: crash")
EXPECTED = Fault('that = "led.red == 0"', "", 0, "led.red = 1 at 3 s")
NOBODY = cast(Pool, None)
GENERATION = GENERATION_LEAST
Law = Callable[[Variation, Tier], Outcome]


@dataclass
class FakeLaboratory:
    law: Law
    tiers: Sequence[Tier] = ("plain",)
    asked: list[tuple[Variation, Tier]] = field(default_factory=list)

    def expecting(self, expected: str) -> "FakeLaboratory":
        return self

    def run(self, wanted: Sequence[tuple[Variation, Tier]], pool: Pool) -> list[Outcome]:
        self.asked += wanted
        return [self.law(*one) for one in wanted]

    def tables(self, variation: Variation, tier: Tier) -> dict[str, Any]:
        return {"swarm": {}, "varied": variation.as_dict()}

    def experiment(self, variation: Variation, tier: Tier) -> Any:
        robots = len(variation.robots) or 4
        keys = SimpleNamespace(duration_s=variation.duration_s or 60.0)
        return SimpleNamespace(size=robots, keys=keys, resolved=lambda: {"swarm": {}})


def some_move(chance: random.Random, one: Variation) -> Variation:
    return one.put(("medium", "loss"), round(chance.random(), 3))


def other_move(chance: random.Random, one: Variation) -> Variation:
    table = (("kind", "dead"), ("at_s", round(chance.uniform(1, 50), 2)))
    return one.add(Addition(("faults", "robot"), table, chance.randrange(4), "robots", listed=True))


def failing(variation: Variation) -> bool:
    """Whether a fault is about a robot that takes part."""
    return any(not variation.robots or it.robot in variation.robots for it in variation.additions)


def search(law: Law, folder: Path, tiers: Sequence[Tier] = ("plain",)) -> Search:
    return Search(
        cast(Any, FakeLaboratory(law, tiers)),
        {"loss": some_move, "fails": other_move},
        opened(folder, "it", 1),
        folder,
        Whole(4, 60.0, (), ()),
        GENERATION,
        print,
    )


def hunted(one: Search, trials: int) -> State:
    list(one.run(NOBODY, Budget(trials, None)))
    return one.state


def quiet(variation: Variation, tier: Tier) -> Outcome:
    return Outcome(reached=frozenset({("faults", len(variation.additions))}))


def test_a_generation_begins_with_the_experiment_as_it_is_on_each_tier(tmp_path: Path) -> None:
    one = search(quiet, tmp_path, ("plain", "sanitized"))
    hunted(one, GENERATION)
    asked = cast(FakeLaboratory, one.laboratory).asked
    assert asked[:2] == [(Variation(), "plain"), (Variation(), "sanitized")]
    assert [tier for _, tier in asked].count("sanitized") == 3


def test_the_same_seed_and_trials_give_the_same_hunt_however_it_was_stopped(
    tmp_path: Path,
) -> None:
    whole = hunted(search(quiet, tmp_path / "whole"), 4 * GENERATION)
    hunted(search(quiet, tmp_path / "parts"), GENERATION)
    parts = hunted(search(quiet, tmp_path / "parts"), 4 * GENERATION)
    assert parts == whole
    assert whole.trials == 4 * GENERATION
    assert len(whole.corpus.variations) > 2
    assert whole.moves["medium loss"] > 10


def test_a_crash_is_found_once_and_shrunk_to_a_scenario(tmp_path: Path) -> None:
    def law(variation: Variation, tier: Tier) -> Outcome:
        return Outcome((CRASH,) if failing(variation) else ())

    state = hunted(search(law, tmp_path), 3 * GENERATION)
    (found,) = state.found
    assert found.key == CRASH.key
    assert (found.robots, len(found.shrunk.additions)) == (1, 1)
    assert found.duration_s < 60
    text = Path(found.scenario).read_text()
    assert text.startswith("# Found by kilotwin hunt: no_crash = true\n# robot 1 (walk)")
    assert Path(found.scenario).name == "1-no-crash-walk-7.toml"
    assert "kilotwin test " + found.scenario in text


def test_what_is_found_on_the_sanitized_tier_says_so(tmp_path: Path) -> None:
    def law(variation: Variation, tier: Tier) -> Outcome:
        return Outcome((CRASH,) if tier == "sanitized" else ())

    (found,) = hunted(search(law, tmp_path, ("plain", "sanitized")), GENERATION).found
    assert found.tier == "sanitized"
    assert "kilotwin test --sanitize " in Path(found.scenario).read_text()


def test_an_expectation_is_not_shrunk_to_what_nobody_meets(tmp_path: Path) -> None:
    def law(variation: Variation, tier: Tier) -> Outcome:
        few = 0 < len(variation.robots) < 3
        short = variation.duration_s is not None and variation.duration_s < 20
        return Outcome((EXPECTED,) if failing(variation) or few or short else ())

    (found,) = hunted(search(law, tmp_path), 3 * GENERATION).found
    assert found.robots == 3
    assert 20 <= found.duration_s < 24
    assert len(found.shrunk.additions) == 1


def test_an_expectation_that_is_never_met_is_found_as_it_is(tmp_path: Path) -> None:
    state = hunted(search(lambda *_: Outcome((EXPECTED,)), tmp_path), 2 * GENERATION)
    (found,) = state.found
    assert (found.robots, found.duration_s, found.trial) == (4, 60.0, 1)
    assert Path(found.scenario).name == "1-that-led-red-0.toml"


def test_an_expectation_is_found_once_for_each_thing_that_breaks_it(tmp_path: Path) -> None:
    def law(variation: Variation, tier: Tier) -> Outcome:
        lossy = any(put.value > 0.5 for put in variation.puts)
        return Outcome((EXPECTED,) if failing(variation) or lossy else ())

    found = hunted(search(law, tmp_path), 4 * GENERATION).found
    assert {breaking(one.shrunk) for one in found} == {
        frozenset({("medium", "loss")}),
        frozenset({("faults", "robot", "dead")}),
    }


def test_what_shrinks_to_something_known_is_not_found_again(tmp_path: Path) -> None:
    one = search(lambda *_: Outcome((EXPECTED,)), tmp_path)
    hunted(one, 1)
    lossy = Variation().put(("medium", "loss"), 0.0).add()
    assert not one._is_new(lossy, EXPECTED)
    assert one._is_new(lossy, replace(EXPECTED, expected="other"))
    assert one._pinned(lossy, "plain", EXPECTED, (), NOBODY) is None


def test_trials_that_are_no_experiment_are_counted_apart(tmp_path: Path) -> None:
    state = hunted(search(lambda *_: Outcome(refused="no room"), tmp_path), GENERATION)
    assert (state.refused, state.trials, state.moves) == (GENERATION, GENERATION, {})


@pytest.mark.parametrize(("now", "left"), [(9.0, GENERATION), (10.0, 0)])
def test_no_generation_begins_when_the_time_is_over(now: float, left: int) -> None:
    assert Budget(None, 10.0, lambda: now).left(0, GENERATION) == left


def test_trials_in_all_are_not_exceeded() -> None:
    assert [Budget(20, None).left(done, 16) for done in (0, 16, 20, 30)] == [16, 4, 0, 0]


def test_the_kinds_of_changes_are_named() -> None:
    one = Variation(uids=(1,), poses=((0, 0, 0),), puts=(Put(("medium", "loss"), 0.0),)).add(
        Addition(LATE, (("at_s", 1.0),), 0),
        Addition(("step",), (("at_s", 1.0), ("pose", [0, 0, 0])), 0),
        Addition(("step",), (("at_s", 1.0), ("ambient", 1.0))),
        Addition(("command",), (("at_s", 1.0), ("send", "reset")), 0),
        Addition(("faults", "host"), (("from_s", 1.0), ("until_s", 2.0))),
    )
    assert signature(one) == {
        ("medium", "loss"),
        ("RUN late",),
        ("step", "moved"),
        ("step", "light"),
        ("command", "reset"),
        ("faults", "host"),
        ("uids",),
        ("poses",),
    }
    assert breaking(one) == signature(one) - {("medium", "loss"), ("poses",)}
