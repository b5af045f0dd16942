"""The `kilotwin` command: options in, one call, text out.

Every option is an environment variable too. What a command needs is imported in it, so that
`kilotwin --help` does not wait for pyarrow and matplotlib.
"""
# ruff: noqa: PLC0415

import json
import math
import os
import signal
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kilotwin import __version__
from kilotwin.commands.grid import grid_app, record
from kilotwin.commands.options import (
    Define,
    File,
    Include,
    Json,
    Quiet,
    RunFolder,
    Seed,
    Settings,
    Sources,
    Speed,
    Where,
    given_settings,
)
from kilotwin.errors import EXIT_INTERRUPTED, InputError, InterruptError, KilotwinError

if TYPE_CHECKING:
    from kilotwin.runs.served_grid import Serving

app = typer.Typer(
    help="Runs unedited Kilobot firmware in a simulated world, and looks at what came of it.",
    epilog="Exit codes: 0 done, 1 failed, 2 bad usage or input, 3 device missing, 4 some robots "
    "or modules failed (listed), 130 interrupted. Every option can be set in the environment, "
    "see each command's --help.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


class Figure(StrEnum):
    """The figures: two of a run, the others of a sweep."""

    timeline = "timeline"
    map = "map"
    median = "median"
    iqr = "iqr"
    symmetry = "symmetry"
    error = "error"


class Workload(StrEnum):
    """What `bench` can measure."""

    paper = "paper"
    walk = "walk"
    dense = "dense"
    squeeze = "squeeze"
    memory = "memory"
    grid = "grid"
    avr = "avr"


class Reference(StrEnum):
    """What `compare` can compare with."""

    kilogrid_walk = "kilogrid-walk"
    paper = "paper"
    kilogrid_uplink = "kilogrid-uplink"


def main() -> None:
    """The console script. 0 done, 1 failed, 2 bad input, 3 no device, 4 some robots failed."""
    # Threads of numpy's linear algebra, of which we have none, would only spin beside the engine.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        app(prog_name="kilotwin")
    except KilotwinError as error:
        if isinstance(error, InterruptError):
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # one more has nothing left to end
        typer.echo(f"kilotwin: {error}", err=True)
        if error.detail:
            typer.echo(error.detail, err=True)
        sys.exit(error.exit_code)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"kilotwin {__version__}")
        raise typer.Exit


