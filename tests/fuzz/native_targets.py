"""Decoders in C and C++, under libFuzzer with ASan and UBSan."""

import itertools
import os
import re
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kilotwin.files import resources
from kilotwin.files.flash_image import FlashImage
from kilotwin.table.can import transfer

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PROTOCOL = ROOT / "kilogrid_modules/protocol"
EMULATOR = ROOT / "emulator"
FIRMWARE = ROOT / "firmware"
SANITIZERS = ["-g", "-O1", "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"]
C_DIALECT = ["-std=gnu99", "-fshort-enums", "-funsigned-char"]
INCLUDES = [f"-I{EMULATOR}", f"-I{FIRMWARE}", f"-I{FIRMWARE / 'kilolib/include'}"]


@dataclass(frozen=True)
class NativeTarget:
    """A decoder's fuzzer: its sources, and inputs to begin with."""

    compiler: tuple[str, ...]
    sources: tuple[Path, ...]
    longest: int
    seeds: Callable[[], list[bytes]]


def module_seeds() -> list[bytes]:
    """Whole transfers as the host sends them, each frame after its length."""
    transfers = (
        transfer.configuration(bytes(range(48))),
        transfer.infrared(bytes(range(9)), 0x88),
        list(transfer.kilobot_program(FlashImage(bytes(range(200))))),
        list(transfer.kilobot_program(bytes(range(200)))),
        list(transfer.module_program(bytes(range(200)))),
        list(transfer.module_program(bytes(range(200)), old_loader=False)),
    )
    return [b"".join(bytes([len(f.data)]) + f.data for f in frames) for frames in transfers]


def socketcand_seeds() -> list[bytes]:
    """A client that says all that there is to say."""
    return [b"\x05< open can0 >< rawmode >< send 7FF 3 1 AB ff >< echo >< bcmmode >"]


def infrared_seeds() -> list[bytes]:
    """The edges of a frame of zeros and ones, and an announcement with a page behind it."""
    slot, byte = 269, b""
    for value in (0, *range(0, 240, 20)):
        slots = [0, *(1 + bit for bit in range(8) if value >> bit & 1), 9, 10]
        steps = [(b - a) * slot for a, b in itertools.pairwise(slots)]
        byte += b"".join(step.to_bytes(2, "little") for step in steps)
    page = b"".join(bytes([0, i, *range(i, i + 6), 0, 0x87]) for i in range(22))
    orders = b"".join(bytes([*range(9), 0x80 + kind]) for kind in range(16))
    return [b"\0\0" + byte, b"\1" + bytes([1, *range(8), 0x86]) + page, b"\1" + orders]


def image_seeds() -> list[bytes]:
    """A hex file, and the smallest ELF executable with a segment and a table of symbols."""
    hex_file = b":020000021000EC\n:04000000940C0034EC\n:0400040001020304EE\n:00000001FF\n"
    ident = b"\x7fELF\1\1\1" + bytes(9)
    header = ident + bytes.fromhex("0200530001000000000000003400000054000000000000003400")
    header += bytes.fromhex("200001002800020000000000")[: 52 - len(header)]
    segment = b"".join(n.to_bytes(4, "little") for n in (1, 0, 0, 0, 52, 52, 5, 1))
    sections = bytes(4) + (2).to_bytes(4, "little") + bytes(72)
    return [hex_file, header.ljust(52, b"\0") + segment + sections]


def programmer_seeds() -> list[bytes]:
    """The commands of AVR068 that avrdude uses, framed and not."""
    bodies = [bytes([kind]) + bytes(12) for kind in (1, 2, 3, 6, 0x10, 0x11, 0x13, 0x14, 0x1D)]
    pieces = b"".join(bytes([len(body)]) + body for body in bodies)
    return [b"\1" + pieces, b"\0" + b"\x07\x1b\1\0\1\x0e\1\x14"]


def _c(*options: str) -> tuple[str, ...]:
    return ("clang", *SANITIZERS, *C_DIALECT, *options)


def _cpp() -> tuple[str, ...]:
    return ("clang++", *SANITIZERS, "-std=c++20", *INCLUDES)


_STORE = tuple(FIRMWARE / f"bootloader/core/{name}.c" for name in ("image_store", "image_record"))
_CRC = FIRMWARE / "kilolib/core/message_crc.c"
_CHIP = EMULATOR / "avr/chip"
_FRAMES = (f"-I{PROTOCOL}", f"-I{resources.made()}")

NATIVE = {
    "module": NativeTarget(
        _c("-fpack-struct", *_FRAMES),
        (
            HERE / "fuzz_module.c",
            *(PROTOCOL / f"{name}.c" for name in ("address", "transfer")),
            resources.made() / "kilogrid_can.c",
        ),
        4096,
        module_seeds,
    ),
    "module-loader": NativeTarget(
        _c(*INCLUDES, *_FRAMES),
        (
            HERE / "fuzz_module_loader.c",
            ROOT / "kilogrid_modules/bootloader/core/boot_frames.c",
            *_STORE,
            _CRC,
        ),
        2048,
        module_seeds,
    ),
    "infrared": NativeTarget(
        _c(*INCLUDES),
        (
            HERE / "fuzz_infrared.c",
            FIRMWARE / "bootloader/core/boot_messages.c",
            *_STORE,
            _CRC,
            FIRMWARE / "kilolib/core/robot_commands.c",
            FIRMWARE / "kilolib/core/robot_answer.c",
        ),
        2048,
        infrared_seeds,
    ),
    "socketcand": NativeTarget(
        _cpp(),
        (HERE / "fuzz_socketcand.cpp", EMULATOR / "grid/socketcand.cpp"),
        512,
        socketcand_seeds,
    ),
    "flash-image": NativeTarget(
        _cpp(), (HERE / "fuzz_flash_image.cpp", _CHIP / "flash_image.cpp"), 2048, image_seeds
    ),
    "programmer": NativeTarget(
        _cpp(),
        (
            HERE / "fuzz_programmer.cpp",
            EMULATOR / "avr/boards/stk500v2.cpp",
            _CHIP / "serial_programming.cpp",
        ),
        2048,
        programmer_seeds,
    ),
}


def build(name: str, folder: Path) -> Path:
    """Compiles a target; returns the program."""
    target, program = NATIVE[name], folder / name
    command = [*target.compiler, "-o", program, *target.sources]
    subprocess.run(list(map(str, command)), check=True)
    return program


def run(program: Path, corpus: Path, limits: list[str], longest: int) -> int:
    """Runs it until a limit, options of libFuzzer; how many inputs. Raises on a finding."""
    options = [*limits, f"-max_len={longest}", "-seed=1", "-print_final_stats=1", "-timeout=20"]
    # Leaks are looked for by other means: that search needs a right that containers lack.
    done = subprocess.run(
        [str(program), *options, str(corpus)],
        cwd=program.parent,
        env={**os.environ, "ASAN_OPTIONS": "detect_leaks=0"},
        capture_output=True,
        text=True,
        check=False,
    )
    counted = re.search(r"stat::number_of_executed_units:\s*(\d+)", done.stderr)
    assert done.returncode == 0, done.stderr[-4000:]
    assert counted, done.stderr[-4000:]
    return int(counted[1])
