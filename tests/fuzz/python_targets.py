"""Decoders in Python: each takes any bytes, or refuses them by the error that callers expect."""

import atexit
import contextlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kilotwin.errors import KilotwinError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.spec import kconf, serials
from kilotwin.experiment.text import ExperimentText, parse_setting
from kilotwin.files import flash_image
from kilotwin.files.build_id import find_build_id
from kilotwin.runs.check import check
from kilotwin.runs.reader import Run
from kilotwin.table.can import address, protocol
from kilotwin.table.environment import poses
from kilotwin.table.grid import kilodat
from kilotwin.table.links import packets
from kilotwin.table.links.robot_link import Report

ROOT = Path(__file__).resolve().parents[2]
Take = Callable[[bytes], None]


@dataclass(frozen=True)
class PythonTarget:
    """A decoder, what to begin with, and words that its inputs have."""

    take: Take
    seeds: Callable[[], list[bytes]]
    words: tuple[bytes, ...] = ()
    longest: int = 1024


def _in_memory() -> Path:
    """A new folder, which goes when the process ends; in memory where the system has that."""
    memory = Path("/dev/shm")
    folder = tempfile.mkdtemp(dir=memory if memory.is_dir() else None, prefix="kilotwin-fuzz-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _file(read: Callable[[Path], object], name: str) -> Take:
    """A decoder of files: each input in a file of the same name."""
    place: list[Path] = []

    def take(data: bytes) -> None:
        if not place:
            place.append(_in_memory() / name)
        file = place[0]
        file.write_bytes(data)
        with contextlib.suppress(KilotwinError):
            read(file)

    return take


def take_frame(data: bytes) -> None:
    """A CAN frame from a module, and one to it: identifier and up to 9 bytes."""
    identifier = int.from_bytes(data[:2], "big")
    with contextlib.suppress(ValueError):
        assert address.to_id(address.from_id(identifier)) == identifier
    frame = data[2:11]
    with contextlib.suppress(protocol.FrameError):
        read = protocol.read_to_host(frame)
        if isinstance(read, protocol.Tracking):
            assert len(read.data) == 7
            assert 0 <= read.cell <= 3
    for readable in (protocol.read_to_module, protocol.signals_to_host):
        with contextlib.suppress(protocol.FrameError):
            assert "Type" in readable(frame)


def take_packets(data: bytes) -> None:
    """The same bytes, whole and cut in two, give the same packets; both sides of the line."""
    at = data[0] if data else 0
    for kind in (packets.ToDevice, packets.FromDispatcher):
        whole, cut = kind(), kind()
        found = whole.take(data)
        assert found == [*cut.take(data[:at]), *cut.take(data[at:])]
        assert whole.junk == cut.junk <= len(data)
    whole_host = packets.FromDispatcher()
    whole_host.take(data)
    whole_host.take_rest()


def take_report(data: bytes) -> None:
    """A robot's answer, whatever it holds, can be looked at from every side."""
    if len(data) < 8:
        return
    report = Report(int.from_bytes(data[:2], "big"), data[2], data[3:7], data[7])
    _ = report.loader_state, report.robot_state, report.is_late, report.missing
    _ = report.image_id, report.voltage, report.heard, report.entry


def take_poses(data: bytes) -> None:
    """A line of poses by UDP."""
    with contextlib.suppress(ValueError):
        for robot in poses.read_line(data):
            assert 0 <= robot.uid <= 65535


def take_build_id(data: bytes) -> None:
    """The bytes of an image."""
    find_build_id(data)


def take_setting(data: bytes) -> None:
    """Words after --set."""
    with contextlib.suppress(KilotwinError):
        parse_setting(data.decode(errors="surrogateescape"))


def _experiments() -> list[bytes]:
    files = sorted((ROOT / "experiments").glob("**/*.toml"))
    return [file.read_bytes() for file in files if b"[[case" not in file.read_bytes()]


def _bad_input(folder: str, suffix: str) -> list[bytes]:
    return [f.read_bytes() for f in sorted((ROOT / folder).glob(f"**/*{suffix}"))]


def _read_experiment(file: Path) -> object:
    return Experiment.of(ExperimentText.read(file, []))


def _read_hex(file: Path) -> object:
    image = flash_image.read_hex(file)
    return image.pages, image.crc16, image.build_id


_SMALL = """\
duration_s = 2
[arena]
diameter_m = 2.0
[swarm]
profile = "kilobot"
program = "blank.c"
size = 3
[record]
sample_s = 0.5
"""


class RunFolder:
    """A run folder, in which each input takes the place of one of the files."""

    FILES = ("manifest.json", "experiment.toml", "events.jsonl", "robots.arrows", "robots.parquet")

    def __init__(self) -> None:
        self._folder: Path | None = None

    def _made(self) -> Path:
        if self._folder is None:
            file = _in_memory() / "experiment.toml"
            file.write_text(_SMALL)
            shutil.copy(ROOT / "firmware/blank.c", file.parent)
            made = file.with_name("run")
            words = [sys.executable, "-m", "kilotwin", "run", file, "--out", made, "--quiet"]
            subprocess.run(list(map(str, words)), check=True, capture_output=True)
            self._folder = made
        return self._folder

    def seeds(self) -> list[bytes]:
        """Each file as it should be, behind its number."""
        made = self._made()
        return [bytes([i]) + (made / name).read_bytes() for i, name in enumerate(self.FILES)]

    def take(self, data: bytes) -> None:
        """Checks and reads the folder, and puts the file back."""
        file = self._made() / self.FILES[data[0] % len(self.FILES) if data else 0]
        whole = file.read_bytes()
        file.write_bytes(data[1:])
        try:
            with contextlib.suppress(KilotwinError):
                check(self._made())
            with contextlib.suppress(KilotwinError):
                opened = Run.open(self._made())
                for read in (opened.events, opened.robots, opened.sites):
                    with contextlib.suppress(KilotwinError):
                        read()
        finally:
            file.write_bytes(whole)


_HEADER = b"modulex\tmoduley\tc\ttimestamp\tkilobot_sn\tdata0\tdata1\n"
_NUMBERS = (b"0", b"-1", b"255", b"256", b"65536", b"1e308", b"9" * 400, b"nan", b"true", b"\xb2")

_RUN_FOLDER = RunFolder()

PYTHON: dict[str, PythonTarget] = {
    "run-folder": PythonTarget(
        _RUN_FOLDER.take,
        _RUN_FOLDER.seeds,
        (b"{", b"[", b'"status": "running"', b"\n", b"=", b"null", *_NUMBERS),
        65536,
    ),
    "can": PythonTarget(
        take_frame, lambda: [bytes([2, 67, kind, *range(7)]) for kind in range(64)], longest=12
    ),
    "serial": PythonTarget(
        take_packets,
        lambda: [
            packets.encode(2, b"message"),
            packets.CONTINUE,
            packets.encode_notice(packets.Notice(15, 3)),
            packets.encode_tracking(
                packets.Tracking((packets.Record(1, 2, 3, b"1234567", 77),) * 3)
            ),
        ],
        (b"\x55", b"\x55\x0e", b"\x55\x08"),
        200,
    ),
    "reports": PythonTarget(
        take_report, lambda: [bytes(range(n, n + 8)) for n in range(0, 248, 8)], longest=9
    ),
    "poses": PythonTarget(
        take_poses,
        lambda: [b'{"robots": [{"uid": 1, "x_m": 0.5, "y_m": 1, "heading_rad": 3, "led": [1,2]}]}'],
        (b"[", b"{", b'"uid"', b"null", *_NUMBERS),
    ),
    "kconf": PythonTarget(
        _file(kconf.read, "a.kconf"),
        lambda: _bad_input("tests/labs", ".kconf"),
        (b"address\n", b"data\n", b"module:", b"x:", b"y:", b"0x", b"#", b"-", b",", *_NUMBERS),
    ),
    "kilodat": PythonTarget(
        _file(kilodat.read, "a.kilodat"),
        lambda: [_HEADER + b"1\t2\t3\t4\t5\t6\t7\n" * 3, b"0 0 0 0 2066/3 1\n"],
        (b"\t", b"modulex", b"\n", *_NUMBERS),
    ),
    "serials": PythonTarget(
        _file(serials.read_serials, "robots.txt"),
        lambda: [b"serial\tid\n2066/3\t1\n01087\t2\n"],
        (b"\t", b"\n", b"#", *_NUMBERS),
    ),
    "hex": PythonTarget(
        _file(_read_hex, "a.hex"),
        lambda: [
            b":04000000940C0034EC\n:0400040001020304EE\n:00000001FF\n",
            *(seed for seed in _bad_input("tests/bad_input/cases/hex", ".hex") if len(seed) < 4096),
        ],
        (b":", b":00000001FF\n", b":020000021000EC\n", b"FF", b"\n"),
    ),
    "build-id": PythonTarget(
        take_build_id,
        lambda: [b"\x22robot blink avr-gcc-5.4.0 kilotwin-1KTID"],
        (b"KTID", b"robot", b"module", b" "),
    ),
    "setting": PythonTarget(
        take_setting,
        lambda: [b"swarm.informed=0", b"site.0.colour='black'", b"grid={a=1}"],
        (b".", b"=", b"[", b"{", b"'", b'"""', b"\n", *_NUMBERS),
    ),
    "experiment": PythonTarget(
        _file(_read_experiment, "a.toml"),
        lambda: [*_experiments(), *_bad_input("tests/bad_input/cases", ".toml")],
        (b"[", b"]", b"[[", b"{", b'"', b"'''", b"=", b"\n", b"#", b"[[site]]\n", *_NUMBERS),
        8192,
    ),
}
