"""Makes the pictures that README and the documents show of the paper's experiment anew, of one run:
map.png, timeline.png, run.gif and viewer.png in docs/images.

    .venv/bin/python -m tests.pictures
"""

import os
import subprocess
import tempfile
from pathlib import Path

from .system.browser import chromium, go_to, new_page, open_viewer, viewer
from .system.conftest import KILOTWIN, ROOT, SIMPLIFIED

IMAGES = ROOT / "docs/images"
# As README and docs/viewer.md say beside them.
VIDEO = ("--to", "5000", "--speed", "1000", "--width", "360")
TIME_S, ROBOT = 1500, 3


def main() -> None:
    """Ends with a trace if a command fails."""
    with tempfile.TemporaryDirectory(prefix="kilotwin-") as scratch:
        run = Path(scratch) / "first"
        kilotwin("run", SIMPLIFIED, "--out", run)
        kilotwin("plot", "map", run, "-o", IMAGES / "map.png")
        kilotwin("plot", "timeline", run, "-o", IMAGES / "timeline.png")
        kilotwin("plot", "video", run, "-o", IMAGES / "run.gif", *VIDEO)
        photograph(run, IMAGES / "viewer.png")


def kilotwin(*words: Path | str) -> None:
    """Types the command, in the project's folder."""
    subprocess.run([KILOTWIN, *map(str, words)], cwd=ROOT, check=True)


def photograph(run: Path, target: Path) -> None:
    """The viewer's page in colours of states, with a robot chosen."""
    with (
        viewer({**os.environ}, run) as address,
        chromium() as browser,
        new_page(browser, []) as page,
    ):
        open_viewer(page, address)
        for key in ("s", *ROBOT * "]"):
            page.keyboard.press(key)
        go_to(page, TIME_S)
        page.wait_for_selector("#inspector #states")
        page.screenshot(path=target)


if __name__ == "__main__":
    main()
