"""Numbers that C and Python share, read from the header that owns each of them."""

import re
from functools import cache

from kilotwin.errors import KilotwinError
from kilotwin.files import resources

_DIMENSIONS = "kilogrid_modules/protocol/dimensions.h"
_TRANSFER = "kilogrid_modules/protocol/transfer.h"


@cache
def _text(header: str) -> str:
    return resources.path(header).read_text()


def number_of(header: str, macro: str) -> int:
    """The value of `#define macro` in a header of ours; KilotwinError if there is none."""
    found = re.search(rf"^#define {macro} (\d+|0x[0-9A-Fa-f]+)U?L?\b", _text(header), re.MULTILINE)
    if found is None:
        raise KilotwinError(f"{header} has no number {macro}; install kilotwin again")
    return int(found.group(1), 0)


CELL_M = number_of(_DIMENSIONS, "KILOGRID_CELL_MM") / 1000
"""Width of a Kilogrid's cell."""

MODULE_M = 2 * CELL_M
"""Width of its modules, of 2 x 2 cells."""

CELLS_PER_MODULE = number_of(_DIMENSIONS, "KILOGRID_MODULE_CELLS")
MOST_COLUMNS = number_of(_DIMENSIONS, "KILOGRID_MOST_COLUMNS")
MOST_PER_BUS = number_of(_DIMENSIONS, "KILOGRID_MOST_MODULES_PER_BUS")
"""Modules on one bus."""

CAN_BIT_RATE = number_of(_DIMENSIONS, "KILOGRID_CAN_BIT_RATE")
"""Of a Kilogrid's buses, 1/s."""

PAGE_BYTES = number_of(_TRANSFER, "TRANSFER_PAGE_BYTES")
"""A page of the chip's flash, which is erased and written at once."""

PAGES = number_of(_TRANSFER, "TRANSFER_PAGES")
"""Most pages of a program: those below the boot section."""
