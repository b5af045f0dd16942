"""Lists of robots' serial numbers: `grid.kilobot_ids` of an experiment."""

from pathlib import Path

from kilotwin.errors import InputError


def read_serials(file: Path) -> dict[int, int]:
    """A `kilobot_ids` file: a serial and an id per line; serials by the id's low 7 bits."""
    serials: dict[int, int] = {}
    try:
        lines = file.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{file}: cannot be read ({error}); name a list of robots") from None
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            serial, robot = (int(word) for word in line.split())
        except ValueError:
            what = f"'{line}' is not a serial and an id, with a tab between them"
            raise InputError(f"{file}:{number}: {what}") from None
        if serials.setdefault(robot & 0x7F, serial) != serial:
            what = f"id {robot} has the low 7 bits of another robot; a .kilodat tells 128 apart"
            raise InputError(f"{file}:{number}: {what}")
    return serials
