"""The long tests in pieces of an hour at most, each with a name.

A test belongs to the first piece whose selectors its id begins with. A selector is the begin of a
pytest id.
"""

from dataclasses import dataclass

from tests.fuzz.run import NAMES as FUZZED

_FAULTS = "tests/soak/test_grid_faults.py"
_FUZZ = "tests/fuzz/test_fuzz.py::test_no_input_breaks_it_in_a_long_run"


@dataclass(frozen=True)
class Piece:
    """Tests that run together. `minutes` is about what they take on two cores."""

    shows: str
    selectors: tuple[str, ...]
    minutes: int


PIECES = {
    "bare": Piece(
        "README's two commands pass on a bare Debian 12, by root and by a user without sudo",
        ("tests/system/test_bare.py",),
        40,
    ),
    "conformance": Piece(
        "controllers and examples decide as on the chip, for hours",
        ("tests/conformance/test_conformance.py",),
        30,
    ),
    "mixed-swarm": Piece(
        "a swarm of chips and native robots is one swarm for ten minutes",
        ("tests/conformance/test_mixed_swarm.py",),
        30,
    ),
    "instructions": Piece(
        "each instruction, translated, from 10^5 states",
        ("tests/translation/test_instructions.py",),
        30,
    ),
    "translated-chips": Piece(
        "translated chips do as interpreted ones for 10^6 ticks",
        ("tests/translation/test_programs.py",),
        60,
    ),
    "translated-robots": Piece(
        "60 programs in the styles of published ones decide translated as on the chip",
        (
            "tests/translation/test_guests.py",
            "tests/translation/test_known_passes.py",
            "tests/translation/test_two_compilers.py",
        ),
        20,
    ),
    "optimise": Piece(
        "a search finds what a whole grid of trials finds, with a tenth of them",
        ("tests/system/test_optimise.py",),
        10,
    ),
    "hunt": Piece(
        "ten planted bugs are found, shrunk to three robots and 30 s, and fail each time",
        ("tests/hunt/test_planted.py",),
        60,
    ),
    "testing": Piece(
        "tests of a lab by the pytest plugin pass from the .hex too",
        ("tests/unit/testing/test_plugin.py",),
        2,
    ),
    "new-lab": Piece(
        "a new repository's CI steps are green, and each of ten planted faults is named",
        ("tests/system/test_new_lab.py",),
        10,
    ),
    "site": Piece(
        "the documentation site builds strictly and loads nothing from elsewhere; its sweep runs",
        ("tests/system/test_site.py", "tests/system/test_blocks.py"),
        2,
    ),
    "metrics": Piece(
        "every command of docs/metrics.md runs", ("tests/system/test_metrics.py",), 10
    ),
    "paper-table": Piece(
        "the paper's numbers for N = 50 come out as docs/reproduce.md has them",
        ("tests/system/test_paper_table.py",),
        20,
    ),
    "kill": Piece(
        "the paper's whole grid survives kills at random moments; so does a Dask worker's death",
        ("tests/system/test_sweep.py",),
        60,
    ),
    "walls": Piece(
        "nothing passes a wall in 10^8 robot-steps; crowds and busy channels as by brute force",
        ("tests/system/test_obstacles.py",),
        40,
    ),
    "same-engine": Piece(
        "every build of the engine gives the same",
        ("tests/system/test_same_engine.py", "tests/same/test_same.py"),
        40,
    ),
    "flash": Piece(
        "replacements after power cuts; 50 robots with a fifth of the frames lost",
        (
            "tests/system/test_robot_loader.py",
            "tests/system/test_flash_swarm.py",
            "tests/system/test_flash_modules.py",
        ),
        40,
    ),
    "calibrate": Piece(
        "fifty robots calibrated go straighter and tell distances better",
        ("tests/system/test_calibrate.py",),
        40,
    ),
    "grid": Piece(
        "a grid is checked, a grid of chips runs a .hex; an hour of the full grid is as logs say",
        (
            "tests/system/test_grid_boards.py",
            "tests/system/test_grid_check.py",
            "tests/unit/truth/",
        ),
        60,
    ),
    "viewer": Piece(
        "a browser that reads nothing changes nothing; motors, batteries and messages are recorded "
        "alike of native robots, translated ones and chips",
        ("tests/system/test_view_live.py", "tests/system/test_record_keys.py"),
        5,
    ),
    "socketcan": Piece(
        "a table on SocketCAN, in User-Mode Linux or this kernel", ("tests/socketcan/",), 20
    ),
    "bus-off": Piece(
        "after each of 100 bus-offs a module's frames are back within a second, native and chips",
        (f"{_FAULTS}::test_after_each_of_100_bus_offs_a_module_is_back_within_a_second",),
        10,
    ),
    "resets": Piece(
        "200 modules, each reset once in an hour, lose nothing but what is said",
        (f"{_FAULTS}::test_200_modules_that_are_reset_once_each_lose_nothing_but_what_is_said",),
        20,
    ),
    "bus-day": Piece(
        "a full bus loses no frame in 24 hours, with flat memory",
        ("tests/soak/test_bus_day.py",),
        5,
    ),
    **{
        f"fuzz-{name}": Piece(f"the decoder {name} takes any bytes", (f"{_FUZZ}[{name}]",), 30)
        for name in FUZZED
    },
}


def piece_of(test: str) -> str | None:
    """The piece that a test's id belongs to."""
    for name, piece in PIECES.items():
        if test.startswith(piece.selectors):
            return name
    return None
