"""Where the engine meets a robot's program that runs translated: addresses of its runtime's
functions and variables, from the symbols of the linked image.

What the engine does there is emulator/robots/translated/robot.h.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import Symbol, SymbolTableSection

from kilotwin.errors import InputError
from kilotwin.programs.translate.registers import Function

# Functions that are the engine's, in the order of CALL_SEND and its fellows.
_CALLS = (
    "kilolib_infrared_send",
    "kilolib_infrared_receiving",
    "kilolib_infrared_frame_began",
    "kilolib_converter_read",
    "estimate_distance",
)
RARE = (
    "kilo_init",
    "kilolib_clock_init",
    "kilolib_clock_stop",
    "kilolib_converter_init",
    "kilolib_converter_stop",
    "kilolib_converter_sample_on_edge",
    "kilolib_converter_sampled",
    "kilolib_infrared_receive_init",
    "kilolib_infrared_receive_stop",
    "kilolib_infrared_send_init",
    "kilolib_infrared_send_frame",
    "kilolib_motors_init",
    "kilolib_motors_on",
    "kilolib_motors_off",
    "kilolib_power_on",
    "kilolib_power_off",
    "kilolib_calibration_load",
    "kilolib_calibration_save",
    "place_of",
    "crc_of",
    "finish",
    "kilolib_command_obey",
    "robot_obey",
    "kilolib_sleep_for_8_s",
    "__vector_11",
    "__vector_23",
)
"""Functions of a robot's runtime that run at power-up, at a command, or in no guest, since the
engine stands for them. They are not translated: a small program's translation would take 3.7 times
as long with them."""
_NEEDED = ("kilo_ticks", "kilo_tx_period", "kilolib_robot", "kilo_message_rx", "kilo_start")
_RECEIVER = "infrared_receive.c"
_MESSAGE_IN_READER = 6  # offset in infrared_reader_t
_DATA_MASK, _DATA = 0xFFFF, 0x800000  # addresses in data space, kept apart by a higher bit


@dataclass(frozen=True)
class Seam:
    """Byte addresses; 0 for what the program has not."""

    calls: tuple[int, ...]
    """Functions that are the engine's, by their number."""
    obey: int
    robot: int
    heard: int
    ticks: int
    tx_period: int
    message: int
    distance: int
    message_rx: int
    variables_end: int
    """Behind the last one."""
    names_period: bool
    """Whether the program has to do with kilo_tx_period itself."""
    original: bool
    """Whether its runtime has the traits of the published one."""
    main_loop: tuple[int, int]
    """Begin of kilo_start(), and the address behind it."""
    delay: tuple[int, int]
    """Likewise of delay(); (0, 0): the program has none."""
    functions: tuple[int, ...]
    """The program's own."""
    variables: tuple[tuple[int, int], ...]
    """Likewise: addresses and sizes of those that are one number of 1, 2 or 4 bytes, maybe."""
    objects: tuple[tuple[int, int], ...]
    """Likewise of all its own variables, of any size."""
    rare: tuple[tuple[int, int], ...]
    """Extents of functions of RARE, which the interpreter executes."""

    def text(self) -> str:
        """C of the structure translated_seam_t."""
        numbers = [self.obey, self.robot, self.heard, self.ticks, self.tx_period]
        numbers += [self.message, self.distance, self.message_rx, self.variables_end]
        numbers += [int(self.names_period), int(self.original)]
        calls = ", ".join(map(str, self.calls))
        return f"{{{{{calls}}}, {', '.join(map(str, numbers))}}}"


def seam_of(elf: Path, object_files: Sequence[Path], *, original: bool = False) -> Seam:
    """The seam of a linked robot's program, of which `object_files` are the program's own."""
    with elf.open("rb") as file:
        symbols = list(_symbols(ELFFile(file)))
    everywhere = {symbol.name: symbol for _, symbol in symbols if _is_global(symbol)}
    own = {symbol.name: symbol for source, symbol in symbols if source == _RECEIVER}
    missing = [name for name in _NEEDED if name not in everywhere]
    if missing:
        raise InputError(
            f'{elf.stem} does not use {missing[0]}: cpu = "translated" is for programs that call '
            'kilo_init() and kilo_start(); write cpu = "avr", or "native"'
        )
    is_own = _is_own(object_files)
    objects = _objects(symbols, is_own)
    functions = sorted(
        int(symbol["st_value"])
        for source, symbol in symbols
        if symbol["st_info"]["type"] == "STT_FUNC" and is_own(source, symbol)
    )
    return Seam(
        calls=tuple(_address(everywhere, name) for name in _CALLS),
        obey=_address(everywhere, "kilolib_command_obey"),
        robot=_address(everywhere, "kilolib_robot"),
        heard=_address(everywhere, "kilolib_heard"),
        ticks=_address(everywhere, "kilo_ticks"),
        tx_period=_address(everywhere, "kilo_tx_period"),
        message=_address(own, "reader") + _MESSAGE_IN_READER,
        distance=_address(own, "distance"),
        message_rx=_address(everywhere, "kilo_message_rx"),
        variables_end=_address(everywhere, "__bss_end"),
        names_period=any(_names(file, "kilo_tx_period") for file in object_files),
        original=original,
        main_loop=_extent(everywhere, "kilo_start"),
        delay=_extent(everywhere, "delay"),
        functions=tuple(functions),
        variables=tuple(one for one in objects if one[1] in (1, 2, 4)),
        objects=tuple(objects),
        rare=tuple(_rare(symbols, functions)),
    )


