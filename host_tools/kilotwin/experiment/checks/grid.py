"""Checks of an experiment on a Kilogrid that concern several keys."""

from collections.abc import Iterator
from dataclasses import dataclass

from kilotwin.experiment.areas import Area, area_of, lies_inside
from kilotwin.experiment.schema.experiment import ExperimentSchema
from kilotwin.experiment.schema.grid import Grid, GridChange
from kilotwin.experiment.spec.aggregation import runs_aggregation
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.files.headers import MODULE_M, MOST_PER_BUS

_MOST_SITES = 14  # different codes of a cell
_MID_RUN = ("pause", "wakeup", "run")


@dataclass(frozen=True)
class Problem:
    """A mistake: what is wrong and what to do, and the keys concerned, the first one to look at."""

    what: str
    paths: tuple[KeyPath, ...]
    unless_set: KeyPath | None = None
    """Skipped for a key that is set for one run, as to make it short."""


def within_the_run(path: KeyPath, at_s: float, experiment: ExperimentSchema) -> Iterator[Problem]:
    """A problem if the time of `path`, a table's key, is not before the end of the run."""
    if at_s >= experiment.duration_s:
        table = ".".join(step for step in path[:-1] if isinstance(step, str))
        what = (
            f"a [[{table}]] at {at_s:g} s never comes, the run ends at "
            f"{experiment.duration_s:g} s; make it earlier, or the run longer"
        )
        yield Problem(what, (path, ("duration_s",)), unless_set=("duration_s",))


def grid_problems(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Problems of [grid], and of those [faults] that need one."""
    if experiment.grid is None:
        yield from _faults_without_a_grid(experiment)
        return
    yield from _buses(experiment.grid)
    yield from _robots(experiment)
    yield from _reports(experiment, experiment.grid)
    for index, change in enumerate(experiment.grid.change):
        yield from _change(("grid", "change", index), experiment, change)
    yield from _commands(experiment)
    yield from _faults(experiment, experiment.grid)


def _faults_without_a_grid(experiment: ExperimentSchema) -> Iterator[Problem]:
    faults = experiment.faults
    if faults.error_share or faults.module or faults.host:
        what = (
            "these [faults] are those of a Kilogrid; add [grid] with columns and rows, or remove "
            "them: only [[faults.robot]] needs none"
        )
        yield Problem(what, (("faults",),))


def _buses(grid: Grid) -> Iterator[Problem]:
    path: KeyPath = ("grid", "buses")
    if grid.buses > grid.rows:
        what = f"{grid.buses} buses for {grid.rows} rows; a bus has whole rows, take fewer buses"
        yield Problem(what, (path, ("grid", "rows")))
        return
    most = -(-grid.rows // grid.buses) * grid.columns
    if most > MOST_PER_BUS:
        what = f"{most} modules on a bus, but {MOST_PER_BUS} are the most; take more buses"
        yield Problem(what, (path, ("grid", "rows")))


def _robots(experiment: ExperimentSchema) -> Iterator[Problem]:
    grid = experiment.grid
    assert grid is not None
    profile: KeyPath = ("swarm", "profile")
    if experiment.swarm.profile != "kilobot":
        what = 'only Kilobots fit on a Kilogrid; set profile = "kilobot", or remove [grid]'
        yield Problem(what, (profile, ("grid",)))
    if experiment.swarm.floor:
        what = "on a grid the cells speak, not the virtual floor; remove 'floor'"
        yield Problem(what, (("swarm", "floor"), ("grid",)))
    size = Area(False, 0.0, 0.0, grid.columns * MODULE_M, grid.rows * MODULE_M)
    arena = area_of(experiment.arena)
    if not lies_inside(arena, size):
        what = (
            f"the arena reaches beyond the grid of {size.width:g} x {size.height:g} m; make it "
            "smaller, or leave it out: it is the grid's then"
        )
        yield Problem(what, (("arena",), ("grid",)))
    if len(experiment.site) > _MOST_SITES:
        what = f"a cell tells {_MOST_SITES} sites apart; take fewer"
        yield Problem(what, (("site",), ("grid",)))


def _reports(experiment: ExperimentSchema, grid: Grid) -> Iterator[Problem]:
    if grid.report_s != Grid.model_fields["report_s"].default and not runs_aggregation(experiment):
        what = (
            "only robots that run firmware/aggregation obey 'report_s'; remove it: other programs "
            "report when they send a message of type TRACKING"
        )
        yield Problem(what, (("grid", "report_s"), ("swarm",)))


def _change(path: KeyPath, experiment: ExperimentSchema, change: GridChange) -> Iterator[Problem]:
    assert experiment.grid is not None
    if (change.swap is None) == (change.configuration is None):
        what = "a [[grid.change]] has either 'swap' or 'configuration'; give one of them"
        yield Problem(what, (path,))
        return
    yield from within_the_run((*path, "at_s"), change.at_s, experiment)
    if change.swap is None:
        return
    if experiment.grid.configuration is not None:
        what = "sites can be swapped where they make the configuration; use 'configuration' here"
        yield Problem(what, ((*path, "swap"), ("grid", "configuration")))
    if change.swap[0] == change.swap[1]:
        yield Problem("a site cannot be swapped with itself; name two", ((*path, "swap"),))
    names = [site.name for site in experiment.site]
    for name in change.swap:
        if name not in names:
            known = ", ".join(names) or "there are none"
            what = f"there is no site '{name}'; the sites are: {known}"
            yield Problem(what, ((*path, "swap"),))


def _commands(experiment: ExperimentSchema) -> Iterator[Problem]:
    """Modules reach all robots or none, and while they do the grid's program rests."""
    for index, command in enumerate(experiment.command or []):
        path: KeyPath = ("command", index)
        if command.send not in _MID_RUN:
            what = (
                f"on a grid robots can be told {', '.join(_MID_RUN)} in mid-run, not "
                f"'{command.send}'; `kilotwin grid send` tells them anything before or after"
            )
            yield Problem(what, ((*path, "send"), ("grid",)))
        for key in ("robot", "uid_first", "uid_last", "centre_m", "repeat_s"):
            if getattr(command, key):
                what = f"modules tell all robots, and for as long as it takes; remove '{key}'"
                yield Problem(what, ((*path, key), ("grid",)))


def _faults(experiment: ExperimentSchema, grid: Grid) -> Iterator[Problem]:
    for index, fault in enumerate(experiment.faults.module):
        x, y = fault.module
        if x >= grid.columns or y >= grid.rows:
            what = (
                f"there is no module {x}-{y} on a grid of {grid.columns} x {grid.rows}; columns "
                f"are 0 to {grid.columns - 1}, rows 0 to {grid.rows - 1}"
            )
            yield Problem(what, (("faults", "module", index, "module"), ("grid",)))
        yield from within_the_run(("faults", "module", index, "at_s"), fault.at_s, experiment)
    for index, absence in enumerate(experiment.faults.host):
        yield from within_the_run(("faults", "host", index, "from_s"), absence.from_s, experiment)
        if absence.until_s <= absence.from_s:
            what = f"{absence.until_s:g} s is not after {absence.from_s:g} s; exchange them"
            yield Problem(what, (("faults", "host", index, "until_s"),))