@app.callback()
def kilotwin(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """The options of all commands."""


@app.command(epilog="Example: kilotwin doctor")
def doctor(as_json: Json = False) -> None:
    """Say what is here, what is missing, and what to type."""
    from kilotwin.commands.doctor import examine, report_text

    findings = examine()
    if as_json:
        typer.echo(json.dumps([finding.as_dict() for finding in findings], indent=2))
    else:
        typer.echo(report_text(findings))
    if any(finding.blocks for finding in findings):
        raise typer.Exit(1)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin run experiments/paper/simplified-n100.toml\n\n"
    "  kilotwin run experiments/paper/firat-n50.toml --seed 7 --set swarm.informed=0.5 --json\n\n"
    "  kilotwin run experiments/kilogrid/paper-n50.toml --serve"
)
def run(
    experiment: File,
    *,
    seed: Seed = None,
    settings: Settings = None,
    out: RunFolder = None,
    plots: Annotated[
        bool,
        typer.Option(
            "--plots",
            envvar="KILOTWIN_PLOTS",
            help="Also write map.png and timeline.png into the folder.",
        ),
    ] = False,
    serve: Annotated[
        bool,
        typer.Option(
            "--serve",
            envvar="KILOTWIN_SERVE",
            help="[grid] only: wait on CAN buses for a host, in real time; see `kilotwin record`.",
        ),
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(min=1, max=65535, envvar="KILOTWIN_PORT", help="--serve: on this port."),
    ] = None,
    can: Annotated[
        list[str] | None,
        typer.Option(
            "--can",
            metavar="INTERFACE",
            envvar="KILOTWIN_SERVE_CAN",
            help="--serve: on these interfaces of the kernel, one per bus.",
        ),
    ] = None,
    speed: Speed = 1.0,
    fast: Annotated[
        bool, typer.Option("--fast", envvar="KILOTWIN_FAST", help="--serve: do not wait at all.")
    ] = False,
    gdb: Annotated[
        int | None,
        typer.Option(
            metavar="ROBOT",
            min=0,
            envvar="KILOTWIN_GDB",
            help="Let avr-gdb control a robot that runs on an ATmega328P.",
        ),
    ] = None,
    gdb_port: Annotated[
        int,
        typer.Option(min=1024, max=65535, envvar="KILOTWIN_GDB_PORT", help="Where gdb connects."),
    ] = 1234,
    vcd: Annotated[
        list[int] | None,
        typer.Option(
            metavar="ROBOT",
            min=0,
            envvar="KILOTWIN_VCD",
            help="Trace the pins of a robot on an ATmega328P into the folder; repeatable.",
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run an experiment and leave a run folder."""
    from kilotwin.commands import terminal
    from kilotwin.experiment.experiment import Experiment
    from kilotwin.experiment.text import Setting
    from kilotwin.runs import run as runner
    from kilotwin.runs.job import Probes

    given = given_settings(settings, seed)
    serving = None
    if serve:
        # The engine hears the host once in a world step.
        given.insert(0, Setting(("engine", "step_ticks"), 1, "--serve"))
        serving = _serving(port, can or [], math.inf if fast else speed)
    loaded = Experiment.load(experiment, given)
    if serving is not None:
        serving.check(loaded)
    probes = Probes(gdb, gdb_port, tuple(vcd or ()))
    outcome = runner.run(
        loaded, out, sys.argv, terminal.display(quiet), serving=serving, probes=probes
    )
    summary = outcome.summary
    if plots:
        _plot_both(Path(summary["run_folder"]))
    typer.echo(json.dumps(summary) if as_json else terminal.summary_text(summary))
    if troubles := terminal.troubles_text(summary):
        typer.echo(troubles, err=True)
    if outcome.exit_code == EXIT_INTERRUPTED:
        typer.echo("interrupted; what was recorded is kept", err=True)
    raise typer.Exit(outcome.exit_code)


def _serving(port: int | None, interfaces: list[str], speed: float) -> "Serving":
    from kilotwin.runs.served_grid import Serving

    return Serving(port, tuple(interfaces), speed)


def _plot_both(folder: Path) -> None:
    from kilotwin.plot import write_figure

    for figure in (Figure.map, Figure.timeline):
        write_figure(figure.value, folder, folder / f"{figure.value}.png")


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin sweep experiments/paper/grid.toml -j 2\n\n"
    "  kilotwin sweep my.toml --seeds 2 --set duration_s=600 --list\n\n"
    "  kilotwin sweep my.toml --dask tcp://head-node:8786"
)
def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP", help="The sweep's TOML file.")],
    *,
    processes: Annotated[
        int | None,
        typer.Option(
            "-j", "--processes", min=1, envvar="KILOTWIN_PROCESSES", help="All cores if not given."
        ),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            envvar="KILOTWIN_DASK",
            help="Run on the Dask cluster with its scheduler there.",
        ),
    ] = None,
    slurm: Annotated[
        bool,
        typer.Option(
            "--slurm", envvar="KILOTWIN_SLURM", help="Run in jobs of Slurm, as \\[slurm] says."
        ),
    ] = False,
    seeds: Annotated[
        int | None,
        typer.Option(min=1, envvar="KILOTWIN_SEEDS", help="In place of the file's numbers."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            envvar="KILOTWIN_SET",
            help="Set any key of all experiments; repeatable.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            envvar="KILOTWIN_OUT", help="The folder of the data set; runs/sweep-NAME if not given."
        ),
    ] = None,
    listing: Annotated[
        bool,
        typer.Option(
            "--list",
            envvar="KILOTWIN_LIST",
            help="Only list the trials and whether they are there already.",
        ),
    ] = False,
    resume: Annotated[
        bool,
        typer.Option(
            envvar="KILOTWIN_RESUME",
            help="Go on where it was stopped, or want a folder without trials.",
        ),
    ] = True,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run an experiment many times, varied, into one data set. Goes on where it was stopped."""
    from kilotwin import sweep as sweeps
    from kilotwin.commands import terminal

    if dask and slurm:
        raise InputError("--dask and --slurm: a sweep runs in one place; name one of them")
    display = terminal.sweep_display(quiet)
    plan = sweeps.read_plan(file, given_settings(settings, None), seeds)
    place = sweeps.choose_place(plan, processes, dask, slurm)
    prepared = sweeps.Sweep.prepare(plan, out or sweeps.default_folder(plan), display.note)
    if listing:
        typer.echo(sweeps.listing(prepared, place, as_json))
        return
    estimate = prepared.estimate()
    if estimate.done and not resume:
        raise InputError(
            f"--no-resume: {prepared.data.folder} holds {estimate.done} of these trials; name "
            "another folder by --out, or leave --no-resume out to go on"
        )
    display.note(estimate.text(place))
    with prepared.data.held():
        prepared.run(place, display)
        summary = prepared.summary(prepared.finish())
    typer.echo(json.dumps(summary) if as_json else sweeps.summary_text(summary))
    raise typer.Exit(prepared.exit_code)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin plot map runs/my-run -o map.png\n\n"
    "  kilotwin plot timeline runs/my-run -o timeline.pdf\n\n"
    "  kilotwin plot median runs/sweep-paper-grid -o median.pdf\n\n"
    "  kilotwin plot symmetry runs/my-sweep --where controller.beta=1.5 -o symmetry.pdf"
)
def plot(
    figure: Annotated[Figure, typer.Argument(help="Which figure.")],
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|SWEEP",
            help="A run folder (timeline, map) or a sweep's (median, iqr, symmetry, error).",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", envvar="KILOTWIN_OUTPUT", help="The picture: .png, .svg or .pdf."
        ),
    ],
    where: Where = None,
) -> None:
    """Draw a figure of a run or a sweep."""
    from kilotwin.plot import write_figure

    write_figure(figure.value, folder, output, where or [])


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin build my.c\n\n"
    "  kilotwin build main.c helpers.c -I include -D N=3 -o my.so --json"
)
def build(
    program: Sources,
    *,
    include: Include = None,
    define: Define = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", envvar="KILOTWIN_OUTPUT", help="Copy the guest there."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Build a robot program into a guest and say how large it is."""
    from kilotwin.build import report as build_report
    from kilotwin.commands import terminal

    report = build_report.build_program(
        program, include or [], define or [], output, terminal.note(quiet)
    )
    typer.echo(json.dumps(report) if as_json else build_report.report_text(report))


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin port my.c\n\n"
    "  kilotwin port my.c --time 600 --seed 7\n\n"
    "  kilotwin port main.c helpers.c -I include -D N=3 --json"
)
def port(
    program: Sources,
    *,
    include: Include = None,
    define: Define = None,
    seconds: Annotated[
        float,
        typer.Option(
            "--time",
            min=1,
            max=86400,
            envvar="KILOTWIN_TIME",
            help="Simulated seconds to run it for.",
        ),
    ] = 60,
    seed: Annotated[
        int, typer.Option(min=0, envvar="KILOTWIN_SEED", help="Of what it hears and draws.")
    ] = 1,
    no_run: Annotated[
        bool, typer.Option("--no-run", envvar="KILOTWIN_NO_RUN", help="Look at the code only.")
    ] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say what of a program would go wrong on the robot. 1 if something fails there.

    It is looked at, and run on an emulated ATmega328P and on this computer with the same messages,
    light and random numbers.
    """
    from kilotwin import port as porting
    from kilotwin.commands import terminal
    from kilotwin.port.trial import Trial

    trial = None if no_run else Trial(seconds, seed)
    report = porting.check(program, include or [], define or [], trial, terminal.note(quiet))
    typer.echo(json.dumps(report.as_dict()) if as_json else report.text())
    if report.fails:
        raise typer.Exit(1)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin compare kilogrid-walk runs/my-walk\n\n"
    "  kilotwin compare kilogrid-uplink runs/my-grid --json\n\n"
    "  kilotwin compare paper runs/sweep-paper-grid",
)
def compare(
    reference: Annotated[
        Reference,
        typer.Argument(help="kilogrid-walk: logged walks of real robots; paper: its claims."),
    ],
    folder: Annotated[
        Path, typer.Argument(metavar="RUN|SWEEP", help="A run folder; for paper a sweep's.")
    ],
    *,
    where: Where = None,
    as_json: Json = False,
) -> None:
    """Compare with what others measured. 1 if it is outside the bounds, in every reading."""
    from kilotwin.commands import terminal
    from kilotwin.compare import kilogrid_uplink, kilogrid_walk, paper_claims

    if reference is Reference.paper:
        readings = paper_claims.check(folder, where or [], terminal.note(quiet=False))
        found, text = paper_claims.as_dict(readings), paper_claims.report_text(readings)
        good = any(
            paper_claims.MISSED not in paper_claims.verdicts(findings).values()
            for findings in readings.values()
        )
    else:
        real: Any = kilogrid_walk if reference is Reference.kilogrid_walk else kilogrid_uplink
        comparison = real.compare(folder)
        found, text = comparison.as_dict(), real.report_text(comparison)
        good = comparison.within_bounds
    typer.echo(json.dumps(found) if as_json else text)
    if not good:
        raise typer.Exit(1)


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin bench paper --repeats 5 --json\n\n"
    "  kilotwin bench walk --against ../kilotwin-before"
)
def bench(
    workloads: Annotated[
        list[Workload] | None, typer.Argument(help="What to measure; all if none is named.")
    ] = None,
    *,
    repeats: Annotated[
        int,
        typer.Option(min=1, envvar="KILOTWIN_REPEATS", help="Runs of each; the median counts."),
    ] = 3,
    duration_s: Annotated[
        float | None,
        typer.Option(
            envvar="KILOTWIN_DURATION_S", help="Simulated seconds in place of whole trials."
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(
            envvar="KILOTWIN_AGAINST",
            help="Another checkout, set up: run its engine and this one in turns.",
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure robot-seconds per CPU-second on one core."""
    from kilotwin.commands import bench as benchmarks
    from kilotwin.commands import bench_against, terminal

    names = [workload.value for workload in workloads or Workload]
    note = terminal.note(quiet)
    results: list[dict[str, Any]] = []
    interrupted = False
    try:
        if against is None:
            table_text = benchmarks.table_text
            results.extend(benchmarks.measure(names, repeats, duration_s, note))
        else:
            table_text = bench_against.table_text
            results.extend(bench_against.measure(names, against, repeats, duration_s, note))
    except (InterruptError, KeyboardInterrupt):
        interrupted = True
    if results or as_json:
        typer.echo(json.dumps(results, indent=2) if as_json else table_text(results))
    if interrupted:
        typer.echo("interrupted; only what was measured in full is shown", err=True)
        raise typer.Exit(EXIT_INTERRUPTED)


app.add_typer(grid_app, name="grid")
app.command(
    epilog="Examples:\n\n"
    "  kilotwin record experiments/kilogrid/paper-n50.toml --can socketcand:127.0.0.1\n\n"
    "  kilotwin record my.toml --can socketcan:can0 --can socketcan:can1"
)(record)


if __name__ == "__main__":
    main()
