"""docs/wire.md says what the DBC says, and its examples work."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from kilotwin.table.can import address, protocol

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs/wire.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    return TEXT.split(f"## {title}\n")[1].split("\n## ")[0]


def rows(title: str) -> dict[str, int]:
    found = re.findall(r"^\| 0x([0-9A-F]{2}) \| (\w+) \|", section(title), re.MULTILINE)
    return {name: int(number, 16) for number, name in found}


def test_the_tables_have_every_frame_with_its_type() -> None:
    assert rows("Frames to modules") == protocol.types_to_module()
    assert rows("Frames to the host") == protocol.types_to_host()


def test_the_examples_of_addresses_are_right() -> None:
    examples = re.findall(r"`([0-9A-F]{3})` \|$", section("Identifiers are addresses"), re.M)
    addresses = (
        address.ALL_MODULES,
        address.row(0),
        address.column(9),
        address.module(9, 19),
        address.Address(9, 19, address.AddressType.DISPATCHER),
    )
    assert [int(example, 16) for example in examples] == [address.to_id(a) for a in addresses]


def test_frames_that_are_sent_by_cansend_mean_what_the_text_says() -> None:
    sent = re.findall(r"cansend can0 (\w+)#(\w+) +# (.*)", TEXT)
    meant = []
    for identifier, data, text in sent:
        signals = protocol.read_to_module(bytes.fromhex(data))
        to = str(address.from_id(int(identifier, 16)))
        meant.append((to, signals["Type"], text))
    assert meant == [
        ("all modules", "MODULE_RUN", "all modules: run"),
        ("module (0, 0)", "TRACKING_REQ", "poll module (0, 0)"),
    ]


@pytest.mark.parametrize(
    ("line", "meaning"),
    [
        ("can0  515   [8]  D1 07 01 02 03 04 05 06", "ToHost(Type: TRACKING_KILOBOT, Cell: 3"),
        ("can0  040   [8]  0F 00 04 00 00 00 00 00", "MODULE_CONFIG_SIZE, ConfigSize: 4"),
    ],
)
def test_cantools_reads_candumps_lines_with_the_options_named(line: str, meaning: str) -> None:
    options = re.search(r"cantools (decode .*) (kilogrid_modules\S*)", TEXT)
    assert options is not None
    command = [sys.executable, "-m", "cantools", *options[1].split(), str(ROOT / options[2])]
    done = subprocess.run(command, input=f"  {line}\n", capture_output=True, text=True, check=True)
    assert meaning in done.stdout


def test_a_full_frame_has_as_many_bits_as_the_text_says() -> None:
    """44 bits and the data, a quarter of the stuffed part more at the worst, and the pause."""
    plain = 44 + 64 + 3
    worst = plain + (34 + 64 - 1) // 4
    assert f"{plain} to {worst} bits" in TEXT
