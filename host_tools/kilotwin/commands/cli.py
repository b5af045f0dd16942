"""The `kilotwin` command: loads the module of the command that was typed, and shows errors.

To add a command, add a module with an `app` that holds it, and a line to PANELS. Every option is
an environment variable too.
"""

import contextlib
import gc
import os
import signal
import sys
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, NoReturn

import typer
import typer.core
import typer.main

import kilotwin
from kilotwin.errors import InputError, InterruptError, KilotwinError, RunError, cause_of
from kilotwin.files import extras
from kilotwin.files.confinement import SINGLE_THREADED
from kilotwin.files.interrupts import once
from kilotwin.files.plain_text import plain

PANELS = {
    "Run and see": {
        "run": "Run an experiment and leave a run folder.",
        "view": "See a run in the browser, at any time of it.",
        "why": "Say why a robot did something: the code, the message, its sender's code, and so "
        "on.",
        "plot": "Draw a figure of a run or a sweep, or a video of a run.",
        "export": "Write a run as other tools read it: CSV, MCAP for Foxglove.",
    },
    "Study": {
        "sweep": "Run an experiment many times, varied, into one data set. Goes on where it was "
        "stopped.",
        "optimise": "Search for the values of keys with which a metric is best. Goes on where it "
        "was stopped.",
        "sensitivity": "Say which keys matter for a metric. Goes on where it was stopped.",
        "compare": "Compare two runs or sweeps, metric by metric. 1 if they are outside the "
        "bounds.",
    },
    "Test": {
        "test": "Run scenarios: experiments with expectations. Exits 1 if one fails.",
        "hunt": "Search for what breaks an experiment, and shrink it to a scenario that fails.",
        "check": "Build a program for PC and robot, look for what goes wrong there, run its "
        "scenarios.",
        "port": "Say what of a program would go wrong on the robot. 1 if something fails there.",
        "debug": "Repeat a run and hold a robot in it with gdb, line by line, forwards and "
        "backwards.",
        "check-run": "Say whether a run folder is whole, truncated, spoiled or damaged. 1 if it is "
        "not whole.",
    },
    "Robots and table": {
        "build": "Build a program into an image to flash, or a guest, and say how large it is.",
        "flash": "Writes programs into robots and modules and reads back that they are there.",
        "robots": "Gives orders to all robots by infrared light, and asks them how they are.",
        "calibrate": "Sets robots' duties, gain tables and uids, in their EEPROM and in the lab's "
        "file.",
        "grid": "Talks to the modules of a Kilogrid, and through them to its robots.",
        "record": "Run an experiment on a table and leave a run folder. Ctrl-C leaves everything "
        "idle.",
        "serve": "Emulates a table with robots, or a device, for programs outside.",
    },
    "Tools": {
        "new": "Make a repository for a lab: program, experiment, scenario, tests, and files for"
        " CI.",
        "doctor": "Say what is here, what is missing, and what to type.",
        "bench": "Measure robot-seconds per CPU-second, on one core or on several.",
    },
}
"""Modules of kilotwin.commands and the first lines of their help, as `--help` groups them."""

COMMANDS = {name: text for panel in PANELS.values() for name, text in panel.items()}

_ENDED_BY = 128  # exit code less the signal's number, as shells have it


class Commands(typer.core.TyperGroup):
    """Lists the commands without their modules, whose pyarrow and matplotlib take a second."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The one that was typed, loaded."""
        name, _, rest = super().resolve_command(ctx, args)
        assert name is not None
        if name == "run" and "--serve" in rest:
            raise InputError("run has no --serve; type: kilotwin serve world EXPERIMENT.toml")
        command = load(name)
        gc.freeze()  # what was imported stays, and no collection has to look at it
        gc.enable()
        return name, command, rest


def load(name: str) -> Any:
    """The command or group of commands called `name`, as click has it.

    Each option can be set in the environment: `--link-ohc` by KILOTWIN_LINK_OHC, unless its
    declaration names another variable.
    """
    module = import_module(f"kilotwin.commands.{name.replace('-', '_')}")
    command: Any = typer.main.get_command(module.app)
    for one in (command, *getattr(command, "commands", {}).values()):
        for option in one.params:
            if option.param_type_name == "option" and option.envvar is None:
                longest = max(option.opts, key=len).lstrip("-")
                option.envvar = "KILOTWIN_" + longest.replace("-", "_").upper()
            if option.param_type_name == "option":
                option.show_envvar = False
                if option.is_flag and option.metavar is None:
                    option.metavar = ""  # not "<bool>"
        _show_examples_first(one)
    return command


