"""Tables as a TOML text."""

from collections.abc import Sequence
from typing import Any

import tomli_w

# In place of poses; too long for tomli_w to put its table into one line.
_MARK = "the poses of these robots " + "." * 100


def toml_of(tables: dict[str, Any]) -> str:
    """The text of an experiment's tables, as tomli_w writes it. Poses of [[robots]], of which there
    may be ten thousand, are written here, which takes a quarter of its time."""
    kinds = tables.get("robots", [])
    marked = [{**kind, "poses": _MARK} if kind.get("poses") else kind for kind in kinds]
    text = tomli_w.dumps({**tables, "robots": marked} if kinds else tables)
    # No text in the file has such quotes within its own.
    before, *others = text.split(f'poses = "{_MARK}"')
    poses = [_array_of(kind["poses"]) for kind in kinds if kind.get("poses")]
    return before + "".join(
        f"poses = {array}{other}" for array, other in zip(poses, others, strict=True)
    )


def _array_of(poses: Sequence[Sequence[float]]) -> str:
    lines = [f"    [\n        {x},\n        {y},\n        {z},\n    ],\n" for x, y, z in poses]
    return f"[\n{''.join(lines)}]"
