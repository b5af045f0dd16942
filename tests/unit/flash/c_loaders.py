"""Modules that are in their boot loaders, each with the loader's own code (loaders.c)."""

import ctypes
import subprocess
from pathlib import Path

from kilotwin.experiment.spec.grid_layout import Layout, Module
from kilotwin.files import resources
from kilotwin.programs.image.flags import avr_words
from kilotwin.table.grid.cover import Group

ROOT = Path(__file__).parents[3]
SOURCES = [
    Path(__file__).with_name("loaders.c"),
    ROOT / "kilogrid_modules/bootloader/core/boot_frames.c",
    *(ROOT / f"firmware/bootloader/core/{name}.c" for name in ("image_record", "image_store")),
]
INCLUDES = [
    ROOT,
    ROOT / "kilogrid_modules/protocol",
    resources.made(),
    ROOT / "kilogrid_modules/runtime/include",
    ROOT / "firmware/kilogrid/include",
    ROOT / "firmware/kilolib/include",
]
DIALECT = [word for word in avr_words("AVR_DIALECT") if word != "-funsigned-bitfields"]
FLASH_BYTES = 0x7000


def compiled(folder: Path) -> ctypes.CDLL:
    """The library of loaders.c."""
    library = folder / "libloaders.so"
    options = [*DIALECT, "-O2", "-shared", "-fPIC", "-o", str(library)]
    options += [f"-I{include}" for include in INCLUDES]
    subprocess.run(["cc", *options, *map(str, SOURCES)], check=True)
    loaded = ctypes.CDLL(str(library))
    loaded.loader_bytes.restype = ctypes.c_size_t
    loaded.loader_answers.restype = ctypes.c_bool
    loaded.loader_flash.restype = ctypes.POINTER(ctypes.c_uint8)
    return loaded


class Loaders:
    """All modules of a grid; each frame is lost to each of them, and each answer, with `loss`."""

    def __init__(self, library: ctypes.CDLL, layout: Layout, loss: float, seed: int = 1) -> None:
        self._library, self._layout = library, layout
        self._places = list(layout.modules())
        self._number = {place: number for number, place in enumerate(self._places)}
        self._bytes = library.loader_bytes()
        self._memory = ctypes.create_string_buffer(self._bytes * len(self._places))
        self._lost = round(loss * 65536)
        library.loaders_begin(self._memory, len(self._places), seed)

    def receive(self, bus: int, group: Group, data: bytes) -> list[tuple[Module, bytes]]:
        """Answers to a frame for one module, a row or a whole bus."""
        here = self._layout.modules_of(bus)
        first, last = self._number[here[0]], self._number[here[-1]]
        if group.x is not None and group.y is not None:
            first = last = self._number[group.x, group.y]
        elif group.y is not None:
            first, last = self._number[0, group.y], self._number[here[-1][0], group.y]
        self._library.loaders_take(self._memory, first, last, data, len(data), self._lost)
        answers = []
        answer = ctypes.create_string_buffer(8)
        for number in range(first, last + 1) if data[0] == 0x17 else ():
            if self._library.loader_answers(self._at(number), answer, self._lost):
                answers.append((self._places[number], answer.raw))
        return answers

    def flash(self, place: Module) -> bytes:
        """Content of a module's chip below its boot section."""
        return bytes(self._library.loader_flash(self._at(self._number[place]))[:FLASH_BYTES])

    def _at(self, number: int) -> ctypes.c_void_p:
        return ctypes.c_void_p(ctypes.addressof(self._memory) + number * self._bytes)
