"""Files that faults are planted in, and the tests that are to find them."""

from dataclasses import dataclass
from pathlib import Path

RUNTIME = "kilogrid_modules/runtime/core"
LOADER = "firmware/bootloader/core"
CHANNEL = "emulator/infrared"
CONTACT = "emulator/physics/contact"
GOLDEN_RUN = "golden_run"
"""Prints a hash of whole runs, GOLDEN_HASH."""
GOLDEN_HASH = (Path(__file__).parents[1] / "native/golden/hash.txt").read_text().strip()


@dataclass(frozen=True)
class Target:
    """A file and its tests: native `programs` with each of `arguments` in turn, or pytest."""

    group: str
    file: str
    programs: tuple[str, ...]  # of the native tests; empty: pytest
    arguments: tuple[str, ...] = ("",)


def _cores() -> list[Target]:
    """The programs of tests for each pure core."""
    found = []
    for name in ("exponential", "leave", "neighbours", "params", "random", "tracking", "walk"):
        tests = f"firmware_test_{name} firmware_test_pfsm firmware_test_aggregation"
        found.append((f"firmware/aggregation/{name}.c", tests))
    pfsm = "firmware_test_pfsm firmware_test_pfsm_leave"
    found.append(("firmware/aggregation/pfsm.c", pfsm))
    for name in ("calibration", "gains", "message_crc", "robot_answer", "robot_commands"):
        found.append((f"firmware/kilolib/core/{name}.c", f"kilolib_core_test_{name}"))
    for name in ("boot_messages", "image_record", "image_store"):
        tests = f"bootloader_test_{name} bootloader_test_image_store bootloader_test_power_cuts"
        found.append((f"{LOADER}/{name}.c", tests))
    found.append(("kilogrid_modules/bootloader/core/boot_frames.c", "bootloader_test_boot_frames"))
    for name in ("answers", "bursts", "light_patterns", "orders", "robot_reports"):
        found.append((f"{RUNTIME}/{name}.c", f"module_runtime_test_{name}"))
    for name in ("address", "transfer"):
        found.append((f"kilogrid_modules/protocol/{name}.c", f"protocol_test_{name}"))
    found.append(("kilogrid_modules/sites/cell.c", "firmware_test_cell"))
    return [Target("cores", file, tuple(programs.split())) for file, programs in found]


def _engine(group: str, folder: str, tests: dict[str, str]) -> list[Target]:
    """Files of the engine, each with the sources of its tests, the likely ones first."""
    return [
        Target(
            group,
            f"{folder}/{file}",
            ("emulator_tests", GOLDEN_RUN),
            tuple(f"--source-file=*test_{name}.cpp" for name in names.split()),
        )
        for file, names in tests.items()
    ]


_HOST = "host_tools/kilotwin"


def _python(group: str, tests: dict[str, str]) -> list[Target]:
    return [
        Target(group, f"{_HOST}/{file}", (), tuple(f"tests/{name}" for name in names.split()))
        for file, names in tests.items()
    ]


_ON_AIR = "kilobot_channel busy_channel messages run_ahead cells overhead_light beacons result_hash"
_TOUCHING = "box2d_solver contacts walls crowd objects"

TARGETS = [
    *_cores(),
    *_engine(
        "channel",
        CHANNEL,
        {
            "carrier_sense.cpp": f"frames_in_flight {_ON_AIR}",
            "carrier_sense.h": f"frames_in_flight {_ON_AIR}",
            "frames_in_flight.cpp": f"frames_in_flight {_ON_AIR}",
            "guest_robots.cpp": f"{_ON_AIR} time commands",
            "ideal_channel.cpp": f"messages run_ahead receivers_in_range {_ON_AIR}",
            "kilobot_channel.cpp": _ON_AIR,
            "tentative_runs.cpp": "run_ahead",
            "receivers_in_range.cpp": "receivers_in_range messages run_ahead",
        },
    ),
    *_engine(
        "contact",
        CONTACT,
        {
            "box2d_solver.cpp": _TOUCHING,
            "disc_solver.cpp": _TOUCHING,
            "island_solver.cpp": _TOUCHING,
            "closed_form.cpp": _TOUCHING,
            "contacts.cpp": f"{_TOUCHING} grouping",
            "grouping.cpp": f"grouping {_TOUCHING}",
            "mechanics.cpp": f"mechanics {_TOUCHING}",
        },
    ),
    *_python(
        "writers",
        {
            "table/grid/can_log.py": "unit/grid/test_can_log.py",
            "table/grid/kilodat.py": "unit/grid/test_kilodat.py",
            "runs/folder.py": "unit/runs/test_folder.py",
            "runs/prints.py": "unit/runs/test_prints.py",
            "runs/writer.py": "unit/runs/test_folder.py",
        },
    ),
    *_python(
        "sweeps",
        {
            "studies/sweep/data_set.py": "unit/sweep/test_data_set.py",
            "studies/sweep/parts.py": "unit/pool/test_series.py unit/sweep/test_data_set.py",
            "studies/sweep/runner.py": "unit/sweep/test_data_set.py system/test_sweep.py",
        },
    ),
]


def missing(root: Path) -> list[str]:
    """Files of the list that are not in the tree."""
    return [target.file for target in TARGETS if not (root / target.file).is_file()]
