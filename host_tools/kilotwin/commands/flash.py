"""`kilotwin flash ...`: programs into robots and modules. Each verb has a module of its own."""

import typer

from kilotwin.commands import flash_modules, flash_robot, flash_robots

app = typer.Typer(
    help="Writes programs into robots and modules and reads back that they are there.",
    epilog="FILE is a .hex, or a program's .c or folder, which is built first. What flashed "
    "robots need to know stands in docs/lab.md.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("robot", epilog=flash_robot.EXAMPLES)(flash_robot.robot)
app.command("robots", epilog=flash_robots.EXAMPLES)(flash_robots.robots)
app.command("modules", epilog=flash_modules.EXAMPLES)(flash_modules.modules)
