"""SARIF 2.1.0, by which CI services put findings on the lines that they are about."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from kilotwin import __version__
from kilotwin.errors import InputError, cause_of

_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


@dataclass(frozen=True)
class Result:
    """One finding; `line` counts from 1. Without a file it is about the whole project."""

    rule: str
    level: Literal["error", "warning", "note"]
    message: str
    file: str | None = None
    line: int | None = None


def write_sarif(file: Path, results: Sequence[Result], root: Path) -> None:
    """Writes the file, paths below `root` relative to it; InputError if it cannot be written."""
    driver = {
        "name": "kilotwin",
        "version": __version__,
        "rules": [{"id": rule} for rule in sorted({result.rule for result in results})],
    }
    run = {
        "tool": {"driver": driver},
        "results": [_result(result, root) for result in results],
    }
    log = {"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(log, indent=2) + "\n")
    except OSError as error:
        raise InputError(f"--sarif {file}: {cause_of(error)}; name another file") from None


def _result(result: Result, root: Path) -> dict[str, Any]:
    written: dict[str, Any] = {
        "ruleId": result.rule,
        "level": result.level,
        "message": {"text": result.message},
    }
    if result.file is not None:
        path = Path(result.file)
        if path.is_absolute() and path.is_relative_to(root):
            path = path.relative_to(root)
        where: dict[str, Any] = {"artifactLocation": {"uri": path.as_posix()}}
        if result.line is not None:
            where["region"] = {"startLine": result.line}
        written["locations"] = [{"physicalLocation": where}]
    return written
