"""Files that keys of an experiment name."""

from pathlib import Path

from kilotwin.errors import InputError
from kilotwin.experiment.text import ExperimentText
from kilotwin.experiment.toml_lines import KeyPath
from kilotwin.files import resources
from kilotwin.files.places import places_of


def find_file(written: str, path: KeyPath, origin: ExperimentText) -> Path:
    """A file that a key names: from here, beside the experiment, or one that Kilotwin brings."""
    places = places_of(written, origin.folder)
    found = next((place for place in places if place.is_file()), None) or resources.find(written)
    if found is None:
        raise InputError(f"{origin.where(path)}: '{written}' is not there; name a file")
    return found.resolve()


def shown(file: Path) -> Path:
    """A file as messages name it: below the present folder without that folder's path."""
    return file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file
