"""Builds what the robots of a group run: a guest, or an image for their ATmega328P."""

import hashlib
from dataclasses import replace
from pathlib import Path

from kilotwin.build.avr import build_image
from kilotwin.build.boot_loader import with_boot_loader
from kilotwin.build.guest import Guest, Notify, build
from kilotwin.experiment.experiment import Group

_KEY_CHARACTERS = 32


def build_group(group: Group, notify: Notify = lambda _: None) -> Guest:
    """The file that the engine loads. An image that came built is taken as it is."""
    program = group.program
    if not group.on_board:
        return build(program, notify)
    if program.sources:
        image = build_image(program, notify)
        guest = Guest(program.name, image.hex, image.key, image.compiler)
    else:
        guest = Guest(program.name, program.path, _key_of(program.path), "")
    if group.boot_loader is None:
        return guest
    whole = with_boot_loader(guest.file, group.boot_loader, notify)
    return replace(guest, file=whole, key=_key_of(whole))


def _key_of(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:_KEY_CHARACTERS]
