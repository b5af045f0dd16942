"""`kilotwin calibrate ...`: duties, gain tables, uids. Each verb has a module of its own."""

import typer

from kilotwin.commands.calibrate import motors, ranging, uid

app = typer.Typer(
    help="Sets robots' duties, gain tables and uids, in their EEPROM and in the lab's file.",
    epilog="What it does and what it needs stands in docs/lab.md.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("motors", epilog=motors.EXAMPLES)(motors.motors)
app.command("ranging", epilog=ranging.EXAMPLES)(ranging.ranging)
app.command("uid", epilog=uid.EXAMPLES)(uid.uid)
