"""Verdicts on a scenario: each `[[expect]]`, and what is expected of every program."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.schema.expect import Expect
from kilotwin.studies.compare.plain_intervals import share_interval
from kilotwin.studies.scenario.looks import Failure, by_cause, once_per_cause
from kilotwin.studies.scenario.one_run import Ran

# Have a verdict in each scenario; others where they are written, or not met.
_ALWAYS = ("no_crash", "no_busy_wait")
# Does not hold unless an [[expect]] says so.
_WHERE_ASKED = ("no_mistake",)


@dataclass(frozen=True)
class ScenarioVerdict:
    """On one expectation, over all its runs.

    `where`: file and line. `expected`: as it is written. `said`: what was seen. `seed`: of a run
    that shows a failure. `blamed`: failures of programs, one for each cause.
    """

    where: str
    expected: str
    passed: bool
    said: str
    seed: int | None = None
    blamed: tuple[Failure, ...] = ()

    def line(self) -> str:
        """For people."""
        return f"{self.where}: {self.expected}: {self.said}"

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {**vars(self), "blamed": [dict(vars(one)) for one in self.blamed]}


def runs_of(experiment: Experiment) -> int:
    """How many runs its expectations ask for."""
    return max((expect.times for expect in experiment.keys.expect), default=1)


def judge(experiment: Experiment, runs: Sequence[Ran]) -> list[ScenarioVerdict]:
    """Verdicts: what holds of every scenario, since it is the cause of more; then in the order of
    the file."""
    source, expects = experiment.origin.source, experiment.keys.expect
    if stopped := [ran for ran in runs if ran.trouble]:
        said = _of_runs(stopped, runs, stopped[0].trouble)
        return [ScenarioVerdict(source, "runs to its end", False, said, stopped[0].seed)]
    verdicts = [
        *_programs("no_crash", experiment, runs, lambda ran: ran.crashes),
        *_programs("no_busy_wait", experiment, runs, lambda ran: ran.busy_waits),
        *_programs("no_undefined", experiment, runs, lambda ran: ran.undefined),
        *_programs("no_mistake", experiment, runs, lambda ran: ran.mistakes),
    ]
    for index, expect in enumerate(expects):
        where = experiment.origin.where(("expect", index))
        those = runs[: expect.runs or (expect.times if expect.share else len(runs))]
        if expect.share is not None:
            verdicts.append(_share(where, expect, index, those))
        elif expect.that is not None:
            verdicts.append(_that(where, expect, index, those))
        elif expect.messages_per_robot_s is not None:
            verdicts.append(_messages(where, expect, those))
    return verdicts


def _that(where: str, expect: Expect, index: int, runs: Sequence[Ran]) -> ScenarioVerdict:
    looks = [(ran, ran.looks[index]) for ran in runs]
    failed = [(ran, look) for ran, look in looks if look is not None and not look.passed]
    if failed:
        ran, look = failed[0]
        said = _of_runs([ran for ran, _ in failed], runs, look.seen)
        return ScenarioVerdict(where, expect.text(), False, said, ran.seed)
    first = runs[0].looks[index]
    assert first is not None
    return ScenarioVerdict(where, expect.text(), True, first.seen)


def _share(where: str, expect: Expect, index: int, runs: Sequence[Ran]) -> ScenarioVerdict:
    passed = [ran for ran in runs if (look := ran.looks[index]) is not None and look.passed]
    others = [ran for ran in runs if ran not in passed]
    found = share_interval(len(passed), len(runs))
    said = f"{len(passed)} of {len(runs)} runs, a share of {found}"
    odd: Ran | None = None
    if expect.at_least is not None and found.high < expect.at_least:
        said += f", which is below {expect.at_least:g}"
        odd = others[0]
    elif expect.at_most is not None and found.low > expect.at_most:
        said += f", which is above {expect.at_most:g}"
        odd = passed[0]
    if odd is None:
        return ScenarioVerdict(where, expect.text(), True, said)
    look = odd.looks[index]
    assert look is not None
    return ScenarioVerdict(
        where, expect.text(), False, f"{said} (seed {odd.seed}: {look.seen})", odd.seed
    )


def _messages(where: str, expect: Expect, runs: Sequence[Ran]) -> ScenarioVerdict:
    assert expect.messages_per_robot_s is not None
    least, most = expect.messages_per_robot_s
    for ran in runs:
        out = [(n, rate) for n, rate in enumerate(ran.rates) if not least <= rate <= most]
        if out:
            index = out[0][0]
            who = f"robot {ran.uids[index]} sent" if len(ran.rates) > 1 else "robots sent"
            more = f", and {len(out) - 1} more robots are outside" if len(out) > 1 else ""
            said = f"{who} {out[0][1]:.3g} messages/s{more} (seed {ran.seed})"
            return ScenarioVerdict(where, expect.text(), False, said, ran.seed)
    rates = [rate for ran in runs for rate in ran.rates]
    return ScenarioVerdict(
        where, expect.text(), True, f"{min(rates):.3g} to {max(rates):.3g} messages/s"
    )


def _programs(
    key: str,
    experiment: Experiment,
    runs: Sequence[Ran],
    failures: Callable[[Ran], Sequence[Failure]],
) -> Iterator[ScenarioVerdict]:
    """Verdicts of `no_crash` and the like, most of which hold unless an [[expect]] says false."""
    where, given = experiment.origin.source, key not in _WHERE_ASKED
    is_written = key in _ALWAYS
    for index, expect in enumerate(experiment.keys.expect):
        if getattr(expect, key) is not None:
            where, given = experiment.origin.where(("expect", index)), getattr(expect, key)
            is_written = True
    if not given:
        return
    bad = [ran for ran in runs if failures(ran)]
    if not bad and is_written:
        yield ScenarioVerdict(where, f"{key} = true", True, f"none in {_runs(len(runs))}")
    if not bad:
        return
    said = _of_runs(bad, runs, once_per_cause(failures(bad[0])))
    blamed = tuple(failure for failure, _ in by_cause(failures(bad[0])))
    yield ScenarioVerdict(where, f"{key} = true", False, said, bad[0].seed, blamed)


def _of_runs(bad: Sequence[Ran], runs: Sequence[Ran], said: str) -> str:
    """The words of one run, and in how many it was so."""
    seed = f"seed {bad[0].seed}"
    if len(runs) == 1:
        return f"{said} ({seed})"
    return f"{said} ({seed}; so in {len(bad)} of {len(runs)} runs)"


def _runs(number: int) -> str:
    return "1 run" if number == 1 else f"{number} runs"
