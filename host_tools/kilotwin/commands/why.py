"""`kilotwin why`: the chain from what a robot did back to its first cause."""

import contextlib
import json
import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from kilotwin.commands.options import Json, Quiet, command_app

app = command_app()


@app.command(
    epilog="Examples:\n\n"
    "  kilotwin why runs/my-run --robot 17 --at 312 led\n\n"
    "  kilotwin why runs/my-run --robot 17 --at 312 motors --depth 2\n\n"
    "  kilotwin why runs/my-run --robot 17 --at 312 infected --json"
)
def why(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    what: Annotated[
        str,
        typer.Argument(
            metavar="led|motors|VARIABLE",
            help="What changed: the LED, the motors, or a variable of the robot's program, as "
            "hops, file.c:hops, me.hops or table[2].",
        ),
    ] = "led",
    *,
    robot: Annotated[int, typer.Option(metavar="UID", help="The robot, by its uid.")],
    at: Annotated[
        float,
        typer.Option(metavar="SECONDS", help="The last change up to this moment of the run."),
    ],
    depth: Annotated[
        int,
        typer.Option(min=0, max=1000, help="Go back over so many messages, from robot to robot."),
    ] = 8,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say why a robot did something: the code, the message, its sender's code, and so on.

    The run is repeated up to that moment, with each store of the robots' programs watched. Beside
    the run, why.json has the chain: its page shows it as lines between robots.
    """
    from kilotwin.commands import terminal
    from kilotwin.studies.why.repeat import Asked, ask
    from kilotwin.studies.why.story import Story

    answer = ask(folder, Asked(robot, at, what, depth), sys.argv, terminal.display(quiet))
    story = Story(answer.run, answer.experiment)
    _keep(folder, story.lines_between(answer.links))
    if as_json:
        typer.echo(json.dumps({"run": str(folder), "chain": story.as_dicts(answer.links)}))
        return
    typer.echo("\n".join(story.lines(answer.links)))
    named = shlex.quote(str(folder))
    typer.echo(f"\nSee it: kilotwin view {named}  (the page at #t={at:g}&robot={robot})")


def _keep(folder: Path, lines: list[dict[str, Any]]) -> None:
    """For the run's page; where the folder cannot be written the page is without."""
    from kilotwin.files.drafts import draft_of
    from kilotwin.runs.folder import WHY

    with contextlib.suppress(OSError), draft_of(folder / WHY, sync=False) as draft:
        draft.write_text(json.dumps({"lines": lines}) + "\n")
