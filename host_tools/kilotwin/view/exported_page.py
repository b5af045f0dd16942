"""A page that holds its runs itself: one file to mail, which a browser opens without a server.

A run becomes what `pack()` makes, deflated, in base64: its scene, events and curves, and samples,
every k-th so that the file keeps to its size. The other side is viewer/src/exported.ts.
"""

import base64
import hashlib
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.files.drafts import draft_of
from kilotwin.runs.folder import RUNNING
from kilotwin.runs.packing import pack
from kilotwin.runs.reader import Run
from kilotwin.runs.samples import RunSamples
from kilotwin.view.served_run import REPORTED, ServedRun

_PAGE = Path(__file__).parent / "page"
# The page's own script alone is run, whatever robots printed.
_POLICY = (
    "default-src 'none'; script-src 'sha256-{}'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)
_MOST_POINTS = 4_000  # of curves
_MOST_ROWS = 16_000_000  # that a browser has to keep, at 11 bytes each
_ROWS_A_BYTE = 2  # of compressed samples, at best
_SHARE = 0.25  # of a run's room that events may take, and reports likewise
_NOWHERE = 65535
_HEADING_SHIFT = 6
"""A third of a degree is not seen; bits that are noise cannot be compressed."""


@dataclass(frozen=True)
class _Held:
    """A run as the page holds it, and a line that says what was thinned."""

    text: bytes
    said: str


def write_page(runs: Sequence[Run], target: Path, size_mb: float) -> list[str]:
    """Writes the page, at most `size_mb` 10^6 bytes; returns lines that say what it holds.

    InputError: not enough room for a sample at begin and end; a place that cannot be written.
    RunError without the built page.
    """
    head, tail = _page()
    room = int(size_mb * 1e6) - len(head) - len(tail)
    held: list[_Held] = []
    for number, run in enumerate(runs):
        held.append(_hold(run, room // (len(runs) - number), size_mb))
        room -= len(held[-1].text)
    data = b"".join([head, *(run.text for run in held), tail])
    try:
        with draft_of(target) as draft:
            draft.write_bytes(data)
    except OSError as error:
        reason = cause_of(error)
        raise InputError(
            f"--export {target}: cannot be written ({reason}); name another file"
        ) from None
    return [f"{target}: {len(data) / 1e6:.1f} MB", *(run.said for run in held)]


def _page() -> tuple[bytes, bytes]:
    """The page with its script and style inside, cut where runs belong."""
    names = ("index.html", "viewer-style.css", "viewer.js")
    try:
        page, style, script = ((_PAGE / name).read_text() for name in names)
    except FileNotFoundError:
        raise RunError("the viewer's page is not built; type: make setup") from None
    script = script.replace("</script", "<\\/script")
    own = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY.format(own)}" />'
    for link, inside in (
        ('<meta charset="utf-8" />', f'<meta charset="utf-8" />\n    {policy}'),
        ('<link rel="stylesheet" href="viewer-style.css" />', f"<style>{style}</style>"),
        (
            '<script type="module" src="viewer.js"></script>',
            f'<script type="module">{script}</script>',
        ),
    ):
        assert page.count(link) == 1, link
        page = page.replace(link, inside)
    head, end, tail = page.rpartition("</body>")
    return head.encode(), (end + tail).encode()


def _hold(run: Run, room: int, size_mb: float) -> _Held:
    served = ServedRun(run)
    samples = served.samples
    if not samples.samples:
        raise InputError(f"{run.folder}: no sample was recorded; let the run go on for longer")
    events, number = _events(run, room)
    reports, kept = _reports(run, room)
    scene = served.scene()
    if scene["status"] == RUNNING:
        scene["status"] = "running when this was exported"
    head = {"scene": scene, "events": events, "number": number}
    arrays: dict[str, NDArray[Any]] = {
        "series": np.frombuffer(samples.series(_MOST_POINTS), dtype=np.uint8),
        "reports": reports,
    }
    rows = max(1, len(samples.robots.ids))
    most = max(2, min(_MOST_ROWS, _ROWS_A_BYTE * room) // rows)
    stride = max(1, -(-(samples.samples - 1) // (most - 1)))
    while True:
        wanted = _every(samples.samples, stride)
        more, step_m = _samples(samples, wanted)
        text = _text(pack(head, {**arrays, **more}))
        if len(text) <= room:
            break
        if len(wanted) <= 2:
            need = size_mb + (len(text) - room) / 1e6
            raise InputError(
                f"--size {size_mb:g}: too small for {rows:,} robots at begin and end; name "
                f"{np.ceil(need):.0f} or more"
            )
        stride = max(stride + 1, int(np.ceil(1.05 * stride * len(text) / max(1, room))))
    said = [_of(len(wanted), samples.samples, "samples")]
    if len(wanted) < samples.samples:
        said[0] += f" (every {stride}th, and the last)"
    said += [f"positions to {1000 * step_m:.2g} mm", _of(len(events), number, "events")]
    if kept:
        said.append(kept)
    return _Held(text, f"  {run.folder}: {', '.join(said)}")


def _every(number: int, stride: int) -> list[int]:
    """Every k-th, and the last one."""
    wanted = list(range(0, number, stride))
    return wanted if wanted[-1] == number - 1 else [*wanted, number - 1]


def _of(kept: int, number: int, what: str) -> str:
    return f"all {number:,} {what}" if kept == number else f"{kept:,} of {number:,} {what}"


def _text(data: bytes) -> bytes:
    inside = base64.b64encode(zlib.compress(data, 6))
    return b'<script type="text/plain" class="run">' + inside + b"</script>\n"


def _fits(data: bytes, room: int) -> bool:
    return len(zlib.compress(data, 6)) * 4 // 3 <= _SHARE * room


def _events(run: Run, room: int) -> tuple[list[dict[str, Any]], int]:
    """The last ones that fit, and how many there are."""
    events = run.events()
    number = len(events)
    while events and not _fits(json.dumps(events).encode(), room):
        events = events[-(len(events) // 2) :] if len(events) > 1 else []
    return events, number


def _reports(run: Run, room: int) -> tuple[NDArray[np.float64], str]:
    """[rows, columns of REPORTED] that a grid's host had; every k-th of them, if they are many."""
    if run.experiment.grid is None:
        return np.zeros((0, len(REPORTED))), ""
    table = run.tracking()
    rows = np.column_stack([np.asarray(table[name], dtype=np.float64) for name in REPORTED])
    stride = 1
    while not _fits(rows[::stride].tobytes(), room):
        stride *= 2
    kept = rows[::stride]
    return kept, _of(len(kept), len(rows), "reports") if len(rows) else ""


def _samples(samples: RunSamples, wanted: list[int]) -> tuple[dict[str, NDArray[Any]], float]:
    """The arrays of these samples, and the step of positions, m."""
    read = samples.read(wanted)
    arrays: dict[str, NDArray[Any]] = {"time_s": samples.times_s()[wanted]}
    step_m = 0.0
    for name, values in read.items():
        if name.endswith("led"):
            arrays[name] = np.ascontiguousarray(values.T)
        elif name.endswith("heading_rad"):
            arrays[name] = _differences(values >> _HEADING_SHIFT)
        else:
            low, step, numbers = _numbered(values)
            arrays[name] = _differences(numbers)
            arrays[f"{name}.scale"] = np.array([low, step])
            if name.endswith("_m"):
                step_m = max(step_m, step)
    return arrays, step_m


def _numbered(values: NDArray[Any]) -> tuple[float, float, NDArray[np.uint16]]:
    """Lowest value, step, and each value's number from there; _NOWHERE for NaN. Whole numbers have
    a whole step, so that fewer than 65535 different ones stay as they are."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    step = (high - low) / (_NOWHERE - 1) or 1e-6
    if np.issubdtype(values.dtype, np.integer):
        step = float(np.ceil(step))
    numbers = np.round((values.astype(np.float64) - low) / step)
    return low, step, np.where(np.isfinite(values), numbers, _NOWHERE).astype(np.uint16)


def _differences(values: NDArray[Any]) -> NDArray[np.uint8]:
    """[2, robots, samples] of uint16: low and high bytes of what each value is more than the one
    before.

    0, -1, 1, -2, ... are 0, 1, 2, 3, ..., so that small differences have a high byte of 0.
    """
    steps = np.diff(values.T, prepend=np.uint16(0), axis=1).astype(np.int16)
    folded = ((steps << 1) ^ (steps >> 15)).astype(np.uint16)
    return np.stack([folded & 255, folded >> 8]).astype(np.uint8)
