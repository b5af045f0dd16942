"""`kilotwin run`: an experiment in the emulator."""

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from kilotwin.commands import terminal
from kilotwin.commands.options import (
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
    Speed,
    Trust,
    View,
    ViewPort,
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
from kilotwin.session.job import Probes, Serving
from kilotwin.session.run import Outcome
from kilotwin.session.run import run as run_experiment

if TYPE_CHECKING:
    from kilotwin.session.verify import Verdict

app = command_app()

Plots = Annotated[
    bool,
    typer.Option(
        "--plots",
        envvar="KILOTWIN_PLOTS",
        help="Also write map.png and timeline.png into the folder.",
    ),
]
Serve = Annotated[
    bool,
    typer.Option(
        "--serve",
        envvar="KILOTWIN_SERVE",
        help="Wait for a host, in real time: on an overhead controller's serial port and, with a "
        "\\[grid], on CAN buses; see `kilotwin record`.",
    ),
]
Port = Annotated[
    int | None,
    typer.Option(min=1, max=65535, envvar="KILOTWIN_PORT", help="--serve: on this port."),
]
Interfaces = Annotated[
    list[str] | None,
    typer.Option(
        "--can",
        metavar="INTERFACE",
        envvar="KILOTWIN_SERVE_CAN",
        help="--serve: on these interfaces of the kernel, one per bus.",
    ),
]
OhcLink = Annotated[
    Path | None,
    typer.Option(
        "--link-ohc",
        metavar="FILE",
        envvar="KILOTWIN_LINK_OHC",
        help="--serve: also give the overhead controller's port this name.",
    ),
]
DispatcherLink = Annotated[
    Path | None,
    typer.Option(
        "--link-dispatcher",
        metavar="FILE",
        envvar="KILOTWIN_LINK_DISPATCHER",
        help="--serve: the same for the dispatcher's port.",
    ),
]
Poses = Annotated[
    str | None,
    typer.Option(
        metavar="udp:HOST:PORT",
        envvar="KILOTWIN_POSES",
        help="--serve: a camera above the robots sends their poses there, as lines of JSON.",
    ),
]
Fast = Annotated[
    bool, typer.Option("--fast", envvar="KILOTWIN_FAST", help="--serve: do not wait at all.")
]
Gdb = Annotated[
    int | None,
    typer.Option(
        metavar="ROBOT",
        min=0,
        envvar="KILOTWIN_GDB",
        help="Let avr-gdb control a robot that runs on an ATmega328P.",
    ),
]
GdbPort = Annotated[
    int,
    typer.Option(min=1024, max=65535, envvar="KILOTWIN_GDB_PORT", help="Where gdb connects."),
]
Coverage = Annotated[
    bool,
    typer.Option(
        "--coverage",
        envvar="KILOTWIN_COVERAGE",
        help="Run programs by their machine code, and say which of their lines, and of the "
        "modules', have run.",
    ),
]
Sanitize = Annotated[
    bool,
    typer.Option(
        "--sanitize",
        envvar="KILOTWIN_SANITIZE",
        help="Run programs natively, and name what they do that the C standard leaves undefined, "
        "as an index out of bounds; exit 4 if one does.",
    ),
]
Verify = Annotated[
    bool,
    typer.Option(
        "--verify",
        envvar="KILOTWIN_VERIFY",
        help="Repeat the run of a run folder, or of its manifest.json, and name the first sample "
        "that differs; exit 1 if one does.",
    ),
]
DryRun = Annotated[
    bool,
    typer.Option(
        "--dry-run",
        envvar="KILOTWIN_DRY_RUN",
        help="Only check the experiment, and say how much it would record.",
    ),
]
Vcd = Annotated[
    list[int] | None,
    typer.Option(
        metavar="ROBOT",
        min=0,
        envvar="KILOTWIN_VCD",
        help="Trace the pins of a robot on an ATmega328P into the folder; repeatable.",
    ),
]


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin run experiments/paper/simplified-n100.toml\n\n"
    "  kilotwin run experiments/paper/firat-n50.toml --seed 7 --set swarm.informed=0.5 --json\n\n"
    "  kilotwin run experiments/kilogrid/paper-n50.toml --serve\n\n"
    "  kilotwin run experiments/porting/native-and-avr.toml --serve --link-ohc ohc\n\n"
    "  kilotwin run experiments/environment/wall.toml --serve --poses udp:127.0.0.1:5005\n\n"
    "  kilotwin run my.toml --view\n\n"
    "  kilotwin run my.toml --dry-run --json\n\n"
    "  kilotwin run my.toml --coverage\n\n"
    "  kilotwin run my.toml --sanitize\n\n"
    "  kilotwin run --verify runs/my-run/manifest.json"
)
def run(
    experiment: File,
    *,
    seed: Seed = None,
    settings: Settings = None,
    out: RunFolder = None,
    plots: Plots = False,
    serve: Serve = False,
    port: Port = None,
    can: Interfaces = None,
    link_ohc: OhcLink = None,
    link_dispatcher: DispatcherLink = None,
    poses: Poses = None,
    speed: Speed = 1.0,
    fast: Fast = False,
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
        others = (given, serve, plots, gdb, vcd, coverage, sanitize, dry_run, view)
        if any(option not in (None, False, []) for option in others):
            raise InputError("--verify repeats a run as it was; give --out, --json or --quiet")
        _verify(experiment, out, as_json, quiet)
    serving = None
    if serve:
        # The engine takes frames of the host once in a world step.
        given.insert(0, Setting(("engine", "step_ticks"), 1, "--serve"))
        from kilotwin.table.environment.poses import parse_address

        serving = Serving(
            port,
            tuple(can or ()),
            math.inf if fast else speed,
            link_ohc,
            link_dispatcher,
            None if poses is None else parse_address(poses),
        )
    given = [*_ways_to_run(coverage, sanitize), *given]
    loaded = Experiment.load(experiment, given)
    if dry_run:
        size = size_of(loaded.keys)
        typer.echo(json.dumps(size.as_dict()) if as_json else size.text())
        return
    if serving is not None:
        serving.check(loaded)
    _check_ways(loaded, coverage, sanitize)
    if plots:
        extras.require("matplotlib")
    probes = Probes(gdb, gdb_port, tuple(vcd or ()))
    display = terminal.display(quiet)
    steers = serving is None
    with window(
        view, display, port=view_port, no_browser=no_browser, quiet=quiet, steers=steers
    ) as viewer:
        outcome = run_experiment(
            loaded,
            out,
            sys.argv,
            display,
            serving=serving,
            probes=probes,
            twin=twin,
            window=viewer,
            covered=coverage,
            sanitized=sanitize,
        )
        if coverage:
            _cover(loaded, outcome)
        _tell(outcome, plots=plots, as_json=as_json)
        if not outcome.stop_asked:
            stay(viewer)
    raise typer.Exit(outcome.exit_code)


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


def _tell(outcome: Outcome, *, plots: bool, as_json: bool) -> None:
    """Prints the summary of a run."""
    summary = outcome.summary
    if plots:
        _plot_both(Path(summary["run_folder"]))
    typer.echo(json.dumps(summary) if as_json else plain(terminal.summary_text(summary)))
    if troubles := terminal.troubles_text(summary):
        typer.echo(plain(troubles), err=True)
    if outcome.exit_code == EXIT_INTERRUPTED:
        typer.echo("interrupted; what was recorded is kept", err=True)


def _verify(recorded: Path, out: Path | None, as_json: bool, quiet: bool) -> NoReturn:
    display = terminal.display(quiet)
    from kilotwin.session.verify import verify

    verdict = verify(recorded, out, sys.argv, display)
    typer.echo(json.dumps(verdict.as_dict()) if as_json else _verdict_text(verdict))
    raise typer.Exit(1 if verdict.difference else 0)


def _verdict_text(verdict: "Verdict") -> str:
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
