"""`kilotwin new`: a repository for a lab's programs, with tests and CI."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from kilotwin.commands.options import Json, command_app
from kilotwin.errors import InputError
from kilotwin.experiment.programs import Api
from kilotwin.files import origins, templates
from kilotwin.programs import editor

app = command_app()

From = Annotated[
    str | None,
    typer.Option(
        "--from",
        metavar="WHEEL",
        help="Where the repository's pip gets Kilotwin: a wheel, which it then carries, a folder "
        "with one, the URL of one, or a git address. If not given where this one came from, or you "
        "are asked.",
    ),
]


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin new my-swarm --from build/wheel\n\n"
    "  kilotwin new my-table --grid --from git+https://example.org/kilotwin.git@v1.0.0\n\n"
    "  kilotwin new . --editor"
)
def new(
    folder: Annotated[Path, typer.Argument(metavar="NAME", help="The folder to make.")],
    *,
    grid: Annotated[bool, typer.Option("--grid", help="Robots on a Kilogrid.")] = False,
    where: From = None,
    only_editor: Annotated[
        bool,
        typer.Option(
            "--editor",
            help="Only write the files by which editors find kilolib.h, into a folder that is "
            "there: after a clone, or when Kilotwin has moved.",
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Make a repository for a lab: program, experiment, scenario, tests, and files for CI."""
    api: Api = "module" if grid else "kilobot"
    if only_editor:
        if not folder.is_dir():
            raise InputError(
                f"--editor: there is no folder {folder}; leave out --editor to make it"
            )
        _list(folder, editor.write(folder, api), as_json)
        return
    where = where or origins.own() or _asked()
    origin = origins.find(where)
    written = templates.write("grid" if grid else "robots", folder, origin)
    written += editor.write(folder, api)
    _list(folder, written, as_json, {"from": where})
    if as_json:
        return
    typer.echo(f"requirements.txt has pip install Kilotwin from {_told(origin, where)}")
    typer.echo(f"now type: cd {folder} && git init && pytest")


def _list(
    folder: Path, written: list[Path], as_json: bool, more: Mapping[str, str] | None = None
) -> None:
    """Prints the files, and with --json `more`."""
    if as_json:
        files = list(map(str, written))
        typer.echo(json.dumps({"folder": str(folder), "files": files, **(more or {})}))
        return
    for file in written:
        typer.echo(f"  {folder / file}")


def _asked() -> str:
    """The answer of the terminal. InputError if there is none to ask."""
    if not sys.stdin.isatty():
        raise InputError(
            "no index has Kilotwin yet, so say where pip gets it: --from and a wheel (`make wheel` "
            "makes one, in build/wheel), a folder with one, the URL of one, or a git address"
        )
    question = "No index has Kilotwin yet. Where is its wheel: a file, a folder, a URL, or git's?"
    typer.echo(question, err=True)
    return str(typer.prompt("from", err=True))


def _told(origin: origins.Origin, where: str) -> str:
    if origin.wheel is not None:
        return f"{origins.WHEELS}/{origin.wheel.name}, a copy; commit it too"
    return f"{where}, which is compiled there (minutes)" if origin.compiled else where
