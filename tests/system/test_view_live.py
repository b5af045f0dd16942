"""A run is seen in a real browser as it goes, and a viewer changes nothing in it."""

import contextlib
import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser
from websockets.sync.client import connect

from kilotwin.runs.reader import Run

from .browser import chromium, new_page, open_viewer
from .conftest import KILOTWIN, WALKER
from .test_view import LIVE

Watched = tuple["subprocess.Popen[str]", str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the experiment is."""
    folder = tmp_path_factory.mktemp("live")
    (folder / "live.toml").write_text(LIVE)
    (folder / "walker.c").write_text(WALKER)
    return folder


@pytest.fixture
def watched(folder: Path, environment: dict[str, str]) -> Iterator[Callable[..., Watched]]:
    """Starts `kilotwin run live.toml --view ...`: the process, and the page's address."""
    with contextlib.ExitStack() as stack:

        def start(out: str, *words: str) -> Watched:
            command = [KILOTWIN, "run", "live.toml", "--view", "--no-browser", "--no-twin"]
            process = stack.enter_context(
                subprocess.Popen(
                    [*map(str, command), "--json", "--out", out, *words],
                    cwd=folder,
                    env=environment,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                )
            )
            stack.callback(process.kill)
            assert process.stderr is not None
            for line in process.stderr:
                if line.startswith("view: "):
                    return process, line.removeprefix("view: ").strip()
            raise AssertionError("no address")

        yield start


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def alone(folder: Path, environment: dict[str, str]) -> str:
    """The result hash of 20,000 s without a viewer."""
    words = ["--no-twin", "--json", "--set", "duration_s=20000", "--out", "alone"]
    done = subprocess.run(
        [KILOTWIN, "run", "live.toml", *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        check=True,
    )
    return str(json.loads(done.stdout)["result_hash"])


def test_a_run_is_seen_as_it_goes_and_stays_until_its_page_is_closed(
    watched: Callable[..., Watched], browser: Browser, alone: str
) -> None:
    process, address = watched("seen", "--set", "duration_s=20000")
    problems: list[str] = []
    with new_page(browser, problems) as page:
        open_viewer(page, address)
        times = set()
        for _ in range(200):
            times.add(page.input_value("#time"))
            if "finished" in page.inner_text("#title"):
                break
            page.wait_for_timeout(50)
        assert len(times) > 4
        assert page.input_value("#time") == "20000.014"
        page.wait_for_timeout(500)
        assert process.poll() is None
    out, _ = process.communicate(timeout=30)
    assert process.returncode == 0
    assert json.loads(out)["result_hash"] == alone
    assert problems == []


def test_a_browser_that_reads_nothing_changes_nothing(
    watched: Callable[..., Watched], alone: str, folder: Path
) -> None:
    process, address = watched("unread", "--set", "duration_s=20000")
    moments = address.replace("http", "ws") + "moments"
    with connect(moments, max_queue=1) as socket:
        for _ in range(1000):
            socket.send("look")
        assert process.stdout is not None
        summary = json.loads(process.stdout.readline())
    assert summary["result_hash"] == alone
    assert Run.open(folder / "unread").manifest["status"] == "finished"
    process.terminate()


def test_ctrl_c_after_the_end_closes_the_viewer_with_the_runs_own_code(
    watched: Callable[..., Watched],
) -> None:
    process, address = watched("short", "--set", "duration_s=10")
    assert process.stderr is not None
    for line in process.stderr:
        if "stays until" in line:
            break
    process.send_signal(2)
    process.communicate(timeout=30)
    assert process.returncode == 0
    with pytest.raises(ConnectionRefusedError), connect(address.replace("http", "ws") + "live"):
        pass
