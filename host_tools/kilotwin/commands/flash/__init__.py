"""`kilotwin flash ...`: programs into robots and modules. Each verb has a module of its own."""

import typer

from kilotwin.commands.flash import modules, robot, robots

app = typer.Typer(
    help="Writes programs into robots and modules and reads back that they are there.",
    epilog="FILE is a .hex, or a program's .c or folder, which is built first. What flashed "
    "robots need to know stands in docs/lab.md.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("robot", epilog=robot.EXAMPLES)(robot.robot)
app.command("robots", epilog=robots.EXAMPLES)(robots.robots)
app.command("modules", epilog=modules.EXAMPLES)(modules.modules)
