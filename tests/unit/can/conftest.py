"""The protocol's C, compiled as a module's dialect asks and called through ctypes."""

import ctypes
import subprocess
from pathlib import Path

import pytest

from kilotwin.files import resources
from kilotwin.programs.image.flags import avr_words

ROOT = Path(__file__).parents[3]
PROTOCOL = ROOT / "kilogrid_modules" / "protocol"
MADE = resources.made()
SOURCES = [PROTOCOL / "address.c", MADE / "kilogrid_can.c", PROTOCOL / "transfer.c"]
INCLUDES = [f"-I{PROTOCOL}", f"-I{MADE}"]
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wpedantic", "-Werror"]
DIALECT = [word for word in avr_words("AVR_DIALECT") if word != "-funsigned-bitfields"]


@pytest.fixture(scope="session")
def protocol_c(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    library = tmp_path_factory.mktemp("protocol") / "libprotocol.so"
    options = [*DIALECT, *WARNINGS, *INCLUDES, "-shared", "-fPIC", "-o", str(library)]
    subprocess.run(["cc", *options, *map(str, SOURCES)], check=True)
    loaded = ctypes.CDLL(str(library))
    for name in ("dlc_to_module", "dlc_to_host", "least_dlc_to_module", "least_dlc_to_host"):
        getattr(loaded, f"kilogrid_{name}").restype = ctypes.c_uint8
    return loaded
