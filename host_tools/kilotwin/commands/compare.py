"""`kilotwin compare`: two variants."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands.options import Json, Where, command_app
from kilotwin.studies.compare import variants
from kilotwin.studies.compare.sides import open_both

app = command_app()


Within = Annotated[
    list[str] | None,
    typer.Option(
        metavar="METRIC=BOUND",
        help="How far B may be from A, as hops=2 or hops=10%; repeatable. 1 if it is not "
        "within for sure.",
    ),
]
OnlyMetrics = Annotated[
    list[str] | None,
    typer.Option("--metric", help="Only this metric; repeatable."),
]


def _choose(name: str) -> Any:
    return typer.Option(
        f"--{name}",
        metavar="COLUMN=VALUE",
        envvar=f"KILOTWIN_{name.upper()}",
        help=f"Of {name.upper()}, a sweep, only trials that have this; repeatable.",
    )


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin compare runs/sweep-now runs/sweep-new --within hops=2\n\n"
    "  kilotwin compare runs/my-sweep runs/my-sweep --a swarm.size=20 --b swarm.size=40\n\n"
    "  kilotwin compare runs/emulated recorded.kilodat",
)
def compare(
    first: Annotated[
        Path, typer.Argument(metavar="A", help="A run folder, a sweep's or a .kilodat.")
    ],
    second: Annotated[Path, typer.Argument(metavar="B", help="The one to hold against it.")],
    *,
    where: Where = None,
    a: Annotated[list[str] | None, _choose("a")] = None,
    b: Annotated[list[str] | None, _choose("b")] = None,
    metric: OnlyMetrics = None,
    within: Within = None,
    as_json: Json = False,
) -> None:
    """Compare two runs or sweeps, metric by metric. 1 if they are outside the bounds."""
    both = open_both(first, second, [*(where or []), *(a or [])], [*(where or []), *(b or [])])
    comparison = variants.compare(*both, metric or [], variants.bounds_of(within or []))
    text = variants.report_text(comparison)
    typer.echo(json.dumps(comparison.as_dict()) if as_json else text)
    if not comparison.within_bounds:
        raise typer.Exit(1)
