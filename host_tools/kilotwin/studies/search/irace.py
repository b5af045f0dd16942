"""The best values of some keys by iterated racing: irace proposes points, trials measure them.

irace is a package of R (Debian: r-cran-irace). In a folder it gets the files that its users know,
parameters.txt, scenario.txt and instances.txt, and a script of R that runs it. Each batch of a race
comes as lines on the script's output, and goes back as costs on its input: so the trials of a batch
run side by side in the pool, and one that is in the data set is not run again.

    @ask 2
    @1\t271828\tcontroller.beta=1.5\tstates=a     configuration, seed, parameters
    @2\t271828\tcontroller.beta=2.5\tstates=b

What is answered is a cost a line, small for good, `Inf` of a trial that failed. At the end the best
configurations come as `@elite` lines, the best first.
"""

import contextlib
import math
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from kilotwin.errors import InputError, RunError
from kilotwin.files.drafts import draft_of
from kilotwin.studies.search.optimise import Found, Search, Tried, confirm
from kilotwin.studies.search.points import Laboratory
from kilotwin.studies.search.space import Axis, Point

_R = "Rscript"
_SCRIPT = "race.R"
_DIGITS = 6
# An experiment is the one instance of a race; each trial of it has a seed by irace.
_INSTANCE = "experiment"
_ITERATION = re.compile(r"[Ii]teration \d+ of \d+")
_NO_NAME = re.compile(r"[^A-Za-z0-9_.]")

PROGRAM = """\
# Runs irace on the files beside this one, for `kilotwin optimise --with irace`.
library(irace)
told <- file("stdin", open = "r")

# Hands a batch to kilotwin, and takes its costs back.
ask <- function(experiments, exec.target.runner, scenario, target.runner) {
  cat("@ask ", length(experiments), "\\n", sep = "")
  for (one in experiments) {
    values <- paste0(names(one$configuration), "=", sapply(one$configuration, format, digits = 15))
    cat("@", paste(c(one$id.configuration, one$seed, values), collapse = "\\t"), "\\n", sep = "")
  }
  flush(stdout())
  costs <- readLines(told, n = length(experiments))
  if (length(costs) < length(experiments)) quit(status = 1)
  lapply(as.numeric(costs), function(cost) list(cost = cost, time = NA_real_))
}

scenario <- readScenario(filename = "scenario.txt", scenario = list(targetRunnerParallel = ask))
parameters <- readParameters(file = scenario$parameterFile, digits = scenario$digits)
elites <- irace(scenario = scenario, parameters = parameters)
for (row in seq_len(nrow(elites))) {
  one <- elites[row, parameters$names, drop = FALSE]
  values <- paste0(names(one), "=", sapply(one, format, digits = 15))
  cat("@elite ", paste(values, collapse = "\\t"), "\\n", sep = "")
}
"""


@dataclass(frozen=True)
class Race:
    """A race in a folder. `names`: how irace calls the keys."""

    search: Search
    folder: Path
    names: Mapping[str, Axis]

    @staticmethod
    def of(search: Search, folder: Path) -> "Race":
        """InputError of what irace does not do."""
        if len(search.goals) > 1:
            raise InputError("--with irace: for one metric; leave it out for several")
        if search.prunes:
            raise InputError("--with irace: it gives points up by itself; leave --prune out")
        names: dict[str, Axis] = {}
        for axis in search.axes:
            name = _NO_NAME.sub("_", axis.key)
            names[name if name not in names else f"{name}.{len(names)}"] = axis
        return Race(search, folder, names)

    @property
    def budget(self) -> int:
        """Trials that irace may have."""
        return self.search.points * self.search.repeats

    def write(self) -> None:
        """Makes the folder with irace's files."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for name, text in self.files().items():
                with draft_of(self.folder / name) as draft:
                    draft.write_text(text)
        except OSError as error:
            raise InputError(f"--out {self.folder}: {error.strerror}; name another") from None

    def files(self) -> dict[str, str]:
        """The text of each file, by its name."""
        rows = [f'{name}\t""\t{_domain(axis)}' for name, axis in self.names.items()]
        scenario = {
            "parameterFile": '"./parameters.txt"',
            "trainInstancesDir": '""',
            "trainInstancesFile": '"./instances.txt"',
            "execDir": '"./"',
            "logFile": '"./irace.Rdata"',
            "maxExperiments": self.budget,
            "digits": _DIGITS,
            "seed": self.search.seed,
        }
        return {
            "parameters.txt": "\n".join(["# name\tswitch\ttype and range", *rows, ""]),
            "scenario.txt": "".join(f"{key} = {value}\n" for key, value in scenario.items()),
            "instances.txt": f"{_INSTANCE}\n",
            _SCRIPT: PROGRAM,
        }

    def asked(self, line: str) -> tuple[Point, int]:
        """The point and the seed of a line. RunError of what is none."""
        _, seed, *values = line.removeprefix("@").split("\t")
        return self.point(values), int(seed)

    def point(self, values: Sequence[str]) -> Point:
        """The point of `name=value` words."""
        point: Point = {}
        for word in values:
            name, _, value = word.partition("=")
            axis = self.names[name]
            point[axis.key] = _value(axis, value.strip())
        return point


def race(search: Search, laboratory: Laboratory, note: Callable[[str], None]) -> Found:
    """Races, or goes on: trials that are there are not run again. InterruptError if interrupted;
    RunError with irace's last words if it ends without a result."""
    if shutil.which(_R) is None:
        raise RunError("--with irace: R is not installed; type: apt-get install r-cran-irace")
    made = Race.of(search, laboratory.folder / "irace")
    laboratory.make_folder()
    made.write()
    values: dict[str, tuple[Point, list[float]]] = {}
    elites: list[Point] = []
    said: list[str] = []
    with _started(made.folder) as (process, to, lines):
        for line in lines:
            if line.startswith("@ask "):
                asked = [made.asked(next(lines)) for _ in range(int(line.removeprefix("@ask ")))]
                costs = _costs(search, laboratory, asked, values)
                with contextlib.suppress(BrokenPipeError):
                    to.write("".join(f"{cost}\n" for cost in costs))
                    to.flush()
            elif line.startswith("@elite "):
                elites.append(made.point(line.removeprefix("@elite ").split("\t")))
            else:
                said.append(line)
                if iteration := _ITERATION.search(line):
                    note(f"irace: {iteration[0]}; {laboratory.trials} trials so far")
        code = process.wait()
    (made.folder / "irace.log").write_text("\n".join(said) + "\n")
    if code != 0 or not elites:
        raise RunError(_ended(said, made))
    return _found(search, laboratory, values, elites)


