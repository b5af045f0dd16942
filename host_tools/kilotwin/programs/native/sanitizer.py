"""Guests that look for what the C standard leaves undefined while they run (--sanitize).

By the checks of gcc and clang, whose findings the engine takes
(emulator/robots/native/side/undefined.c).
An `int` has 32 bits here and 16 on the robot: `kilotwin port` looks for what that changes.
"""

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.programs.native.guest import compiler_version, find_compiler

SANITIZED = Setting(("swarm", "cpu"), "native", "--sanitize")
"""The setting that runs programs so that it is seen."""

ONE_OF_BOTH = (
    "--sanitize runs programs natively, and --coverage by their machine code; give one of them"
)
"""The error of both options."""

# Without alignment: on the robot every address will do for every type.
_CHECKS = (
    "shift",
    "signed-integer-overflow",
    "integer-divide-by-zero",
    "float-cast-overflow",
    "null",
    "object-size",
    "pointer-overflow",
    "vla-bound",
    "bool",
    "enum",
    "builtin",
    "nonnull-attribute",
    "unreachable",
)
_BOUNDS, _BOUNDS_OF_CLANG = "bounds-strict", "array-bounds"


def flags() -> list[str]:
    """Those of the compiler that builds guests."""
    clang = "clang" in compiler_version(find_compiler())
    checks = [_BOUNDS_OF_CLANG if clang else _BOUNDS, *_CHECKS]
    return [f"-fsanitize={','.join(checks)}"]


def check_sanitized(experiment: Experiment) -> None:
    """InputError if the robots of a group do not run natively."""
    for group in experiment.groups:
        if group.tier != "native":
            raise InputError(
                f"--sanitize: {group.program.written} runs by its machine code; leave its cpu "
                'out, or set it to "native"'
            )
