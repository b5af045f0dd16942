"""`kilotwin compare`: with the paper's claims and with recordings of a real Kilogrid."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Json, Where, command_app
from kilotwin.compare import kilogrid_uplink, kilogrid_walk, paper_claims

app = command_app()


class Reference(StrEnum):
    """What `compare` can compare with."""

    kilogrid_walk = "kilogrid-walk"
    paper = "paper"
    kilogrid_uplink = "kilogrid-uplink"


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
    if reference is Reference.paper:
        readings = paper_claims.check(folder, where or [], steps.note(quiet=False))
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
