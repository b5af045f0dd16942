"""An emulated table that waits on CAN buses, for tests of what a host does with it."""

import re
import subprocess
import time
from pathlib import Path

from .conftest import KILOTWIN, ROOT


class Table:
    """`kilotwin serve world` in a process of its own."""

    def __init__(
        self, experiment: str | Path, folder: Path, environment: dict[str, str], *words: str
    ) -> None:
        self._said = (folder / "serve.txt").open("w")
        self.out = folder / "served"
        self.process = subprocess.Popen(
            [KILOTWIN, "serve", "world", experiment, "--out", self.out, *words],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
        )
        self.bus = f"socketcand:127.0.0.1:{self._port()}"

    def _port(self) -> str:
        deadline = time.monotonic() + 600
        while time.monotonic() < deadline:
            said = Path(self._said.name).read_text()
            if found := re.search(r"port (\d+)", said):
                return found[1]
            assert self.process.poll() is None, said
            time.sleep(0.05)
        raise AssertionError("the table does not say its port")

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._said.close()
