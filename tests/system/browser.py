"""Debian's Chromium, driven by Playwright, and a viewer for it."""

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from playwright.sync_api import Browser, ConsoleMessage, Page, sync_playwright

from ..processes import serving
from .conftest import KILOTWIN, ROOT

# Software all through; nothing that Chromium would ask the network for.
_ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PATIENCE_MS = 600_000


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """A browser; one at a time."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=_ARGUMENTS)
        yield browser
        browser.close()


@contextlib.contextmanager
def new_page(
    browser: Browser, problems: list[str], width: int = 1280, height: int = 800
) -> Iterator[Page]:
    """An empty page. `problems` gets what its scripts throw or warn of."""

    def heed(message: ConsoleMessage) -> None:
        if message.type in ("warning", "error") and "GPU stall" not in message.text:
            problems.append(message.text)

    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE_MS)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", heed)
    yield page
    page.close()


@contextlib.contextmanager
def viewer(environment: dict[str, str], *words: Path | str) -> Iterator[str]:
    """The address of `kilotwin view WORDS`, typed in the project's folder."""
    command = [KILOTWIN, "view", *words, "--no-browser"]
    with serving(command, cwd=ROOT, env=environment) as (_, address):
        yield address


def comes(page: Page, is_so: Callable[[], object]) -> None:
    """Waits until it is so; the page lives on meanwhile."""
    end = time.monotonic() + PATIENCE_MS / 1000
    while not is_so():
        assert time.monotonic() < end, "it did not come"
        page.wait_for_timeout(50)


def open_viewer(page: Page, address: str) -> None:
    """Waits until the page shows its run."""
    page.goto(address)
    page.wait_for_selector("body[data-ready=yes]", state="attached")


def go_to(page: Page, time_s: float) -> None:
    """Types a time, and waits until its samples are drawn."""
    page.fill("#time", f"{time_s}")
    page.keyboard.press("Enter")
    shown(page, time_s)


def shown(page: Page, time_s: float) -> None:
    """Waits until that time is drawn."""
    page.wait_for_selector(f'body[data-shown="{time_s:.3f}"]', state="attached")
