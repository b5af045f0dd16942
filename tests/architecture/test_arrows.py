"""Dependencies point one way: firmware <- emulator <- host tools. A forbidden arrow fails here.

The rules are functions of a tree, so that each of them is also tried on a small bad tree.
"""

import re
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from .tree import C_SUFFIXES, NOT_SOURCES, ROOT, imports, includes, owners_of, plant, sources, texts

# Headers that firmware may find besides its own files: the C library as avr-libc has it.
AVR_LIBC = re.compile(
    r"(std(int|bool|def|lib|io|arg)|string|ctype|limits|inttypes|math|float|assert|errno)\.h"
    r"|(avr|util)/\w+\.h"
)

# Folders that a folder may include from, besides itself.
PUBLIC_HEADERS = (
    "firmware/kilolib/include/",
    "firmware/kilogrid/include/",
    "firmware/aggregation/wire.h",
)
ALLOWED = {
    "firmware": (),
    # A module's runtime shares frames and distances with a robot's, its boot loader the store, the
    # ways in and out, and the time.
    "kilogrid_modules": (
        *PUBLIC_HEADERS,
        "firmware/bootloader/avr/clock.h",
        "firmware/bootloader/avr/entry.h",
        "firmware/bootloader/core/",
        "firmware/kilolib/core/",
        "firmware/kilolib/avr/frame_sender.h",
        "firmware/kilolib/avr/gains_read.h",
    ),
    "emulator": (
        *PUBLIC_HEADERS,
        "firmware/kilolib/core/",
        "kilogrid_modules/runtime/core/",
        "kilogrid_modules/runtime/include/",
        "kilogrid_modules/protocol/",
    ),
}
# Headers that stay behind one wall: pattern of the include, files that may use it, why.
WALLS = [
    (re.compile(r"box2d/"), re.compile(r"emulator/physics/contact/box2d_solver\.cpp"), "Box2D"),
    (
        re.compile(r"simavr/"),
        re.compile(
            r"emulator/avr/chip/"
            r"(microcontroller|idle_loop|quiet_timers|self_programming|translated_core)\.cpp"
        ),
        "simavr",
    ),
    (re.compile(r"nanobind/|Python\.h"), re.compile(r"emulator/python/.*"), "Python"),
]


def bad_includes(root: Path) -> list[str]:
    found = []
    files = [path.as_posix() for path in sources(root, C_SUFFIXES)]
    for path in map(Path, files):
        part = path.parts[0]
        if part not in ALLOWED:
            continue
        allowed = (f"{part}/", *ALLOWED[part])
        for name, quoted in includes(root / path):
            owners = owners_of(files, path, name, quoted)
            # A C library name is the C library, whatever stand-in the emulator has for it.
            library = not quoted and AVR_LIBC.fullmatch(name)
            if owners and not library and not any(o.startswith(allowed) for o in owners):
                found.append(f"{path}: includes {owners[0]}, which {part} must not know")
            if part == "firmware" and not owners and not library:
                found.append(f"{path}: includes {name}, which a robot does not have")
            for wall, insiders, what in WALLS:
                if wall.match(name) and not insiders.fullmatch(path.as_posix()):
                    found.append(f"{path}: includes {name}; {what} stays in {insiders.pattern}")
    return found


# Packages that are not imported under the name they are installed by.
IMPORTED_AS = {
    "pillow": "PIL",
    "pyelftools": "elftools",
    "pyserial": "serial",
    "python_can": "can",
}


def declared_packages(root: Path) -> set[str]:
    """The packages that pyproject.toml says kilotwin needs, to be built too, or has as extras."""
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    project = settings["project"]
    extras = project.get("optional-dependencies", {}).values()
    named = [*project["dependencies"], *(name for extra in extras for name in extra)]
    named += settings.get("build-system", {}).get("requires", [])
    found = {re.split(r"[ <>=~!\[;]", name)[0].replace("-", "_") for name in named}
    return found - {project.get("name")}


def bad_imports(root: Path) -> list[str]:
    declared = {IMPORTED_AS.get(name, name) for name in declared_packages(root)}
    allowed = {"kilotwin", *sys.stdlib_module_names, *declared}
    return [
        f"{path}: imports {name}, which is neither kilotwin, standard library nor declared"
        for path in sources(root, {".py"})
        if path.parts[0] == "host_tools"
        for name in imports(root / path)
        if name not in allowed
    ]


# A path that exists on one machine only, and the places a package client is set to.
MACHINE_PATH = re.compile(r"(?<![\w.~$})/-])/(?:home|root|Users|work|opt|mnt|srv|media)/\w")
REGISTRY = re.compile(
    r"\b(?:pypi|pythonhosted|npmjs|crates|golang|maven)\.(?:org|com|io)\b"
    r"|\bdeb\.debian\b|--(?:extra-)?index-url|--find-links"
)


