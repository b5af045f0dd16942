"""Wishes of a page, made into orders for the run's process (session/steering.py).

Here, since experiments and programs are read: the run's process reads no files any more.
"""

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment, one_command
from kilotwin.experiment.schema.profile_defaults import PROFILES
from kilotwin.experiment.spec.engine import config_messages
from kilotwin.experiment.spec.overhead import KEYS, message_of, region, uids
from kilotwin.experiment.text import ExperimentText, Setting, parse_setting
from kilotwin.runs.folder import EXPERIMENT

_PARAMETERS = ("parameters", "controller", "reading")
_PACE = ("pause", "resume", "step", "speed", "place", "turn", "grid")
_ON_GRID = "on a Kilogrid robots are told in mid-run to pause and to resume"


class Helm:
    """Makes orders for one run."""

    def __init__(self, folder: Path) -> None:
        """InputError if its experiment, or a program of it, is there no more."""
        self._file = folder / EXPERIMENT
        self._settings: list[Setting] = []
        self._experiment = Experiment.load(self._file)

    def offers(self) -> dict[str, Any]:
        """For the page: `grid`; `commands`, what may be sent; `parameters`, their values by key."""
        grid = self._experiment.plan is not None
        return {
            "grid": grid,
            "commands": [] if grid else list(KEYS),
            "parameters": {} if grid else self._parameters(),
        }

    def _parameters(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        keys = self._experiment.keys
        wire = self._experiment.wire
        if wire is not None:
            found |= {f"parameters.{name}": value for name, value in wire.values.items()}
        if keys.controller is not None:
            for table, values in (("controller", keys.controller), ("reading", keys.reading)):
                if values is not None:
                    dumped = values.model_dump(exclude_none=True)
                    found |= {f"{table}.{name}": value for name, value in dumped.items()}
        return found

    def order(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The order for what was asked; InputError says what is wrong with it."""
        do = asked.get("do")
        if do in _PACE:
            return {key: value for key, value in asked.items() if key != "id"}
        if self._experiment.plan is not None:
            raise InputError(_ON_GRID)
        if do == "command" and isinstance(asked.get("keys"), dict):
            return self._command(asked["keys"])
        if do == "set" and isinstance(asked.get("setting"), str):
            return self._set(asked["setting"])
        raise InputError(f"{do!r:.40} is nothing that a run can be asked")

    def _command(self, keys: dict[str, Any]) -> dict[str, Any]:
        for key in ("at_s", "repeat_s"):
            if key in keys:
                raise InputError(f"a command acts now, and once; remove '{key}'")
        experiment = self._experiment
        tables = {"command": [{"at_s": 0, **keys}]}
        origin = ExperimentText("the command", Path.cwd(), tables, "", [])
        command = one_command(origin, experiment.uids)
        first, last = uids(command)
        message = {
            "data": list(message_of(command, PROFILES[experiment.keys.swarm.profile])),
            "uid_first": first,
            "uid_last": last,
        }
        where = region(command)
        if where is not None:
            message["region"] = list(where)
        said = ", ".join(f"{key} = {value}" for key, value in keys.items())
        return {"do": "send", "messages": [message], "told": f"[[command]] {said}"[:200]}

    def _set(self, text: str) -> dict[str, Any]:
        setting = parse_setting(text)
        if setting.keys[0] not in _PARAMETERS:
            allowed = ", ".join(f"{name}.KEY" for name in _PARAMETERS)
            raise InputError(f"{text}: robots can be told {allowed} in mid-run")
        settings = [*self._settings, setting]
        changed = Experiment.of(ExperimentText.read(self._file, settings))
        before = config_messages(self._experiment)
        messages = [one for one in config_messages(changed) if one not in before]
        if not messages:
            raise InputError(f"{text}: robots have been told so")
        self._settings, self._experiment = settings, changed
        data = [
            {"data": list(message), "uid_first": first, "uid_last": last}
            for first, last, message in messages
        ]
        return {"do": "send", "messages": data, "told": text[:200]}


def helm_of(folder: Path) -> Helm | None:
    """None if the experiment cannot be read any more: its run is only seen then."""
    with contextlib.suppress(InputError):
        return Helm(folder)
    return None
