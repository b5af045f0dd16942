"""How far robots' programs and the compiler that builds them are confined (docs/security.md)."""

import os
from typing import Literal, get_args

from kilotwin.errors import InputError

Confine = Literal["auto", "require", "off"]
"""auto: as far as the kernel can; require: wholly, or not at all; off: programs are trusted."""

VARIABLE = "KILOTWIN_CONFINE"

SINGLE_THREADED = {
    "OPENBLAS_NUM_THREADS": "1",  # threads that are there already keep their files
    "OMP_NUM_THREADS": "1",
    "ARROW_DEFAULT_MEMORY_POOL": "system",  # others take a gigabyte in advance
    "JE_ARROW_MALLOC_CONF": "background_thread:false",  # of a pool that is not even used
}
"""Variables of a process that is to be confined, or forked and then confined."""


def mode() -> Confine:
    """By KILOTWIN_CONFINE, which options set for this process and those it starts."""
    wanted = os.environ.get(VARIABLE, "auto")
    for known in get_args(Confine):
        if wanted == known:
            found: Confine = known
            return found
    raise InputError(f"{VARIABLE}={wanted}: must be one of {', '.join(get_args(Confine))}")


def choose(confine: Confine | None, trust: bool) -> None:
    """Takes what was typed, for this process and those it starts."""
    if trust and confine not in (None, "off"):
        raise InputError(f"--trust and --confine={confine}: give one of them")
    if trust or confine is not None:
        os.environ[VARIABLE] = "off" if trust else str(confine)
    mode()
