"""The paper's figures as options of the figures of any sweep (`kilotwin plot --preset`).

Its data set is that of experiments/paper/grid.toml; each takes any other with the same keys.
"""

from dataclasses import dataclass, fields, replace

from kilotwin.errors import InputError
from kilotwin.studies.plot.figures import Wanted

_SHARES = {"x": "swarm.informed_for.black", "y": "swarm.informed", "panels": "base"}


@dataclass(frozen=True)
class Preset:
    """A figure of metrics with its options."""

    figure: str
    wanted: Wanted


PRESETS = {
    f"paper-{name}-{site}": Preset(
        "heat", Wanted(metric=f"resting_{site}", statistic=statistic, **_SHARES)
    )
    for name, statistic in (("median", "median"), ("iqr", "iqr"))
    for site in ("black", "white")
}
PRESETS["paper-symmetry"] = Preset(
    "ecdf", Wanted(where=("swarm.informed=0",), metric="resting_black", by="base")
)
PRESETS["paper-time"] = Preset("curve", Wanted(metric="resting_black", by="base"))


def with_preset(name: str, figure: str, wanted: Wanted) -> Wanted:
    """The preset's options with those that are given in place of its own, `where` beside them.

    InputError for one that is none, or is of another figure."""
    preset = PRESETS.get(name)
    if preset is None:
        raise InputError(f"--preset {name}: no such preset; there are {', '.join(PRESETS)}")
    if preset.figure != figure:
        what = f"a preset of {preset.figure}; type: kilotwin plot {preset.figure} ..."
        raise InputError(f"--preset {name}: {what}")
    given = {
        field.name: value
        for field in fields(wanted)
        if field.name != "where" and (value := getattr(wanted, field.name)) is not None
    }
    return replace(preset.wanted, where=(*preset.wanted.where, *wanted.where), **given)
