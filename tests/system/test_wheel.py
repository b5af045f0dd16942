"""A wheel holds all that is needed to build and run a robot program, without the source tree."""

import subprocess
import sys
import sysconfig
from pathlib import Path

from .conftest import ROOT, block

# Debian's Python does not read the .pth file that leads to the source tree.
BASE_PYTHON = sys._base_executable  # type: ignore[attr-defined]


def test_an_installed_wheel_runs_a_program(environment: dict[str, str], tmp_path: Path) -> None:
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    options = ["--quiet", "--no-deps", "--no-build-isolation"]
    # The engine's objects, which are built already, are taken.
    options += [f"--config-settings=build-dir={ROOT / 'build/engine'}"]
    installed, locked = tmp_path / "installed", sysconfig.get_path("purelib")
    subprocess.run([*pip, "install", *options, "--target", installed, ROOT], check=True)

    readme = (ROOT / "README.md").read_text()
    (tmp_path / "my.c").write_text(block(readme, "c"))
    (tmp_path / "my.toml").write_text(block(readme, "toml"))

    def python(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [BASE_PYTHON, "-c", code, *arguments],
            cwd=tmp_path,
            env={**environment, "PYTHONPATH": f"{installed}:{locked}"},
            capture_output=True,
            text=True,
            check=False,
        )

    command = "from kilotwin.commands.cli import main; main()"
    done = python(command, "run", "my.toml", "--out", "run", "--json")
    assert done.returncode == 0, done.stderr
    assert '"robots": 10' in done.stdout
    # So does an image for the robot, with what its linker needs.
    done = python(command, "build", "my.c", "--hex", "my.hex", "--json")
    assert done.returncode == 0, done.stderr
    assert '"build_id": "robot my avr-gcc-' in done.stdout
    # And one for a module, with the C of the CAN frames, which was made in the build.
    sites = ("build", "kilogrid_modules/sites", "--for", "module", "--hex", "sites.hex", "--json")
    done = python(command, *sites)
    assert done.returncode == 0, done.stderr
    assert '"build_id": "module sites avr-gcc-' in done.stdout
    # And the boot loaders that go in with them.
    code = "from kilotwin.programs.image.boot_loader import build_boot_loader as b"
    done = python(f"{code}; print(b('robot').exists(), b('module').exists())")
    assert done.stdout.strip() == "True True", done.stderr
    # The CAN frames' description is not Python either.
    frame = "from kilotwin.table.can import protocol; print(protocol.to_module('MODULE_RUN').hex())"
    done = python(frame)
    assert done.stdout.strip() == "0d00000000000000", done.stderr
    # Nor is the viewer's page.
    page = "from kilotwin.view import server; print(sorted(f.name for f in server._PAGE.iterdir()))"
    done = python(page)
    assert done.stdout.strip() == "['index.html', 'viewer-style.css', 'viewer.js']", done.stderr
    # Nor are the files of a lab's repository, some of which are hidden ones.
    done = python(command, "new", "lab", "--json", "--from", "ssh://git@example.org/kilotwin.git")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "lab/.github/workflows/robots.yml").exists()
    assert (tmp_path / "lab/spread.c").exists()
