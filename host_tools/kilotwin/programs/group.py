"""Builds what the robots of a group run: a guest, native or of their machine code, or an image for
their ATmega328P."""

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from kilotwin.experiment.experiment import Experiment, Group
from kilotwin.experiment.programs import Program
from kilotwin.experiment.schema.medium import MEDIA
from kilotwin.programs.cache import Notify
from kilotwin.programs.native import sanitizer
from kilotwin.programs.native.guest import Guest, build
from kilotwin.programs.variant import MARKED, Variant

_KEY_CHARACTERS = 32


def build_group(
    group: Group,
    notify: Notify = lambda _: None,
    *,
    variant: Variant = "plain",
    sanitized: bool = False,
    at_once: bool = True,
) -> Guest:
    """The file that the engine loads. An image that came built is taken as it is. `sanitized`: a
    native program looks for undefined behaviour. `at_once`: of a translation, what is compiled
    in a moment will do (translate/translation.py).

    Of an image, that is its translation unless it is to be interpreted, or cannot be translated.
    """
    if group.tier == "translated":
        from kilotwin.programs.translate.translation import translated_guest

        return translated_guest(group.program, notify, variant=variant, at_once=at_once)
    if not group.on_board:
        flags = sanitizer.flags() if sanitized else ()
        return build(group.program, notify, flags, covered=variant in MARKED)
    guest = _image_of(group, notify)
    code = None
    if group.tier != "interpreted":
        from kilotwin.programs.translate.translation import translated

        code = translated(guest.file, notify, at_once=at_once)
    if code is None:
        return guest
    return replace(guest, file=code.file, optimised=code.optimised)


def settled(experiment: Experiment, notify: Notify = lambda _: None) -> Experiment:
    """The same, with chips for robots whose program has to do with what only a chip has, where the
    processor is left to us. `notify` gets a line of each such program, with file and line."""
    groups = tuple(_settled(experiment, group, notify) for group in experiment.groups)
    return experiment if groups == experiment.groups else replace(experiment, groups=groups)


def _settled(experiment: Experiment, group: Group, notify: Notify) -> Group:
    if group.tier != "translated":
        return group
    # Chips see pulses, which not every medium has.
    on_chip = group.is_chosen and MEDIA[experiment.keys.medium.kind].has_pulses
    for what in _beyond_translation(group.program):
        if on_chip:
            notify(f'{what} is for a chip: {group.program.written} runs with cpu = "avr"')
            return group.on_chip(experiment.keys)
        notify(f'{what} needs cpu = "avr": it does nothing where a program runs translated')
    return group


@functools.lru_cache(maxsize=64)
def _beyond_translation(program: Program) -> tuple[str, ...]:
    from kilotwin import _emulator
    from kilotwin.programs.image.image import build_image
    from kilotwin.programs.translate.needs_chip import needs_chip

    image = build_image(program)
    flash, _ = _emulator.flash_image(str(image.elf))
    return tuple(needs_chip(program, flash, image.elf, image.objects("program")))


def build_all(
    experiment: Experiment,
    notify: Notify = lambda _: None,
    *,
    variant: Variant = "plain",
    sanitized: bool = False,
) -> tuple[list[Guest], Guest | None]:
    """The guests of each group of robots, and of the modules, if there are any."""
    guests = [
        build_group(group, notify, variant=variant, sanitized=sanitized)
        for group in experiment.groups
    ]
    modules = experiment.modules
    if modules is None:
        return guests, None
    return guests, build_group(modules, notify, variant=variant, sanitized=sanitized)


def symbols_of(guests: Sequence[Guest], modules: Guest | None) -> tuple[Path | None, ...]:
    """Debug information of the guests, then of the modules'."""
    return tuple(guest.symbols for guest in (*guests, *([modules] if modules else [])))


def _image_of(group: Group, notify: Notify) -> Guest:
    program = group.program
    if program.sources:
        from kilotwin.programs.image.image import build_image

        image = build_image(program, notify)
        guest = Guest(program.name, image.hex, image.key, image.compiler, image.elf)
    else:
        guest = Guest(program.name, program.path, _key_of(program.path), "")
    if group.boot_loader is None:
        return guest
    from kilotwin.programs.image.boot_loader import with_boot_loader

    whole = with_boot_loader(guest.file, group.boot_loader, notify)
    return replace(guest, file=whole, key=_key_of(whole))


def _key_of(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:_KEY_CHARACTERS]
