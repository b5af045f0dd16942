"""The error for a path that is no run folder: its kind, and what to type."""

from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.runs.folder import EXPERIMENT, MANIFEST

_SWEEP = "sweep.json"
_NAMED = 3


def not_a_run(path: Path) -> InputError:
    """The error for what is no run folder."""
    return InputError(f"{path}: {_what(path)}")


def _what(path: Path) -> str:
    if path.is_file() and (path.parent / MANIFEST).is_file():
        return f"a file of a run; name its folder: {path.parent}"
    if path.suffix == ".toml" and path.is_file():
        return (
            f"an experiment, not a run; to see it run type: kilotwin run {path} --view; else name "
            f"the folder that a run of it left{_as(Path('runs'))}"
        )
    if (path / _SWEEP).is_file():
        return (
            f"a sweep, not a run; for all of its trials type: kilotwin plot series {path} -o "
            "series.png; for a picture or video of one, kilotwin run its experiment with that seed "
            "(kilotwin plot --help has the figures of each)"
        )
    if path.is_dir():
        missing = EXPERIMENT if (path / MANIFEST).is_file() else MANIFEST
        what = f"not a run folder (no {missing})"
    else:
        what = "a file, not a run folder" if path.exists() else "there is no such run folder"
    there = _as(path if path.is_dir() else path.parent) or _as(Path("runs"))
    return f"{what}; name one that `kilotwin run` made{there}"


def _as(folder: Path) -> str:
    """`, as runs/a, runs/b`: the newest runs in a folder; "" if there are none."""
    try:
        runs = [file.parent for file in folder.glob(f"*/{MANIFEST}")]
        newest = sorted(runs, key=lambda run: -(run / MANIFEST).stat().st_mtime)[:_NAMED]
    except OSError:
        return ""
    return f", as {', '.join(map(str, newest))}" if newest else ""
