"""Programs of a run that is repeated with a trail: places in their sources, and their variables."""

from collections.abc import Sequence
from dataclasses import dataclass

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment, Group
from kilotwin.programs.code_map import HARD, CodeMap
from kilotwin.programs.code_places import CodePlaces
from kilotwin.programs.guest_symbols import GuestSymbols, NumberPlace
from kilotwin.programs.image.image import build_image
from kilotwin.studies.why.facts import Path


@dataclass(frozen=True)
class _Program:
    """One that runs translated."""

    map: CodeMap
    places: CodePlaces
    symbols: GuestSymbols


class Programs:
    """Those of an experiment's robots, by the index of a robot."""

    def __init__(self, experiment: Experiment) -> None:
        """Builds them, or finds them built."""
        self._experiment = experiment
        groups = experiment.groups
        self._programs = [
            _program(group) if group.tier == "translated" else None for group in groups
        ]

    def _of(self, robot: int) -> _Program | None:
        return self._programs[self._experiment.group_index(robot)]

    @property
    def draws(self) -> tuple[tuple[tuple[int, int], ...], ...]:
        """Extents of code that draws random numbers, for each robot."""
        return tuple(
            draws
            for group, program in zip(self._experiment.groups, self._programs, strict=True)
            for draws in [program.map.draws if program else ()] * group.count
        )

    def is_watched(self, robot: int) -> bool:
        """Whether its code tells what it stores."""
        return self._of(robot) is not None

    def place(self, robot: int, path: Path) -> str:
        """`walk.c:42 in loop()`; of code without a line its address."""
        program = self._of(robot)
        found = program.places.of(path) if program else None
        if found is not None:
            return found.text()
        return f"address 0x{path[0]:04x}" if path else "an unknown place"

    def variable(self, robot: int, address: int) -> str:
        """The name of the variable of its program's own that a byte is of; "": of none."""
        program = self._of(robot)
        found = program.map.variable(address) if program else None
        return found.name if found is not None and found.own else ""

    def reads(self, robot: int, path: Path) -> frozenset[str]:
        """Such variables that the function at work names."""
        program = self._of(robot)
        return program.map.reads(path) if program else frozenset()

    def draws_at(self, robot: int, path: Sequence[int]) -> bool:
        """Whether a reading of the converter was taken for rand_hard()."""
        program = self._of(robot)
        functions = [program.map.function(address) for address in path] if program else []
        return any(one is not None and one.name == HARD for one in functions)

    def number(self, robot: int, name: str) -> NumberPlace:
        """Where a variable of its program lies. InputError if it has none that is a number."""
        program = self._of(robot)
        if program is None:
            raise InputError(f"the program of robot {self._experiment.uid_of(robot)} is not known")
        return program.symbols.number(name)


def _program(group: Group) -> _Program:
    image = build_image(group.program)
    return _Program(
        CodeMap(image.elf, image.objects("program")),
        CodePlaces(image.elf.read_bytes(), group.program),
        GuestSymbols(image.elf),
    )
