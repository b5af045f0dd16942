"""`kilotwin run`: an experiment in the emulator."""

import contextlib
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
    INSIDE,
    PAGE_SPEED,
    SEE,
    ConfineMode,
    File,
    Json,
    NoBrowser,
    NoTwin,
    Quiet,
    RequireTwin,
    RunFolder,
    Seed,
    Settings,
    Trust,
    View,
    ViewPort,
    ViewSpeed,
    command_app,
    given_settings,
)
from kilotwin.commands.window import stay, window
from kilotwin.errors import EXIT_INTERRUPTED, InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.files import confinement, extras
from kilotwin.files.plain_text import plain
from kilotwin.programs.coverage.checks import COVERED, check_covered
from kilotwin.programs.native.sanitizer import ONE_OF_BOTH, SANITIZED, check_sanitized
from kilotwin.programs.port.twin import chosen
from kilotwin.runs.size import size_of
from kilotwin.session.job import Probes
from kilotwin.session.run import Outcome
from kilotwin.session.run import run as run_experiment

if TYPE_CHECKING:
    from kilotwin.session.attached import AttachedViewer
    from kilotwin.session.display import Display
    from kilotwin.session.verify import Verification

app = command_app()

Plots = Annotated[
    bool,
    typer.Option(
        "--plots",
        rich_help_panel=SEE,
        help="Also write map.png and timeline.png into the folder.",
    ),
]
Gdb = Annotated[
    int | None,
    typer.Option(
        metavar="UID",
        min=0,
        rich_help_panel=INSIDE,
        help="Let avr-gdb control a robot that runs on an ATmega328P.",
    ),
]
GdbPort = Annotated[
    int,
    typer.Option(
        min=1024, max=65535, metavar="PORT", rich_help_panel=INSIDE, help="Where gdb connects."
    ),
]
Coverage = Annotated[
    bool,
    typer.Option(
        "--coverage",
        rich_help_panel=INSIDE,
        help="Run programs by their machine code, and say which lines have run.",
    ),
]
Sanitize = Annotated[
    bool,
    typer.Option(
        "--sanitize",
        rich_help_panel=INSIDE,
        help="Run programs natively, and name what they do that C leaves undefined, as an index "
        "out of bounds; exit 4 if one does.",
    ),
]
Verify = Annotated[
    bool,
    typer.Option(
        "--verify",
        help="Repeat the run of a run folder, or of its manifest.json, and name the first sample "
        "that differs; exit 1 if one does.",
    ),
]
DryRun = Annotated[
    bool,
    typer.Option(
        "--dry-run",
        help="Only check the experiment, and say how much it would record.",
    ),
]
Vcd = Annotated[
    list[int] | None,
    typer.Option(
        metavar="UID",
        min=0,
        rich_help_panel=INSIDE,
        help="Trace the pins of a robot on an ATmega328P into the folder; repeatable.",
    ),
]


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin run my.toml --view\n\n"
    "  kilotwin run my.toml --seed 7 --set robots.0.count=5 --out runs/five\n\n"
    "  kilotwin run experiments/paper/simplified-n100.toml --plots\n\n"
    "  kilotwin run --verify runs/five"
)
def run(
    experiment: File,
    *,
    seed: Seed = None,
    settings: Settings = None,
    out: RunFolder = None,
    plots: Plots = False,
    gdb: Gdb = None,
    gdb_port: GdbPort = 1234,
    vcd: Vcd = None,
    coverage: Coverage = False,
    sanitize: Sanitize = False,
    verify: Verify = False,
    dry_run: DryRun = False,
    confine: ConfineMode = None,
    trust: Trust = False,
    require_twin: RequireTwin = False,
    no_twin: NoTwin = False,
    view: View = False,
    speed: ViewSpeed = None,
    view_port: ViewPort = 0,
    no_browser: NoBrowser = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run an experiment and leave a run folder."""
    confinement.choose(confine, trust)
    # A twin is one of the program as it is.
    twin = "off" if sanitize else chosen(require=require_twin, without=no_twin)
    given = given_settings(settings, seed)
    if verify:
        others = (given, plots, gdb, vcd, coverage, sanitize, dry_run, view, speed)
        if any(option not in (None, False, []) for option in others):
            raise InputError("--verify repeats a run as it was; give --out, --json or --quiet")
        _verify(experiment, out, as_json, quiet)
    if speed is not None and not view:
        raise InputError("--speed is that of a run beside its page; add --view, or leave it out")
    given = [*_ways_to_run(coverage, sanitize), *given]
    loaded = Experiment.load(experiment, given)
    if dry_run:
        size = size_of(loaded.keys)
        typer.echo(json.dumps(size.as_dict()) if as_json else size.text())
        return
    _check_ways(loaded, coverage, sanitize)
    if plots:
        extras.require("matplotlib")
    probes = Probes(gdb, gdb_port, tuple(vcd or ()))
    shown = Shown(view, view_port, no_browser, as_json, quiet)
    pace = PAGE_SPEED if speed is None else speed
    with shown.display(steers=True, note=_waits_at(pace)) as (display, viewer):
        outcome = run_experiment(
            loaded,
            out,
            sys.argv,
            display,
            probes=probes,
            twin=twin,
            window=viewer,
            speed=pace if view else math.inf,
            covered=coverage,
            sanitized=sanitize,
        )
        if coverage:
            _cover(loaded, outcome)
        tell(outcome, plots=plots, as_json=as_json, seen=view)
        if not outcome.stop_asked:
            stay(viewer)
    raise typer.Exit(outcome.exit_code)


@dataclass(frozen=True)
class Shown:
    """How a run is shown, as options have it."""

    view: bool
    view_port: int
    no_browser: bool
    as_json: bool
    quiet: bool

    @contextlib.contextmanager
    def display(
        self, *, steers: bool, note: str = ""
    ) -> "Iterator[tuple[Display, AttachedViewer | None]]":
        """The display on the terminal, and the page if it is wanted; `steers`: the page may.
        `note`: a word on how it runs beside the page."""
        display = terminal.display(self.quiet)
        with window(
            self.view,
            display,
            port=self.view_port,
            no_browser=self.no_browser,
            quiet=self.quiet,
            steers=steers,
            note=note,
        ) as viewer:
            yield display, viewer


def _waits_at(speed: float) -> str:
    """A line on when and how fast a run goes beside its page; none where it waits for nothing."""
    if math.isinf(speed):
        return ""
    return (
        f"open that page: the run waits for it, and goes {speed:g} times real time "
        "(--speed 1 is real time, --speed max waits for nothing)"
    )


def _ways_to_run(coverage: bool, sanitize: bool) -> list[Setting]:
    """Settings by which programs run so that what is asked for is seen."""
    if coverage and sanitize:
        raise InputError(ONE_OF_BOTH)
    return [*([COVERED] if coverage else []), *([SANITIZED] if sanitize else [])]


def _check_ways(experiment: Experiment, coverage: bool, sanitize: bool) -> None:
    """InputError if a program does not run so."""
    if coverage:
        check_covered(experiment)
    if sanitize:
        check_sanitized(experiment)


def _cover(experiment: Experiment, outcome: Outcome) -> None:
    """Writes the report of what has run into the run folder, and its shares into the summary."""
    from kilotwin.programs.coverage import report

    folder = Path(outcome.summary["run_folder"]) / "coverage"
    sources = report.of_programs(report.own_marks(experiment, outcome.marks))
    outcome.summary["coverage"] = report.written(sources, folder)


def tell(outcome: Outcome, *, plots: bool, as_json: bool, seen: bool) -> None:
    """Prints the summary of a run, and what to type next; `seen`: in the browser."""
    summary = outcome.summary
    if plots:
        _plot_both(Path(summary["run_folder"]))
    typer.echo(json.dumps(summary) if as_json else plain(terminal.summary_text(summary)))
    if troubles := terminal.troubles_text(summary):
        typer.echo(plain(troubles), err=True)
    if outcome.exit_code == EXIT_INTERRUPTED:
        typer.echo("interrupted; what was recorded is kept", err=True)
    if not as_json:
        typer.echo(plain(terminal.next_text(summary, seen=seen)))


def _verify(recorded: Path, out: Path | None, as_json: bool, quiet: bool) -> NoReturn:
    display = terminal.display(quiet)
    from kilotwin.session.verify import verify

    verdict = verify(recorded, out, sys.argv, display)
    typer.echo(json.dumps(verdict.as_dict()) if as_json else _verdict_text(verdict))
    raise typer.Exit(1 if verdict.difference else 0)


def _verdict_text(verdict: "Verification") -> str:
    """Two lines and more: whether it is the same, and what has changed in between."""
    said = verdict.difference or "the same result"
    rows = f"{verdict.compared:,} rows of samples compared"
    hashes = "" if verdict.hashes is None else f", result hash {verdict.hashes[1]}"
    lines = [f"{verdict.folder}: {said}", f"  {rows}{hashes}"]
    return "\n".join([*lines, *(f"  changed since: {change}" for change in verdict.changed)])


def _plot_both(folder: Path) -> None:
    from kilotwin.studies.plot import figures as plot

    for figure in ("map", "timeline"):
        plot.write_figure(figure, folder, folder / f"{figure}.png")
