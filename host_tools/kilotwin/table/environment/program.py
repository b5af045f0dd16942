"""An environment's program: its class is loaded, and its mistakes are told by file and line."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError, KilotwinError, RunError
from kilotwin.experiment.files import shown
from kilotwin.experiment.python_code import PythonName, blamed_line, load_name, what_happened
from kilotwin.table.environment.protocol import Arena, Seen, Sender, Settings


class EnvironmentProgram:
    """An object of the class that `[environment] program` names."""

    def __init__(self, file: Path, class_name: str, arena: Arena, settings: Settings) -> None:
        """InputError if it cannot be made; nothing has been written then."""
        self._file, self._class_name = file, class_name
        with self._blamed("while it was made", InputError):
            kind = self._load()
            self.object = kind(arena, dict(settings))
        if not callable(getattr(self.object, "step", None)):
            raise InputError(f"{shown(file)}: {class_name} has no step(self, seen, send); add it")

    def step(self, seen: Seen, send: Sender) -> None:
        """Shows it a picture; RunError names the line where it failed."""
        with self._blamed(f"in the step for {seen.time_s:.3f} s", RunError):
            self.object.step(seen, send)

    def _load(self) -> Any:
        """The class."""
        kind = load_name(PythonName(self._file, self._class_name))
        if not isinstance(kind, type):
            raise InputError(f"{shown(self._file)}: there is no class '{self._class_name}'")
        return kind

    @contextmanager
    def _blamed(self, when: str, error_of: Callable[[str], KilotwinError]) -> Iterator[None]:
        try:
            yield
        except KilotwinError:
            raise
        except (Exception, SystemExit) as error:
            whose = f"{self._class_name}, {when}"
            place = blamed_line(error, self._file)
            raise error_of(f"{place}: {what_happened(error)} ({whose})") from None
