"""How far robots are from the split that 3 informed robots of 10 are to bring about, 7 of them for
black: the metric `error` of the walkthrough in docs/metrics.md."""

WANTED = {"black": 0.7, "white": 0.3}


def error(sample):
    """Robots too many or too few on a site, mean over both."""
    resting = sample.sites[sample.states == "resting"]
    size = len(sample.states)
    return sum(abs((resting == site).sum() - share * size) for site, share in WANTED.items()) / 2
