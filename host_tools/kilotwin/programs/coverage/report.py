"""Reports of coverage for other tools: by gcovr, which merges and draws such reports."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kilotwin.errors import RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.programs import Program
from kilotwin.files import resources
from kilotwin.programs.coverage.lines import Source, Sources, sources_of
from kilotwin.programs.coverage.marks import Marks, merged
from kilotwin.programs.coverage.native_lines import native_sources_of
from kilotwin.programs.image.image import build_image
from kilotwin.programs.native.guest import build

JSON, LCOV, HTML = "coverage.json", "coverage.info", "index.html"


@dataclass(frozen=True)
class Share:
    """How much of something has run."""

    run: int
    of: int

    def text(self, what: str) -> str:
        """`63 of 70 lines (90 %)`."""
        percent = f" ({self.run / self.of:.0%})".replace("%", " %") if self.of else ""
        return f"{self.run} of {self.of} {what}{percent}"


@dataclass(frozen=True)
class Covered:
    """A program that marks what runs, by its machine code or natively."""

    program: Program
    translated: bool


def of_programs(programs: Iterable[tuple[Covered, Marks]]) -> Sources:
    """Coverage of all sources. A program may come several times; marks are put together."""
    by_program: dict[Covered, list[Marks]] = {}
    for covered, own in programs:
        by_program.setdefault(covered, []).append(own)
    found: Sources = {}
    for covered, several in by_program.items():
        program, marks = covered.program, merged(several)
        if covered.translated:
            sources = sources_of(program, build_image(program), marks)
        else:
            sources = native_sources_of(program, build(program, covered=True).file, marks)
        for file, source in sources.items():
            found[file] = _both(found[file], source) if file in found else source
    return dict(sorted(found.items()))


def own_marks(experiment: Experiment, marks: Iterable[Marks]) -> Iterator[tuple[Covered, Marks]]:
    """Each program of robots and modules that has sources, with its marks in a run; none of a run
    that failed."""
    modules = [] if experiment.modules is None else [experiment.modules]
    for group, own in zip([*experiment.groups, *modules], marks, strict=False):
        if not group.on_board:
            yield Covered(group.program, group.tier == "translated"), own


def _both(one: Source, other: Source) -> Source:
    """A file that several programs have: what either ran. Their branches are others."""
    lines = dict(one.lines)
    for line, ran in other.lines.items():
        lines[line] = lines.get(line, False) or ran
    branches = {
        line: [*one.branches.get(line, []), *other.branches.get(line, [])]
        for line in sorted({*one.branches, *other.branches})
    }
    return Source(lines, branches)


def shares(sources: Sources) -> tuple[Share, Share]:
    """The shares of lines, and of ways out of branches."""
    ways = [way for source in sources.values() for way in source.ways]
    lines = sum(len(source.lines) for source in sources.values())
    run = sum(source.lines_run for source in sources.values())
    return Share(run, lines), Share(sum(ways), len(ways))


def text(sources: Sources) -> str:
    """A row for each file, with the lines that have not run."""
    width = max((len(file.name) for file in sources), default=0)
    rows = []
    for file, source in sources.items():
        missing = _ranges(sorted(line for line, ran in source.lines.items() if not ran))
        share = Share(source.lines_run, len(source.lines)).text("lines")
        rows.append(f"  {file.name:{width}}  {share}{'; not ' + missing if missing else ''}")
    return "\n".join(rows)


def _ranges(lines: list[int]) -> str:
    """`3-5, 9`."""
    parts: list[list[int]] = []
    for line in lines:
        if parts and line == parts[-1][-1] + 1:
            parts[-1].append(line)
        else:
            parts.append([line])
    return ", ".join(str(p[0]) if len(p) == 1 else f"{p[0]}-{p[-1]}" for p in parts)


def written(sources: Sources, folder: Path) -> dict[str, Any]:
    """Writes coverage.json (gcovr's), coverage.info (lcov's) and index.html into the folder, which
    is made; returns what --json says of it."""
    folder.mkdir(parents=True, exist_ok=True)
    _write(sources, folder)
    lines, ways = shares(sources)
    return {
        "lines": [lines.run, lines.of],
        "branches": [ways.run, ways.of],
        "text": f"{lines.text('lines')}, {ways.text('ways out of branches')}",
        "files": text(sources),
        "folder": str(folder),
    }


def _write(sources: Sources, folder: Path) -> None:
    """gcovr takes files below one folder only. Files with none in common, as of a lab's program and
    our modules', have a report each: the lab's in `folder`, others below; coverage.info has all."""
    parts: dict[tuple[str, ...], Sources] = {}
    for file, source in sources.items():
        parts.setdefault(file.parts[:2], {})[file] = source
    ours = [root.resolve() for root in resources.roots()]
    ordered = sorted(
        parts.values(),
        key=lambda part: any(next(iter(part)).is_relative_to(root) for root in ours),
    )
    for number, part in enumerate(ordered or [sources]):
        root = os.path.commonpath([file.parent for file in part]) if part else str(folder)
        place = folder if number == 0 else folder / Path(root).name
        place.mkdir(exist_ok=True)
        _report(part, root, place)
        if number > 0:
            with (folder / LCOV).open("a", encoding="utf-8") as lcov:
                lcov.write((place / LCOV).read_text(encoding="utf-8"))


def _report(sources: Sources, root: str, folder: Path) -> None:
    """The files of gcovr."""
    from gcovr.data_model.version import FORMAT_VERSION  # an extra

    report = {
        "gcovr/format_version": FORMAT_VERSION,
        "files": [_file(file, source) for file, source in sources.items()],
    }
    (folder / JSON).write_text(json.dumps(report), encoding="utf-8")
    command = [sys.executable, "-P", "-m", "gcovr", "--root", root, "-a", str(folder / JSON)]
    command += ["--lcov", str(folder / LCOV), "--html-details", str(folder / HTML)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RunError("gcovr could not write the report of coverage", detail=done.stderr.strip())


def _file(file: Path, source: Source) -> Mapping[str, Any]:
    lines = [
        {
            "line_number": line,
            "count": int(ran),
            "branches": [
                {"branchno": number, "count": int(way), "fallthrough": False, "throw": False}
                for number, way in enumerate(
                    way for both in source.branches.get(line, []) for way in both
                )
            ],
        }
        for line, ran in sorted(source.lines.items())
    ]
    return {"file": str(file), "lines": lines, "functions": []}
