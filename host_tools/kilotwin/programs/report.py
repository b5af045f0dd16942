"""`kilotwin build` without --hex: a guest of any program, and how large it is."""

import shutil
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.programs import Program
from kilotwin.files.drafts import draft_of
from kilotwin.programs.cache import Notify
from kilotwin.programs.guest_symbols import GuestSymbols
from kilotwin.programs.linking import wrong_target
from kilotwin.programs.native.guest import build


def build_program(program: Program, output: Path | None, notify: Notify) -> dict[str, Any]:
    """The --json object. The guest stays in the cache; `output` gets a copy."""
    try:
        guest = build(program, notify)
    except InputError as error:
        raise wrong_target(program) or error from None
    size = GuestSymbols(guest.file).size
    file = guest.file
    if output is not None:
        try:
            with draft_of(output) as draft:
                shutil.copyfile(guest.file, draft)
            file = output
        except OSError as error:
            reason = cause_of(error)
            raise InputError(f"-o {output}: {reason}; name another file") from None
    return {
        "program": guest.name,
        "for": program.target,
        "sources": [str(source) for source in program.sources],
        "file": str(file),
        "state_bytes": size.state,
        "text_bytes": size.text,
        "key": guest.key,
        "compiler": guest.compiler,
    }


def report_text(report: dict[str, Any]) -> str:
    """The same in three lines."""
    return (
        f"{report['program']}: {report['file']}\n"
        f"  state {report['state_bytes']:7,} bytes per {report['for']} "
        "(variables, with those of the API)\n"
        f"  text  {report['text_bytes']:7,} bytes of code for this PC"
    )
