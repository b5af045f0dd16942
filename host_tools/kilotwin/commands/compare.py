"""`kilotwin compare`: two variants, or one with the paper's claims or a real Kilogrid."""

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands import steps
from kilotwin.commands.options import Json, Where, command_app
from kilotwin.errors import InputError
from kilotwin.studies.compare import kilogrid_uplink, kilogrid_walk, real_runs, variants
from kilotwin.studies.compare.sides import open_both
from kilotwin.studies.paper import claims

app = command_app()


class Reference(StrEnum):
    """References of `compare`."""

    kilogrid_walk = "kilogrid-walk"
    paper = "paper"
    kilogrid_uplink = "kilogrid-uplink"
    real = "real"


_REFERENCES = ", ".join(Reference)

Within = Annotated[
    list[str] | None,
    typer.Option(
        metavar="METRIC=BOUND",
        help="A B: how far B may be from A, as hops=2 or hops=10%; repeatable. 1 if it is not "
        "within for sure.",
    ),
]
OnlyMetrics = Annotated[
    list[str] | None,
    typer.Option("--metric", help="A B: only this metric; repeatable."),
]


def _choose(name: str) -> Any:
    return typer.Option(
        f"--{name}",
        metavar="COLUMN=VALUE",
        envvar=f"KILOTWIN_{name.upper()}",
        help=f"A B: of {name.upper()}, a sweep, only trials that have this; repeatable.",
    )


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin compare runs/sweep-now runs/sweep-new --within hops=2\n\n"
    "  kilotwin compare runs/my-sweep runs/my-sweep --a swarm.size=20 --b swarm.size=40\n\n"
    "  kilotwin compare runs/emulated recorded.kilodat\n\n"
    "  kilotwin compare kilogrid-walk runs/my-walk\n\n"
    "  kilotwin compare kilogrid-uplink runs/my-grid --json\n\n"
    "  kilotwin compare real runs/collective-perception\n\n"
    "  kilotwin compare real runs/collective-perception logs/*.kilodat\n\n"
    "  kilotwin compare paper runs/sweep-paper-grid",
)
def compare(
    reference: Annotated[
        str,
        typer.Argument(
            metavar="A|REFERENCE",
            help="A run, a sweep or a .kilodat to compare with; or real: logs of collective "
            "perception; kilogrid-walk: walks of real robots; kilogrid-uplink; paper: its claims.",
        ),
    ],
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="B",
            help="A run folder, a sweep's or a .kilodat; for paper a sweep's.",
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
    a: Annotated[list[str] | None, _choose("a")] = None,
    b: Annotated[list[str] | None, _choose("b")] = None,
    metric: OnlyMetrics = None,
    within: Within = None,
    as_json: Json = False,
) -> None:
    """Compare two runs or sweeps, or with what others measured. 1 if it is outside the bounds."""
    if logs and reference != Reference.real:
        raise InputError(f"{logs[0]}: only real takes logs; remove them, or type: compare real")
    if reference in Reference.__members__.values():
        for option, given in {"a": a, "b": b, "metric": metric, "within": within}.items():
            if given:
                what = "for two runs or sweeps"
                raise InputError(
                    f"--{option} {given[0]}: {what}; {reference} has bounds of its own"
                )
        found, text, good = _with_reference(Reference(reference), folder, where or [], logs or [])
    else:
        if not Path(reference).exists():
            what = f"no run, no sweep and no reference; references are {_REFERENCES}"
            raise InputError(f"{reference}: {what}")
        both = open_both(
            Path(reference), folder, [*(where or []), *(a or [])], [*(where or []), *(b or [])]
        )
        comparison = variants.compare(*both, metric or [], variants.bounds_of(within or []))
        found, text = comparison.as_dict(), variants.report_text(comparison)
        good = comparison.within_bounds
    typer.echo(json.dumps(found) if as_json else text)
    if not good:
        raise typer.Exit(1)


def _with_reference(
    reference: Reference, folder: Path, where: list[str], logs: list[Path]
) -> tuple[dict[str, Any], str, bool]:
    """The --json object, the text, and whether it is within the bounds."""
    if reference is Reference.paper:
        readings = claims.check(folder, where, steps.note(quiet=False))
        good = any(
            claims.MISSED not in claims.verdicts(findings).values()
            for findings in readings.values()
        )
        return claims.as_dict(readings), claims.report_text(readings), good
    if reference is Reference.real:
        with_real = real_runs.compare(folder, logs)
        return with_real.as_dict(), real_runs.report_text(with_real), with_real.within_bounds
    real: Any = kilogrid_walk if reference is Reference.kilogrid_walk else kilogrid_uplink
    comparison = real.compare(folder)
    return comparison.as_dict(), real.report_text(comparison), comparison.within_bounds
