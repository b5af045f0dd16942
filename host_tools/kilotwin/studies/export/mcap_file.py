"""A run as MCAP, the log format that Foxglove opens. https://mcap.dev/spec

Messages are JSON of Foxglove's own schemas; a message's time is that of the run, ns.

/table    foxglove.SceneUpdate    outlines of arena, sites, obstacles, once
/robots   foxglove.PointCloud     where robots are, in the colours of their LEDs, each sample
/poses    foxglove.PosesInFrame   the same with headings
/counts   kilotwin.Counts         a number for each column of sites
/events   foxglove.Log            events and prints
"""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

from kilotwin.errors import InputError, cause_of
from kilotwin.files import extras
from kilotwin.files.drafts import draft_of
from kilotwin.runs.folder import FAILURES
from kilotwin.runs.reader import Run
from kilotwin.studies.export.moving_robots import Moment, MovingRobots, Outline
from kilotwin.units import counted

_FRAME = "table"
_NS = 1_000_000_000
# Foxglove's numbers of types and levels.
_UINT8, _FLOAT32 = 1, 7
_INFO, _ERROR = 2, 4
_LINE_LOOP = 1
_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgba", "u1", 4)])
_FIELDS = [
    *({"name": name, "offset": 4 * k, "type": _FLOAT32} for k, name in enumerate("xyz")),
    *(
        {"name": name, "offset": 12 + k, "type": _UINT8}
        for k, name in enumerate(("red", "green", "blue", "alpha"))
    ),
]
_ORIGIN = {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}

_NUMBER = {"type": "number"}
_TEXT = {"type": "string"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _array(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_TIME = {**_object(sec={"type": "integer"}, nsec={"type": "integer"}), "title": "time"}
_POSE = _object(
    position=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER),
    orientation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
)
_SCHEMAS = {
    "/table": (
        "foxglove.SceneUpdate",
        _object(deletions=_array(_object()), entities=_array(_object(timestamp=_TIME, id=_TEXT))),
    ),
    "/robots": (
        "foxglove.PointCloud",
        _object(
            timestamp=_TIME,
            frame_id=_TEXT,
            pose=_POSE,
            point_stride={"type": "integer"},
            fields=_array(_object(name=_TEXT, offset=_NUMBER, type=_NUMBER)),
            data={"type": "string", "contentEncoding": "base64"},
        ),
    ),
    "/poses": (
        "foxglove.PosesInFrame",
        _object(timestamp=_TIME, frame_id=_TEXT, poses=_array(_POSE)),
    ),
    "/counts": ("kilotwin.Counts", {"type": "object", "additionalProperties": _NUMBER}),
    "/events": (
        "foxglove.Log",
        _object(
            timestamp=_TIME, level=_NUMBER, message=_TEXT, name=_TEXT, file=_TEXT, line=_NUMBER
        ),
    ),
}


class _Log:
    """Topics of one file."""

    def __init__(self, writer: Any) -> None:
        self._writer = writer
        self._channels = {}
        for topic, (name, schema) in _SCHEMAS.items():
            described = json.dumps({"title": name, **schema}).encode()
            number = writer.register_schema(name=name, encoding="jsonschema", data=described)
            self._channels[topic] = writer.register_channel(
                topic=topic, message_encoding="json", schema_id=number
            )
        self.messages = 0

    def add(self, topic: str, time_s: float, message: dict[str, Any]) -> None:
        """A message; Foxglove's own schemas say the time too."""
        time_ns = round(time_s * _NS)
        stamp = {"sec": time_ns // _NS, "nsec": time_ns % _NS}
        if topic not in ("/table", "/counts"):
            message = {"timestamp": stamp, **message}
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=time_ns,
            publish_time=time_ns,
            data=json.dumps(message, separators=(",", ":")).encode(),
        )
        self.messages += 1


def write_mcap(run: Run, target: Path) -> str:
    """Writes the file; returns a line that says what is in it.

    InputError: a run without places or samples, a place that cannot be written. RunError: the
    library is not installed.
    """
    extras.require("mcap")
    from mcap.writer import Writer  # an extra

    robots = MovingRobots(run)
    try:
        with draft_of(target) as draft, draft.open("wb") as stream:
            writer = Writer(stream)
            writer.start(profile="", library="kilotwin")
            log = _Log(writer)
            _write(run, robots, log)
            writer.finish()  # type: ignore[no-untyped-call]
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"--mcap {target}: cannot be written ({reason}); name another") from None
    return f"{target}: {counted(robots.number, 'sample')}, {counted(log.messages, 'message')}"


def _write(run: Run, robots: MovingRobots, log: _Log) -> None:
    for number, moment in enumerate(robots.moments()):
        if number == 0:
            log.add("/table", moment.time_s, _scene(robots.outlines(), moment.time_s))
        log.add("/robots", moment.time_s, _cloud(moment))
        if moment.heading_rad is not None:
            log.add("/poses", moment.time_s, {"frame_id": _FRAME, "poses": _poses(moment)})
    for row in run.sites().to_pylist():
        time_s = row.pop("time_s")
        row.pop("tick")
        log.add(
            "/counts", time_s, {name: value for name, value in row.items() if value is not None}
        )
    for event in run.events():
        robot = event.get("robot")
        more = {
            "level": _ERROR if event.get("kind") in FAILURES else _INFO,
            "message": str(event.get("text", event.get("kind", ""))),
            "name": "" if robot is None else f"robot {run.uid_of(robot)}",
            "file": str(event.get("kind", "")),
            "line": 0,
        }
        log.add("/events", float(event.get("time_s", 0.0)), more)


def _scene(outlines: list[Outline], time_s: float) -> dict[str, Any]:
    lines = [
        {
            "type": _LINE_LOOP,
            "pose": _ORIGIN,
            "thickness": 2,
            "scale_invariant": True,
            "points": [{"x": x, "y": y, "z": 0} for x, y in outline.corners.tolist()],
            "color": dict(zip("rgba", (*(part / 255 for part in outline.colour), 1), strict=True)),
            "colors": [],
            "indices": [],
        }
        for outline in outlines
    ]
    none = ("arrows", "cubes", "spheres", "cylinders", "triangles", "texts", "models", "metadata")
    entity = {
        "timestamp": {"sec": int(time_s), "nsec": 0},
        "frame_id": _FRAME,
        "id": "table",
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "lines": lines,
        **{name: [] for name in none},
    }
    return {"deletions": [], "entities": [entity]}


def _cloud(moment: Moment) -> dict[str, Any]:
    points = np.zeros(len(moment.places), dtype=_POINT)
    points["x"], points["y"] = moment.places.T
    points["rgba"][:, :3] = moment.colours
    points["rgba"][:, 3] = 255
    return {
        "frame_id": _FRAME,
        "pose": _ORIGIN,
        "point_stride": _POINT.itemsize,
        "fields": _FIELDS,
        "data": base64.b64encode(points.tobytes()).decode(),
    }


def _poses(moment: Moment) -> list[dict[str, Any]]:
    assert moment.heading_rad is not None
    rows = np.column_stack(
        [moment.places, np.sin(moment.heading_rad / 2), np.cos(moment.heading_rad / 2)]
    )
    return [
        {"position": {"x": x, "y": y, "z": 0}, "orientation": {"x": 0, "y": 0, "z": z, "w": w}}
        for x, y, z, w in rows.round(6).tolist()
    ]
