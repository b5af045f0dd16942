"""Assertions on samples, whose bounds follow from the sample's size."""

from collections.abc import Iterable

from kilotwin.studies.compare.plain_intervals import mean_interval, share_interval


def assert_share(
    hits: Iterable[object] | int,
    trials: int | None = None,
    *,
    at_least: float = 0.0,
    at_most: float = 1.0,
) -> None:
    """Fails if the share of hits among trials contradicts the bounds: if its whole exact 95 %
    interval is outside.

    `hits`: how many of `trials`, or a thing per trial that is true for a hit.
    """
    __tracebackhide__ = True
    if not isinstance(hits, int):
        all_of_them = [bool(one) for one in hits]
        hits, trials = sum(all_of_them), len(all_of_them)
    if not trials or not 0 <= hits <= trials:
        raise ValueError(f"{hits} of {trials} trials are no share; give hits and trials, from 1 on")
    found = share_interval(hits, trials)
    if found.high < at_least:
        raise AssertionError(f"{hits} of {trials}, a share of {found}, which is below {at_least:g}")
    if found.low > at_most:
        raise AssertionError(f"{hits} of {trials}, a share of {found}, which is above {at_most:g}")


def assert_within(values: Iterable[float], least: float, most: float) -> None:
    """Fails if the mean of values contradicts the bounds: if its whole 95 % bootstrap interval is
    outside. Of a single value: if that is outside."""
    __tracebackhide__ = True
    sample = [float(value) for value in values]
    if not sample or not least <= most:
        raise ValueError("give values, the least and the most that their mean may be")
    found = mean_interval(sample)
    low, high = (found.low, found.high) if found.is_known else (found.value, found.value)
    if high < least or low > most:
        number = f"{len(sample)} values" if len(sample) > 1 else "1 value"
        side = f"below {least:g}" if high < least else f"above {most:g}"
        raise AssertionError(f"{number} with a mean of {found}, which is {side}")
