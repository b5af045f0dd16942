"""`kilotwin build`: a guest of any program, and how large it is."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kilotwin.build.guest import Notify, build
from kilotwin.build.guest_symbols import GuestSymbols
from kilotwin.errors import InputError
from kilotwin.experiment.programs import ProgramError, find_program
from kilotwin.files.drafts import draft_of


def build_program(
    program: Sequence[str],
    include: Sequence[str],
    define: Sequence[str],
    output: Path | None,
    notify: Notify,
) -> dict[str, Any]:
    """What --json prints. The guest stays in the cache; `output` gets a copy."""
    try:
        found = find_program(program, Path.cwd(), include, define)
    except ProgramError as error:
        raise InputError(str(error)) from None
    guest = build(found, notify)
    size = GuestSymbols(guest.file).size
    file = guest.file
    if output is not None:
        try:
            with draft_of(output) as draft:
                shutil.copyfile(guest.file, draft)
            file = output
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise InputError(f"-o {output}: {reason}; name another file") from None
    return {
        "program": guest.name,
        "sources": [str(source) for source in found.sources],
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
        f"  state {report['state_bytes']:7,} bytes per robot (variables, with those of the API)\n"
        f"  text  {report['text_bytes']:7,} bytes of code for this PC"
    )