def bad_words(root: Path) -> list[str]:
    found = []
    for path, text in texts(root):
        for number, line in enumerate(text.splitlines(), 1):
            if path.as_posix() == "tests/architecture/test_arrows.py":
                continue
            if match := MACHINE_PATH.search(line):
                found.append(f"{path}:{number}: {match[0]}... is a path of one machine")
            if match := REGISTRY.search(line):
                found.append(f"{path}:{number}: {match[0]} names a package registry")
    return found


RULES = [bad_includes, bad_imports, bad_words]


@pytest.mark.parametrize("rule", RULES)
def test_the_tree_has_no_forbidden_arrow(rule: Callable[[Path], list[str]]) -> None:
    assert rule(ROOT) == []


def test_the_walk_sees_the_tree() -> None:
    """An empty walk would find nothing wrong."""
    seen = {path.parts[0] for path in sources(ROOT, C_SUFFIXES | {".py"})}
    assert {"firmware", "emulator", "host_tools", "tests"} <= seen
    assert not NOT_SOURCES & seen


def test_every_declared_package_is_locked() -> None:
    locks = (ROOT / "requirements").glob("*.lock")
    lock = "".join(file.read_text(encoding="utf-8") for file in locks)
    locked = {name.replace("-", "_") for name in re.findall(r"^([a-z0-9-]+)==", lock, re.MULTILINE)}
    assert {name.lower() for name in declared_packages(ROOT)} <= locked


GOOD_TREE = {
    "pyproject.toml": '[project]\ndependencies = ["numpy>=2", "pyarrow"]\n',
    "firmware/kilolib/include/kilolib.h": "#include <stdint.h>\n",
    "firmware/aggregation/wire.h": "#include <stdbool.h>\n",
    "firmware/aggregation/pfsm.h": "#include <stdint.h>\n",
    "firmware/aggregation/pfsm.c": '#include "pfsm.h"\n#include <kilolib.h>\n#include <avr/io.h>\n',
    "emulator/robots/native/include/avr/io.h": "#include <stdint.h>\n",
    "emulator/physics/world.h": "#include <vector>\n",
    "emulator/physics/contact/box2d_solver.cpp": '#include "physics/world.h"\n'
    "#include <box2d/box2d.h>\n",
    "emulator/infrared/channel.cpp": '#include "world.h"\n#include <kilolib.h>\n'
    '#include "wire.h"\n',
    "emulator/python/module.cpp": '#include "../physics/world.h"\n#include <nanobind/nanobind.h>\n',
    "host_tools/kilotwin/run.py": "import json\nimport numpy as np\nfrom . import plot\n"
    "from kilotwin import _emulator\n",
}


@pytest.mark.parametrize("rule", RULES)
def test_a_good_tree_passes(rule: Callable[[Path], list[str]], tmp_path: Path) -> None:
    assert rule(plant(tmp_path, GOOD_TREE)) == []


@pytest.mark.parametrize(
    ("rule", "name", "text"),
    [
        (bad_includes, "firmware/aggregation/walk.c", '#include "emulator/physics/world.h"\n'),
        (bad_includes, "firmware/aggregation/walk.c", "#include <world.h>\n"),
        (bad_includes, "firmware/aggregation/walk.c", "#include <pthread.h>\n"),
        (bad_includes, "firmware/aggregation/walk.c", '#  include "world.h" // why\n'),
        (bad_includes, "kilogrid_modules/sites/cell.c", "#include <physics/world.h>\n"),
        (bad_includes, "kilogrid_modules/sites/cell.c", "#include <pfsm.h>\n"),
        (bad_includes, "emulator/infrared/x.cpp", '#include "firmware/aggregation/pfsm.h"\n'),
        (bad_includes, "emulator/infrared/x.cpp", '#include "../../firmware/aggregation/pfsm.h"\n'),
        (bad_includes, "emulator/physics/world.h", "#include <box2d/types.h>\n"),
        (bad_includes, "emulator/avr/boards/robot_board.h", "#include <simavr/sim_avr.h>\n"),
        (bad_includes, "emulator/base/clock.cpp", "#include <nanobind/ndarray.h>\n"),
        (bad_imports, "host_tools/kilotwin/view.py", "import requests\n"),
        (
            bad_imports,
            "host_tools/kilotwin/view.py",
            "def f():\n    import scipy.stats\n",
        ),
        (bad_imports, "host_tools/kilotwin/view.py", "from tests.system import conftest\n"),
        (bad_words, "docs/quickstart.md", "cd /" + "home/ada/kilotwin\n"),
        (bad_words, "Makefile", "CC = /" + "opt/avr/bin/avr-gcc\n"),
        (bad_words, "requirements/run.lock", "--index" + "-url https://example.org/simple\n"),
        (bad_words, "README.md", "see https://" + "pypi" + ".org/project/kilotwin\n"),
    ],
)
def test_a_planted_bad_file_is_caught(
    rule: Callable[[Path], list[str]], name: str, text: str, tmp_path: Path
) -> None:
    plant(tmp_path, GOOD_TREE)
    plant(tmp_path, {name: GOOD_TREE.get(name, "") + text})
    found = rule(tmp_path)
    assert len(found) == 1, found
    assert found[0].startswith(name)