def _symbols(elf: ELFFile) -> Iterator[tuple[str, Symbol]]:
    """All symbols, each with the source file that it is in if only that knows it."""
    table = elf.get_section_by_name(".symtab")
    assert isinstance(table, SymbolTableSection)
    source = ""
    for symbol in table.iter_symbols():
        if symbol["st_info"]["type"] == "STT_FILE":
            source = symbol.name
        yield source if symbol["st_info"]["bind"] == "STB_LOCAL" else "", symbol


def _is_global(symbol: Symbol) -> bool:
    return bool(symbol["st_info"]["bind"] == "STB_GLOBAL" and symbol["st_shndx"] != "SHN_UNDEF")


def _address(symbols: Mapping[str, Symbol], name: str) -> int:
    return int(symbols[name]["st_value"]) & _DATA_MASK if name in symbols else 0


def _extent(symbols: Mapping[str, Symbol], name: str) -> tuple[int, int]:
    begin = _address(symbols, name)
    return begin, begin + (int(symbols[name]["st_size"]) if name in symbols else 0)


def _names(file: Path, name: str) -> bool:
    with file.open("rb") as opened:
        return any(symbol.name == name for _, symbol in _symbols(ELFFile(opened)))


def _is_own(objects: Sequence[Path]) -> Callable[[str, Symbol], bool]:
    """Whether a symbol, with its source as of _symbols(), is of one of these objects."""
    sources: set[str] = set()
    names: set[str] = set()
    for object_file in objects:
        with object_file.open("rb") as file:
            for source, symbol in _symbols(ELFFile(file)):
                sources.add(source)
                if _is_global(symbol):
                    names.add(symbol.name)
    sources.discard("")
    return lambda source, symbol: source in sources or (_is_global(symbol) and symbol.name in names)


def _objects(
    symbols: Sequence[tuple[str, Symbol]], is_own: Callable[[str, Symbol], bool]
) -> list[tuple[int, int]]:
    return sorted(
        (int(symbol["st_value"]) & _DATA_MASK, int(symbol["st_size"]))
        for source, symbol in symbols
        if symbol["st_info"]["type"] == "STT_OBJECT"
        and symbol["st_size"] > 0
        and symbol["st_value"] & ~_DATA_MASK == _DATA
        and is_own(source, symbol)
    )


def compiled_functions(elf: Path) -> list[Function]:
    """Those of a linked image that are C, by its debug information, which takes some time to read.

    The code says the same of itself, so that two images with the same code may share these.
    """
    functions: list[Function] = []
    with elf.open("rb") as file:
        for unit in ELFFile(file).get_dwarf_info().iter_CUs():
            for die in unit.get_top_DIE().iter_children():
                if die.tag != "DW_TAG_subprogram" or "DW_AT_high_pc" not in die.attributes:
                    continue
                begin, end = (
                    die.attributes[f"DW_AT_{which}_pc"].value for which in ("low", "high")
                )
                declared = die
                if "DW_AT_abstract_origin" in die.attributes:
                    declared = die.get_DIE_from_attribute("DW_AT_abstract_origin")
                functions.append(Function(begin, end, "DW_AT_type" in declared.attributes))
    return sorted(functions, key=lambda function: function.begin)


@dataclass(frozen=True)
class Named:
    """A function or a variable of a linked image, by byte addresses: [begin, end). `own`: it is the
    program's, not its runtime's."""

    name: str
    begin: int
    end: int
    own: bool


def functions_and_variables(elf: Path, objects: Sequence[Path]) -> tuple[list[Named], list[Named]]:
    """Those of a linked image, in order of addresses; `objects` are the program's own. Variables
    that are static in a function have its compiler's number behind their names there; not here."""
    with elf.open("rb") as file:
        symbols = list(_symbols(ELFFile(file)))
    is_own = _is_own(objects)
    found: dict[str, list[Named]] = {"STT_FUNC": [], "STT_OBJECT": []}
    for source, symbol in symbols:
        kind, value, size = symbol["st_info"]["type"], int(symbol["st_value"]), symbol["st_size"]
        if kind not in found or not size or (kind == "STT_OBJECT") != (value & _DATA != 0):
            continue
        begin = value & _DATA_MASK
        name = symbol.name.split(".")[0]
        found[kind].append(Named(name, begin, begin + int(size), is_own(source, symbol)))
    by_place = [sorted(some, key=lambda one: one.begin) for some in found.values()]
    return by_place[0], by_place[1]


def own_extents(elf: Path, objects: Sequence[Path]) -> list[tuple[int, int]]:
    """Begin and end of each function of the program's own, of a linked image and its objects."""
    with elf.open("rb") as file:
        symbols = list(_symbols(ELFFile(file)))
    is_own = _is_own(objects)
    return sorted(
        (int(symbol["st_value"]), int(symbol["st_value"]) + int(symbol["st_size"]))
        for source, symbol in symbols
        if symbol["st_info"]["type"] == "STT_FUNC" and is_own(source, symbol)
    )


def _rare(symbols: Sequence[tuple[str, Symbol]], own: Sequence[int]) -> Iterator[tuple[int, int]]:
    """A program may have functions of these names itself, which are none of them."""
    for _, symbol in symbols:
        begin = int(symbol["st_value"])
        if symbol.name in RARE and symbol["st_info"]["type"] == "STT_FUNC" and begin not in own:
            yield begin, begin + int(symbol["st_size"])
