"""Hunts for people and for programs."""

import re
import signal
import time
from pathlib import Path
from typing import Any

from kilotwin.files.interrupts import heeding_interrupts
from kilotwin.studies.hunt.folder import Found
from kilotwin.studies.hunt.search import Budget, Search
from kilotwin.studies.pool.places import Place
from kilotwin.studies.pool.pool import Pool
from kilotwin.studies.sweep.runner import Display

_MOMENT = re.compile(r"\bat ([\d.]+) s\b")
_ROBOT = re.compile(r"^robot (\d+) ")


def hunted(search: Search, place: Place, budget: Budget, display: Display, most: int) -> None:
    """Hunts until the budget is spent, or `most` things are found. KeyboardInterrupt when it is
    interrupted; what was found is kept."""
    state, began = search.state, time.monotonic()
    total = budget.trials or 0
    display.start(total, state.trials)
    try:
        with (
            heeding_interrupts(signal.default_int_handler),
            Pool(place) as pool,
        ):
            before = state.trials
            for found in search.run(pool, budget):
                if found is not None:
                    display.note(_found_text(len(state.found), found))
                    if len(state.found) >= most:
                        state.write(search.folder)
                        return
                took_s = max(time.monotonic() - began, 1e-6)
                left_s = _left_s(budget, state.trials - before, state.trials, took_s)
                display.progress(state.trials, len(state.found), left_s, _reached(search))
    finally:
        display.stop()


def _left_s(budget: Budget, ran: int, done: int, took_s: float) -> float:
    left = [] if budget.ends_at is None else [max(0.0, budget.ends_at - budget.clock())]
    if budget.trials is not None and ran:
        left.append(max(0, budget.trials - done) * took_s / ran)
    return min(left, default=0.0)


def _reached(search: Search) -> str:
    corpus = search.state.corpus
    return f"{len(corpus.reached):,} marks, corpus of {len(corpus.variations)}"


def text(search: Search, experiment: Path) -> str:
    """Lists what was tried and found, and what to type next."""
    state = search.state
    told = sorted(state.moves.items(), key=lambda one: (-one[1], one[0]))
    varied = ", ".join(f"{name} {number}" for name, number in told)
    lines = [
        f"{state.trials:,} trials; {state.refused:,} more were no experiment, or took too long"
        if state.refused
        else f"{state.trials:,} trials",
        f"reached: {_reached(search)}",
        f"varied: seeds in all; {varied or 'nothing else'}",
    ]
    if not state.found:
        lines += ["nothing broke it", f"next: kilotwin hunt {experiment} --time 3600"]
        return "\n".join(lines)
    lines += [_found_text(number, one) for number, one in enumerate(state.found, 1)]
    lines.append(f"next: {_test(state.found[0])}")
    return "\n".join(lines)


def _found_text(number: int, one: Found) -> str:
    robots = f"{one.robots} robot{'s' if one.robots > 1 else ''}"
    lines = [
        f"{number}. {one.expected}: {one.said}",
        f"   trial {one.trial}, shrunk by {one.tried} more to {robots} and {one.duration_s:g} s: "
        f"{one.scenario}",
        f"   fails each time: {_test(one)}",
    ]
    if link := _link(one):
        lines.append(f"   the moment: the run that it keeps, in kilotwin view, address + {link}")
    return "\n".join(lines)


def _test(one: Found) -> str:
    return f"kilotwin test{' --sanitize' if one.tier == 'sanitized' else ''} {one.scenario}"


def _link(one: Found) -> str:
    """The moment in the address of the viewer's page; "" if none is known."""
    moment, robot = _MOMENT.search(one.said), _ROBOT.match(one.said)
    if moment is None:
        return ""
    return f"#t={moment[1]}" + (f"&robot={robot[1]}" if robot else "")


def as_dict(search: Search) -> dict[str, Any]:
    """For --json."""
    state = search.state
    return {
        "folder": str(search.folder),
        "trials": state.trials,
        "refused": state.refused,
        "reached": len(state.corpus.reached),
        "corpus": len(state.corpus.variations),
        "varied": state.moves,
        "found": [{**one.as_dict(), "moment": _link(one)} for one in state.found],
    }
