"""`kilotwin compare`: with the paper's claims and with recordings of a real Kilogrid."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Json, Where, command_app
from kilotwin.compare import kilogrid_uplink, kilogrid_walk, paper_claims, real_runs
from kilotwin.errors import InputError

app = command_app()


class Reference(StrEnum):
    """References of `compare`."""

    kilogrid_walk = "kilogrid-walk"
    paper = "paper"
    kilogrid_uplink = "kilogrid-uplink"
    real = "real"


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin compare kilogrid-walk runs/my-walk\n\n"
    "  kilotwin compare kilogrid-uplink runs/my-grid --json\n\n"
    "  kilotwin compare real runs/collective-perception\n\n"
    "  kilotwin compare real runs/collective-perception logs/*.kilodat\n\n"
    "  kilotwin compare paper runs/sweep-paper-grid",
)
def compare(
    reference: Annotated[
        Reference,
        typer.Argument(
            help="real: logs of collective perception; kilogrid-walk: walks of real robots; "
            "paper: its claims."
        ),
    ],
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="RUN|SWEEP", help="A run folder; for paper a sweep's, for real also a .kilodat."
        ),
    ],
    logs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="LOG",
            help="real: three or more .kilodat files (or .kilodat.xz) in place of the figures that "
            "Kilotwin carries.",
        ),
    ] = None,
    *,
    where: Where = None,
    as_json: Json = False,
) -> None:
    """Compare with what others measured. 1 if it is outside the bounds, in every reading."""
    if logs and reference is not Reference.real:
        raise InputError(f"{logs[0]}: only real takes logs; remove them, or type: compare real")
    if reference is Reference.paper:
        readings = paper_claims.check(folder, where or [], steps.note(quiet=False))
        found, text = paper_claims.as_dict(readings), paper_claims.report_text(readings)
        good = any(
            paper_claims.MISSED not in paper_claims.verdicts(findings).values()
            for findings in readings.values()
        )
    elif reference is Reference.real:
        with_real = real_runs.compare(folder, logs or [])
        found, text = with_real.as_dict(), real_runs.report_text(with_real)
        good = with_real.within_bounds
    else:
        real: Any = kilogrid_walk if reference is Reference.kilogrid_walk else kilogrid_uplink
        comparison = real.compare(folder)
        found, text = comparison.as_dict(), real.report_text(comparison)
        good = comparison.within_bounds
    typer.echo(json.dumps(found) if as_json else text)
    if not good:
        raise typer.Exit(1)
