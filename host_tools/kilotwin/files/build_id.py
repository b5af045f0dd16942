"""The build id: what an image was made of, readable from its flash.

Behind everything else an image has a text of ASCII, its length in one byte, and the mark "KTID".
The text is four words: `robot` or `module`, the program, the compiler, kilotwin, as in

    robot walker avr-gcc-5.4.0 kilotwin-0.2.0

Equal programs, compilers and versions have equal ids: no time and no path is in it. What tells two
versions of one program apart is the image id (files/flash_image.py). firmware/build_id.c puts the
text there; firmware/image.mk and programs/image/image.py compose it.
"""

import re
from dataclasses import dataclass
from typing import Literal, get_args

Target = Literal["robot", "module"]
"""Kinds of board that an image can be for: its runtime drives the circuit of one."""

_MARK = b"KTID"
_NOT_IN_A_NAME = re.compile(rb"[^A-Za-z0-9._+-]")
_MOST_OF_A_NAME = 40
_TEXT = re.compile(rb"([a-z]+) ([!-~]+) ([!-~]+) kilotwin-([!-~]+)")


@dataclass(frozen=True)
class BuildId:
    """The four words. `program` is its name with underscores for all but letters, digits, ._+-."""

    target: Target
    program: str
    compiler: str
    kilotwin: str

    def __str__(self) -> str:
        return f"{self.target} {self.program} {self.compiler} kilotwin-{self.kilotwin}"


def build_id(target: Target, program: str, compiler_version: str, kilotwin_version: str) -> BuildId:
    """The id of an image of `program`; `compiler_version` is avr-gcc's line of --version."""
    name = _NOT_IN_A_NAME.sub(b"_", program.encode())[:_MOST_OF_A_NAME].decode()
    return BuildId(
        target, name, f"avr-gcc-{compiler_version.rsplit(maxsplit=1)[-1]}", kilotwin_version
    )


def find_build_id(content: bytes) -> BuildId | None:
    """The last one in the bytes of an image; None if there is none, as in those of others."""
    end = len(content)
    while (mark := content.rfind(_MARK, 0, end)) > 0:
        length = content[mark - 1]
        begin = mark - 1 - length
        words = _TEXT.fullmatch(content, begin, mark - 1) if begin >= 0 else None
        if words is not None:
            target, program, compiler, kilotwin = (word.decode() for word in words.groups())
            for known in get_args(Target):
                if target == known:
                    return BuildId(known, program, compiler, kilotwin)
        end = mark
    return None
