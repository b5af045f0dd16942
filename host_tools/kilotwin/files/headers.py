"""Numbers that C and Python share, read from the header that owns each of them."""

import re
from functools import cache

from kilotwin.errors import KilotwinError
from kilotwin.files import resources

_DIMENSIONS = "kilogrid_modules/protocol/dimensions.h"
_TRANSFER = "kilogrid_modules/protocol/transfer.h"
_IMAGE_STORE = "firmware/bootloader/core/image_store.h"
_ROBOT_QUERY = "firmware/kilolib/core/robot_query.h"
_GAINS = "firmware/kilolib/core/gains.h"


_NUMBER = re.compile(r"^#define (\w+) (\d+|0x[0-9A-Fa-f]+)U?L?\b", re.MULTILINE)


@cache
def _numbers(header: str) -> dict[str, str]:
    return dict(_NUMBER.findall(resources.path(header).read_text()))


def number_of(header: str, macro: str) -> int:
    """The value of `#define macro` in a header of ours; KilotwinError if there is none."""
    found = _numbers(header).get(macro)
    if found is None:
        raise KilotwinError(f"{header} has no number {macro}; install kilotwin again")
    return int(found, 0)


CELL_M = number_of(_DIMENSIONS, "KILOGRID_CELL_MM") / 1000
"""Width of a Kilogrid's cell."""

MODULE_M = 2 * CELL_M
"""Width of its modules, of 2 x 2 cells."""

CELLS_PER_MODULE = number_of(_DIMENSIONS, "KILOGRID_MODULE_CELLS")
MOST_COLUMNS = number_of(_DIMENSIONS, "KILOGRID_MOST_COLUMNS")
MOST_PER_BUS = number_of(_DIMENSIONS, "KILOGRID_MOST_MODULES_PER_BUS")
"""Modules on one bus."""

CAN_BIT_RATE = number_of(_DIMENSIONS, "KILOGRID_CAN_BIT_RATE")
"""Bit rate of a Kilogrid's buses, 1/s."""

PAGE_BYTES = number_of(_TRANSFER, "TRANSFER_PAGE_BYTES")
"""A page of the chip's flash, which is erased and written at once."""

PAGES = number_of(_TRANSFER, "TRANSFER_PAGES")
"""Most pages of a program: those below the boot section."""

BOOT_IDENTITY = number_of(_IMAGE_STORE, "BOOT_QUERY_IDENTITY")
"""In place of the first page of a question to boot loaders: the id of the image."""

PAGES_PER_REPORT = number_of(_IMAGE_STORE, "BOOT_REPORT_PAGES")
"""Pages that one answer is about, from the asked one on."""

FRAGMENT_BYTES = number_of(_IMAGE_STORE, "BOOT_FRAGMENT_BYTES")
"""Bytes of a page in one infrared frame."""

ALL_ROBOTS = number_of(_ROBOT_QUERY, "ROBOT_QUERY_ALL")
"""The uid of a question to all robots; also that of a robot which was never given one."""

VITALS = number_of(_ROBOT_QUERY, "ROBOT_QUERY_VITALS")
"""In place of the first page: battery, state, and how strongly another robot was heard."""

GAINS = number_of(_ROBOT_QUERY, "ROBOT_QUERY_GAINS")
"""In place of the first page: an entry of a robot's gain tables, the first of them. Applications
answer questions for VITALS and GAINS only."""

GAIN_ENTRIES = number_of(_GAINS, "GAIN_ENTRIES")
CONTACT_MM = number_of(_GAINS, "GAIN_CONTACT_MM")
"""Distance of a gain table's first entry, centre to centre: robots touch."""
GAIN_SPACING_MM = number_of(_GAINS, "GAIN_SPACING_MM")
GAIN_DISTANCES_MM = tuple(CONTACT_MM + GAIN_SPACING_MM * entry for entry in range(GAIN_ENTRIES))
"""Distances of a gain table's entries: centre to centre, from contact on."""
MOST_READING = number_of(_GAINS, "CONVERTER_MOST")
"""The highest reading of a chip's converter."""

MOST_SLOTS_LOG2 = number_of(_ROBOT_QUERY, "ROBOT_QUERY_MOST_SLOTS")
"""Slots of a question are 2 to this power at most."""

IN_PROGRAM = number_of(_ROBOT_QUERY, "ROBOT_REPORT_IN_PROGRAM")
"""States of an answer from here on are those of an application, so much more."""

QUERY_TYPES = {
    name: number_of(_ROBOT_QUERY, f"BOOTPGM_{name}") for name in ("CRC", "QUERY", "REPORT", "START")
}
"""Types of the infrared messages between host and boot loaders that are ours."""
