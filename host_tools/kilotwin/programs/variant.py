"""Variants of built programs: additions, beside which they do what the plain one does."""

from typing import Literal

Variant = Literal["plain", "covered", "hunted", "watched", "debugged"]
"""covered: it marks what runs (programs/coverage/marks.py), each turn of a loop. hunted: it marks
what runs but for turns that are left out, and where interrupts come. watched: it tells the engine
what it stores (emulator/robots/trail.h). debugged: it says before each instruction that it begins
(session/debug). Of these a native program knows the first two, which are one there."""

MARKED: frozenset[Variant] = frozenset(("covered", "hunted"))
"""Those that mark what runs."""