@contextlib.contextmanager
def _started(
    folder: Path,
) -> Iterator[tuple["subprocess.Popen[str]", IO[str], Iterator[str]]]:
    """irace, what it is told, and the lines that it says; ended at the end."""
    command = [_R, "--vanilla", _SCRIPT]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(  # type: ignore[call-overload]
        command, cwd=folder, text=True, errors="replace", process_group=0, **pipes
    ) as process:
        try:
            yield process, process.stdin, (line.rstrip("\n") for line in process.stdout)
        finally:
            process.kill()


def _costs(
    search: Search,
    laboratory: Laboratory,
    asked: Sequence[tuple[Point, int]],
    values: dict[str, tuple[Point, list[float]]],
) -> list[float]:
    """The cost of each trial; `values` gets the metric of each point's."""
    (goal,) = search.goals
    sign = 1 if goal.direction == "min" else -1
    costs = []
    for (point, _), found in zip(asked, laboratory.measure_each(asked), strict=True):
        value = None if found is None else found[goal.metric]
        number = math.nan if value is None else value
        values.setdefault(repr(point), (point, []))[1].append(number)
        costs.append(math.inf if math.isnan(number) else number * sign)
    return costs


def _found(
    search: Search,
    laboratory: Laboratory,
    values: Mapping[str, tuple[Point, list[float]]],
    elites: Sequence[Point],
) -> Found:
    """The best is irace's: a point that few trials had may have a better mean by luck."""

    def tried(point: Point, numbers: Sequence[float]) -> Tried:
        return Tried(point, (math.fsum(numbers) / len(numbers),), len(numbers))

    return Found(
        search,
        [tried(*one) for one in values.values()],
        [tried(*values[repr(point)]) for point in elites],
        {},
        confirm(search, elites[0], laboratory) if search.confirm else None,
        laboratory.trials,
    )


def _ended(said: Sequence[str], made: Race) -> str:
    errors = [line for line in said if "rror" in line or "budget" in line]
    if any("no package called" in line for line in said):
        return "--with irace: R has no irace; type: apt-get install r-cran-irace"
    if any("Not enough budget" in line or "smaller than" in line for line in said):
        return (
            f"--with irace: {made.budget} trials (--points x --repeats) are too few for it; give "
            f"more, as --points {4 * made.search.points}"
        )
    last = errors[-1] if errors else "; ".join(said[-2:])
    return f"irace ended without a result: {last.strip()}; see {made.folder / 'irace.log'}"


def _domain(axis: Axis) -> str:
    if axis.choices:
        return f"c ({', '.join(_quoted(choice) for choice in axis.choices)})"
    if axis.step is not None:
        return f"o ({', '.join(_quoted(value) for value in _steps(axis))})"
    kind = ("i" if axis.whole else "r") + ",log" * axis.log
    return f"{kind} ({axis.low:.{_DIGITS}g}, {axis.high:.{_DIGITS}g})"


def _steps(axis: Axis) -> list[float | int]:
    assert axis.step is not None
    number = math.floor((axis.high - axis.low) / axis.step + 1e-9) + 1
    return [axis.value(axis.low + place * axis.step) for place in range(number)]


def _quoted(value: object) -> str:
    text = str(value)
    if '"' in text or "\n" in text or "," in text:
        raise InputError(f'--over ...={text}: irace takes no such choice; name it without , and "')
    return f'"{text}"'


def _value(axis: Axis, text: str) -> object:
    """A value of the axis as irace writes it."""
    listed = axis.choices or (_steps(axis) if axis.step is not None else ())
    for value in listed:
        if str(value) == text:
            return value
    return axis.value(float(text))
