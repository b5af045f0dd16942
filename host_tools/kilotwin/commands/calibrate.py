"""`kilotwin calibrate ...`: robots' duties and uids. Each verb has a module of its own."""

import typer

from kilotwin.commands import calibrate_motors, calibrate_uid

app = typer.Typer(
    help="Sets robots' duties and uids, in their EEPROM and in the lab's file.",
    epilog="What it does and what it needs stands in docs/lab.md.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("motors", epilog=calibrate_motors.EXAMPLES)(calibrate_motors.motors)
app.command("uid", epilog=calibrate_uid.EXAMPLES)(calibrate_uid.uid)