def _show_examples_first(command: Any) -> None:
    """A command's help has its examples above its options, one a line."""
    heading, *examples = [line.strip() for line in (command.epilog or "").split("\n\n")]
    if heading != "Examples:":
        return
    lines = "\n".join(f"  {example}" for example in examples)
    command.help = f"{command.help}\n\n\b\n{heading}\n{lines}"
    command.epilog = None


app = typer.Typer(
    cls=Commands,
    help="Runs unedited Kilobot firmware in a simulated world, and looks at what came of it.\n\n"
    "\b\nExamples:\n"
    "  kilotwin new my-lab                a folder with a program to start from\n"
    "  kilotwin run my.toml --view        an experiment in the browser, as it goes\n"
    "  kilotwin run --help                more of a command",
    epilog="Exit codes: 0 done, 1 failed, 2 bad usage or input, 3 device missing, 4 some robots "
    "or modules failed (listed), 124 a test took too long, 130 interrupted. Every option can be "
    "set in the environment: --out by KILOTWIN_OUT.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """The command that was typed. 0 done, 1 failed, 2 bad input, 3 no device, 4 some failed."""
    _open_closed_streams()
    gc.disable()  # until a command is loaded: imports leave no garbage, a quarter of their time
    # Threads of numpy's linear algebra, of which we have none, would only spin beside the engine.
    for name, value in SINGLE_THREADED.items():
        os.environ.setdefault(name, value)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # we have none
    end = once(_end)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, end)
    try:
        _check_working_folder()
        try:
            app(prog_name="kilotwin")
        finally:
            sys.stdout.flush()
    except KilotwinError as error:
        if isinstance(error, InterruptError):
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # one more has nothing left to end
        _show(str(error), error.detail)
        sys.exit(error.exit_code)
    except ModuleNotFoundError as error:
        lacks = extras.explained(error)
        _show(str(lacks))
        sys.exit(lacks.exit_code)
    except OSError as error:
        _discard_output()
        _show(f"{error.filename or 'output'}: {cause_of(error)}; see to the disk")
        sys.exit(RunError.exit_code)


def _open_closed_streams() -> None:
    """Where a shell has closed one of the first three files, what is read or written there is
    nothing; else the next file that is opened would take its place."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The lowest number that is free is this one.
            nothing = os.open(os.devnull, os.O_RDONLY if number == 0 else os.O_WRONLY)
            mode = "r" if number == 0 else "w"
            setattr(sys, name, os.fdopen(nothing, mode, encoding="utf-8", closefd=False))


def _end(number: int, _frame: FrameType | None) -> NoReturn:
    """Ends what does not heed a signal otherwise, but not before it has cleared up behind itself.
    One more, a second later, ends it at once."""

    def end_at_once(number: int, _frame: FrameType | None) -> NoReturn:
        os._exit(_ENDED_BY + number)

    signal.signal(number, once(end_at_once, heard=True))
    sys.exit(_ENDED_BY + number)


def _check_working_folder() -> None:
    try:
        Path.cwd()
    except FileNotFoundError:
        raise InputError("the folder that you are in has been deleted; change to another") from None


def _show(line: str, detail: str = "") -> None:
    with contextlib.suppress(OSError):
        typer.echo(f"kilotwin: {plain(line)}", err=True)
        if detail:
            typer.echo(plain(detail), err=True)


def _discard_output() -> None:
    """Drops the buffer, which cannot be written: Python would try again at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"kilotwin {kilotwin.__version__}")
        raise typer.Exit


@app.callback()
def options_of_all_commands(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """The options of all commands."""


def _only_listed() -> None:
    """Stands for a command until it is loaded."""


for _panel, _commands in PANELS.items():
    for _name, _help in _commands.items():
        app.command(_name, help=_help, rich_help_panel=_panel)(_only_listed)


if __name__ == "__main__":
    main()
