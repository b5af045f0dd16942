"""Builds what the robots of a group run: a guest, or an image for their ATmega328P."""

import hashlib

from kilotwin.build.avr import build_image
from kilotwin.build.guest import Guest, Notify, build
from kilotwin.experiment.experiment import Group

_KEY_CHARACTERS = 32


def build_group(group: Group, notify: Notify = lambda _: None) -> Guest:
    """The file that the engine loads. An image that came built is taken as it is."""
    program = group.program
    if not group.on_board:
        return build(program, notify)
    if not program.sources:
        key = hashlib.sha256(program.path.read_bytes()).hexdigest()[:_KEY_CHARACTERS]
        return Guest(program.name, program.path, key, "")
    image = build_image(program, notify)
    return Guest(program.name, image.hex, image.key, image.compiler)
