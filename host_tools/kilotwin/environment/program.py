"""An environment's program: its class is loaded, and its mistakes are told by file and line."""

import importlib.util
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kilotwin.environment.protocol import Arena, Seen, Sender, Settings
from kilotwin.errors import InputError, KilotwinError, RunError
from kilotwin.experiment.files import shown


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
        """The class. Modules beside the file can be imported while it is loaded."""
        spec = importlib.util.spec_from_file_location(f"_environment_{self._file.stem}", self._file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module  # dataclasses look their module up
        sys.path.insert(0, str(self._file.parent))
        before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
        try:
            spec.loader.exec_module(module)
        finally:
            sys.dont_write_bytecode = before
            sys.path.remove(str(self._file.parent))
        kind = getattr(module, self._class_name, None)
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
            what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            whose = f"{self._class_name}, {when}"
            raise error_of(f"{self._place(error)}: {what} ({whose})") from None

    def _place(self, error: BaseException) -> str:
        """The last line of the program's own, or of its neighbours, that was under way."""
        if isinstance(error, SyntaxError) and error.filename is not None:
            return f"{shown(Path(error.filename))}:{error.lineno}"
        frames = traceback.extract_tb(error.__traceback__)
        own = [f for f in frames if Path(f.filename).is_relative_to(self._file.parent)]
        if not own:
            return str(shown(self._file))
        return f"{shown(Path(own[-1].filename))}:{own[-1].lineno}"
