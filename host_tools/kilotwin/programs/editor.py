"""Files by which an editor finds kilolib.h: of clangd, and of VS Code's C extension.

They name folders of this computer, so a repository ignores them, and each clone writes its own.
"""

import json
from pathlib import Path

from kilotwin.errors import InputError, cause_of
from kilotwin.experiment.programs import Api
from kilotwin.files import resources
from kilotwin.programs.apis import APIS
from kilotwin.programs.image.flags import avr_words, clock_define

_LIBC = "emulator/robots/native/include"
"""The AVR's C library as far as a PC's compiler can read it."""
_GCC_ONLY = {"-funsigned-bitfields"}  # clangd knows no such word
_CHIP = "-D__AVR_ATmega328P__=1"


def write(folder: Path, api: Api) -> list[Path]:
    """Writes them into the folder of programs for that API; returns them. InputError if that
    cannot be."""
    texts = {
        Path("compile_flags.txt"): "\n".join(_flags(api)) + "\n",
        Path(".clangd"): "Diagnostics:\n  UnusedIncludes: None\n",
        Path(".vscode/c_cpp_properties.json"): json.dumps(_vs_code(api), indent=2) + "\n",
    }
    try:
        for file, text in texts.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder}: {cause_of(error)}; name a folder of yours") from None
    return sorted(texts)


def _flags(api: Api) -> list[str]:
    dialect = [word for word in avr_words("AVR_DIALECT") if word not in _GCC_ONLY]
    includes = APIS[api].includes(libc=[resources.path(_LIBC)])
    return ["-xc", *dialect, clock_define(), _CHIP, *includes]


def _vs_code(api: Api) -> dict[str, object]:
    words = _flags(api)
    standard = next(word.removeprefix("-std=") for word in words if word.startswith("-std="))
    return {
        "version": 4,
        "configurations": [
            {
                "name": "Kilobot",
                "includePath": ["${workspaceFolder}/**", *_values(words, "-I")],
                "defines": _values(words, "-D"),
                "cStandard": standard,
                "compilerPath": "",
            }
        ],
    }


def _values(words: list[str], option: str) -> list[str]:
    return [word.removeprefix(option) for word in words if word.startswith(option)]
