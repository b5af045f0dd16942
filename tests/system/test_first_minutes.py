"""A newcomer's first ten minutes: types what README and the quickstart say, in their order, and
looks at what is printed and at the page."""

import re
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page

from kilotwin.runs.reader import Run

from ..processes import serving
from ..steering import steer
from .browser import chromium, comes, new_page, open_viewer, viewer
from .conftest import KILOTWIN, ROOT, Kilotwin, block
from .test_view import counts, picture

pytestmark = pytest.mark.waits

README = (ROOT / "README.md").read_text()
QUICKSTART = (ROOT / "docs/quickstart.md").read_text()
SHORT = ("--set", "duration_s=300")
"""The paper's run lasts 5,000 s and more; a newcomer waits, a test need not."""


def commands(text: str, heading: str) -> list[list[str]]:
    """The `kilotwin` commands of a section's indented blocks, without their comments."""
    section = text.split(f"## {heading}\n")[1].split("\n## ", maxsplit=1)[0]
    lines = re.findall(r"^    (?:\.venv/bin/)?(kilotwin .*)$", section, re.MULTILINE)
    assert lines, heading
    return [shlex.split(line, comments=True)[1:] for line in lines]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty folder with README's two files in it."""
    folder = tmp_path_factory.mktemp("first")
    (folder / "my.c").write_text(block(README, "c"))
    (folder / "my.toml").write_text(block(README, "toml"))
    return folder


def coloured(page: Page) -> np.ndarray:
    """Where the picture has the colours of README's program, red and green."""
    seen = picture(page).astype(int)
    return np.asarray((seen[..., :2].max(axis=2) > 200) & (seen[..., :2].min(axis=2) < 60))


def test_readmes_program_is_seen_moving_in_the_first_seconds_and_stays_to_be_looked_at(
    folder: Path, environment: dict[str, str]
) -> None:
    run, view, *plots = commands(README, "Run your own Kilobot program")[:4]
    assert "--view" in run
    problems: list[str] = []
    with (
        serving([KILOTWIN, *run, "--no-browser"], "view: ", cwd=folder, env=environment) as (
            process,
            address,
        ),
        chromium() as browser,
        new_page(browser, problems) as page,
    ):
        # Slower than it is typed: a page on a busy machine would see the end alone.
        steer(address, do="speed", speed=0.5)
        open_viewer(page, address)
        # On two busy cores robots move 4 s after the command, 12 s where the program is compiled
        # first; the bound is PATIENCE_MS.
        comes(page, lambda: coloured(page).sum() > 100)
        before = coloured(page)
        comes(page, lambda: np.any(coloured(page) != before))
        assert page.is_visible("#steering")
        steer(address, do="speed")
        comes(page, lambda: page.is_visible('#steering:has-text("is over")'))
        comes(page, lambda: sum(counts(page).values()) == 10)
        assert set(counts(page)) <= {"RGB(0,0,0)", "RGB(0,3,0)", "RGB(3,0,0)"}
        page.close()
        out, _ = process.communicate(timeout=600)
    assert problems == []
    assert process.returncode == 0
    lines = out.splitlines()
    assert re.search(r"^  robots +(\d+ RGB\([03],[03],0\)(, )?)+$", out, re.MULTILINE)
    assert "resting" not in out
    assert lines[-1] == "to have it as a video, type: kilotwin plot video runs/my -o run.gif"

    with (
        viewer(environment, folder / view[-1]) as address,
        chromium() as browser,
        new_page(browser, problems) as page,
    ):
        open_viewer(page, address)
        page.keyboard.press("End")
        comes(page, lambda: sum(counts(page).values()) == 10)
        page.goto("about:blank")
    assert problems == []
    for words in plots:
        subprocess.run([KILOTWIN, *words], cwd=folder, env=environment, check=True)
        assert (folder / words[words.index("-o") + 1]).stat().st_size > 1000


def test_the_line_that_a_run_ends_with_is_a_command_that_works(
    folder: Path, kilotwin: Kilotwin, environment: dict[str, str]
) -> None:
    out = kilotwin("run", "my.toml", "--out", "runs/a b", "--no-twin", folder=folder).stdout
    begin = "to see it, type: kilotwin view "
    assert out.splitlines()[-1].startswith(begin)
    (named,) = shlex.split(out.splitlines()[-1].removeprefix(begin))
    with (
        viewer(environment, folder / named) as address,
        chromium() as browser,
        new_page(browser, []) as page,
    ):
        open_viewer(page, address)
        page.goto("about:blank")


def test_the_quickstarts_commands_leave_what_it_says(tmp_path: Path, kilotwin: Kilotwin) -> None:
    kilotwin("doctor")
    run, view, plot, film = commands(QUICKSTART, "2. Run the paper's experiment")[:4]
    out = tmp_path / "first"

    def here(words: list[str]) -> list[str]:
        return [word.replace("runs/first", str(out)) for word in words]

    said = kilotwin(*here(run), *SHORT, "--no-twin").stdout
    assert "resting on black" in said
    assert "not resting" in said
    assert said.splitlines()[-1] == f"to see it, type: kilotwin view {out}"
    assert {"map.png", "timeline.png"} <= {file.name for file in out.iterdir()}
    assert view == ["view", "runs/first"]
    for words in (plot, film):
        target = tmp_path / words[-1]
        kilotwin(*here(words[:-1]), target)
        assert target.stat().st_size > 1000

    (changed,) = commands(QUICKSTART, "3. Change something")
    kilotwin(*changed, *SHORT, "--no-twin", "--out", tmp_path / "changed")
    experiment = Run.open(tmp_path / "changed").experiment
    assert experiment.seed == 5
    assert experiment.swarm.informed == 0.1


def test_the_file_that_the_quickstart_adds_names_states_in_summary_and_page(
    folder: Path, kilotwin: Kilotwin
) -> None:
    states = re.search(r"^  ```toml\n(.*?)^  ```", QUICKSTART, re.MULTILINE | re.DOTALL)
    assert states
    text = (folder / "my.toml").read_text() + "\n" + states[1].replace("\n  ", "\n").lstrip()
    (folder / "named.toml").write_text(text)
    out = kilotwin("run", "named.toml", "--out", "runs/named", "--no-twin", folder=folder).stdout
    assert re.search(r"^  robots +\d+ (moving|turning)", out, re.MULTILINE)
