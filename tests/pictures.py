"""Makes pictures that README and the documents show anew, in docs/images: of a run of the paper's
experiment map.png, timeline.png, run.gif and viewer.png; of docs/class.md class-timeline.png and
class-map.png; of a million robots waves.gif, which takes some ten minutes.

    .venv/bin/python -m tests.pictures
"""

import os
import re
import subprocess
import tempfile
from pathlib import Path

from .system.browser import chromium, go_to, new_page, open_viewer, viewer
from .system.conftest import KILOTWIN, ROOT, SIMPLIFIED

IMAGES = ROOT / "docs/images"
# As README and docs/viewer.md say beside them.
VIDEO = ("--to", "5000", "--speed", "1000", "--width", "360")
MANY = ("swarm.size=1000000", "arena.width_m=50", "arena.height_m=50")
FAR = ("--from", "2", "--zoom", "0.5", "--speed", "26", "--width", "360")
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
        teach(Path(scratch))
        step_many(Path(scratch) / "waves", IMAGES / "waves.gif")


def teach(scratch: Path) -> None:
    """The pictures of docs/class.md, by its commands."""
    experiment, program = scratch / "homework/spread.toml", scratch / "homework/spread.c"
    kilotwin("new", scratch / "homework", "--from", "git+https://example.org/kilotwin.git")
    walks = program.read_text()
    program.write_text(re.sub(r"^ *(spinup_motors|set_motors)\(.*\n", "", walks, flags=re.M))
    kilotwin("run", experiment, "--out", scratch / "standing")
    kilotwin("plot", "timeline", scratch / "standing", "-o", IMAGES / "class-timeline.png")
    program.write_text(walks)
    mute = 'faults.robot=[{kind="mute", at_s=0, share=0.5}]'
    kilotwin("run", experiment, "--set", mute, "--out", scratch / "mute")
    kilotwin("plot", "map", scratch / "mute", "-o", IMAGES / "class-map.png")


def step_many(run: Path, target: Path) -> None:
    """Waves among a million robots, by README's commands."""
    table = (word for setting in MANY for word in ("--set", setting))
    kilotwin("run", "experiments/waves/waves.toml", "--out", run, *table)
    kilotwin("plot", "video", run, "-o", target, *FAR)


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
