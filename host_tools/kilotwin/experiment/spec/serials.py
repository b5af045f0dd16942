"""Lists of robots' serial numbers: `grid.kilobot_ids` of an experiment."""

import re
from pathlib import Path

from kilotwin.errors import InputError


def read_serials(file: Path) -> dict[int, str]:
    """A `kilobot_ids` file: a serial and an id per line; serials by the id's low 7 bits.

    A serial is any word, as 2066/3 or 01087. The lab's file begins with a header, a line without a
    number.
    """
    serials: dict[int, str] = {}
    begun = False
    try:
        lines = file.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read ({error}); name a list of robots") from None
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        header = not begun and not re.search(r"(?<!\w)\d", line)
        begun = True
        if header:
            continue
        try:
            serial, written = line.split()
            robot = int(written)
        except ValueError:
            what = f"'{line}' is not a serial and an id, with a tab between them"
            raise InputError(f"{file}:{number}: {what}") from None
        if serials.setdefault(robot & 0x7F, serial) != serial:
            what = f"id {robot} has the low 7 bits of another robot; a .kilodat tells 128 apart"
            raise InputError(f"{file}:{number}: {what}")
    return serials
