"""README's two commands work on a machine that has nothing but git and make."""

import os
import subprocess
import sys

import pytest

from .conftest import ROOT


@pytest.mark.long
@pytest.mark.skipif(os.getuid() != 0, reason="debootstrap and chroot want root")
def test_readmes_commands_pass_on_a_bare_debian_by_root_and_by_a_user() -> None:
    done = subprocess.run([sys.executable, ROOT / "tests/bare.py"], check=False)
    assert done.returncode == 0
