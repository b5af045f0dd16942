"""`doctor`: Kilotwin's needs of this machine, which of them are met, and what to type."""

import json
import os
import platform
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import typer

from kilotwin.commands.gdb_programs import find_gdb
from kilotwin.commands.options import Json, command_app
from kilotwin.errors import KilotwinError, cause_of
from kilotwin.files.headers import CAN_BIT_RATE
from kilotwin.programs.cache import cache_folder
from kilotwin.programs.native.guest import compiler_version, find_compiler
from kilotwin.table.can.buses import interfaces
from kilotwin.table.ports.list_ports import ports

try:
    from kilotwin import _emulator

    _NO_ENGINE = ""
except ImportError as error:
    _NO_ENGINE = str(error)

app = command_app()


@dataclass(frozen=True)
class Finding:
    """One thing looked at. `remedy` is what to type; without it nothing is missing."""

    what: str
    found: str
    remedy: str = ""
    needed: bool = True

    @property
    def blocks(self) -> bool:
        """Whether nothing can be run before this is mended."""
        return self.needed and bool(self.remedy)

    def as_dict(self) -> dict[str, Any]:
        """For --json."""
        return {**asdict(self), "ok": not self.remedy}


def examine() -> list[Finding]:
    """Looks at everything; takes well below a second."""
    looks: list[Callable[[], Finding]] = [
        _python,
        _engine,
        _compiler,
        _cache,
        _run_folders,
        _confinement,
        _cores,
        _avr_compiler,
        _quick_compiler,
        _debugger,
        _avrdude,
        _socketcan,
        _serial_ports,
    ]
    return [look() for look in looks]


def _python() -> Finding:
    return Finding("Python", f"{platform.python_version()} ({sys.executable})")


def _engine() -> Finding:
    if _NO_ENGINE:
        return Finding("engine", f"not built ({_NO_ENGINE})", "make setup")
    return Finding(
        "engine", f"{_emulator.VERSION}, Box2D {_emulator.BOX2D_VERSION}, {_emulator.BUILD}"
    )


def _compiler() -> Finding:
    what = "compiler of robot programs"
    try:
        compiler = find_compiler()
        return Finding(what, f"{compiler_version(compiler)} ({compiler})")
    except KilotwinError as error:
        return Finding(what, str(error), "apt-get install gcc")


def _cache() -> Finding:
    folder = cache_folder()
    return _writable(
        "compiled programs", folder, "export KILOTWIN_CACHE=FOLDER, one that can be written"
    )


def _run_folders() -> Finding:
    return _writable(
        "run folders", Path("runs"), "cd to a folder that can be written, or use --out"
    )


def _confinement() -> Finding:
    what = "confinement of robots' programs"
    if _NO_ENGINE:
        return Finding(what, "not known without the engine", needed=False)
    missing = _emulator.lacking_layers()
    if not missing:
        return Finding(what, "whole: Landlock, seccomp, limits of memory", needed=False)
    remedy = "run what you do not trust on Linux 5.13 or newer"
    return Finding(what, "; ".join(missing), remedy, needed=False)


def _writable(what: str, folder: Path, remedy: str) -> Finding:
    existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if os.access(existing, os.W_OK | os.X_OK):
        return Finding(what, str(folder))
    return Finding(what, f"{existing} cannot be written", remedy)


def _cores() -> Finding:
    return Finding("processor cores", str(len(os.sched_getaffinity(0))))


def _avr_compiler() -> Finding:
    what = "avr-gcc, for real robots"
    compiler = shutil.which("avr-gcc")
    if compiler is None:
        remedy = "apt-get install gcc-avr avr-libc binutils-avr"
        return Finding(what, "not here", remedy, needed=False)
    version = subprocess.run(
        [compiler, "-dumpversion"], capture_output=True, text=True, check=False
    )
    return Finding(what, f"{version.stdout.strip()} ({compiler})", needed=False)


def _quick_compiler() -> Finding:
    what = "tcc, for translated programs at once"
    found = shutil.which("tcc")
    remedy = "" if found else "apt-get install tcc"
    return Finding(what, found or "not here, gcc takes its place", remedy, needed=False)


def _debugger() -> Finding:
    what = "gdb for AVR, for `kilotwin debug`"
    found = find_gdb()
    remedy = "" if found else "apt-get install gdb-avr"
    return Finding(what, found or "not here", remedy, needed=False)


def _avrdude() -> Finding:
    what = "avrdude, to flash a robot by wire"
    found = shutil.which("avrdude")
    remedy = "" if found else "apt-get install avrdude"
    return Finding(what, found or "not here", remedy, needed=False)


def _socketcan() -> Finding:
    what = "SocketCAN, for a real Kilogrid"
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        found = f"not in this kernel ({cause_of(error)})"
        return Finding(what, found, "modprobe can_raw, on a kernel that has it", needed=False)
    names = interfaces()
    if not names:
        remedy = f"ip link set can0 up type can bitrate {CAN_BIT_RATE}, with an adapter plugged in"
        return Finding(what, "in this kernel, no interface", remedy, needed=False)
    return Finding(what, f"interfaces {', '.join(names)}", needed=False)


def _serial_ports() -> Finding:
    what = "serial ports, for overhead controller and dispatcher"
    found = ports()
    if not found:
        return Finding(what, "none", "plug the device in", needed=False)
    refused = [port.name for port in found if not port.may_open]
    remedy = "sudo usermod -a -G dialout $USER, then log in again" if refused else ""
    return Finding(what, "; ".join(map(str, found)), remedy, needed=False)


def report_text(findings: list[Finding]) -> str:
    """A line each, what to type below those that lack something, and a last word."""
    width = max(len(finding.what) for finding in findings)
    lines = []
    for finding in findings:
        mark = "ok     " if not finding.remedy else "MISSING" if finding.needed else "absent "
        lines.append(f"{mark}  {finding.what:<{width}}  {finding.found}")
        if finding.remedy:
            lines.append(f"         {'':<{width}}  type: {finding.remedy}")
    ready = not any(finding.blocks for finding in findings)
    lines.append("Ready to run experiments." if ready else "Not ready: see MISSING above.")
    return "\n".join(lines)


@app.command(epilog="Example: kilotwin doctor")
def doctor(as_json: Json = False) -> None:
    """Say what is here, what is missing, and what to type."""
    findings = examine()
    if as_json:
        typer.echo(json.dumps([finding.as_dict() for finding in findings], indent=2))
    else:
        typer.echo(report_text(findings))
    if any(finding.blocks for finding in findings):
        raise typer.Exit(1)
