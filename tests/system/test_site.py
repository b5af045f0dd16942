"""`make docs` makes a site without a broken link, which loads nothing from elsewhere."""

import subprocess
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from .browser import chromium, new_page
from .conftest import ROOT

pytestmark = pytest.mark.long
SITE = ROOT / "build/docs/site"


class _Quiet(SimpleHTTPRequestHandler):
    """Files, without a line for each."""

    def log_message(self, format: str, *arguments: object) -> None:
        pass


@pytest.fixture(scope="module")
def site() -> Path:
    """The site, made anew: strictly, so that a broken link or a page in no table fails."""
    subprocess.run(["make", "docs"], cwd=ROOT, check=True, capture_output=True, text=True)
    return SITE


@pytest.fixture
def address(site: Path) -> Iterator[str]:
    """Where it is served."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(site))) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


def test_pages_load_nothing_from_elsewhere_and_search_finds(address: str) -> None:
    problems: list[str] = []
    asked: list[str] = []
    with chromium() as browser, new_page(browser, problems) as page:
        page.on("request", lambda request: asked.append(request.url))
        for name in ("index", "testing", "api"):
            page.goto(f"{address}/{name}.html", wait_until="networkidle")
        page.click(".md-search__input")
        page.keyboard.type("assert_share", delay=20)
        page.wait_for_selector(".md-search-result__item a[href*='testing']", state="attached")
    assert len(asked) > 10
    assert [url for url in asked if not url.startswith((address, "data:", "blob:"))] == []
    assert problems == []


def test_the_search_finds_on_pages_that_are_opened_from_a_disk(site: Path) -> None:
    problems: list[str] = []
    with chromium() as browser, new_page(browser, problems) as page:
        page.goto((site / "index.html").as_uri(), wait_until="load")
        page.click(".md-search__input")
        page.keyboard.type("assert_share", delay=20)
        page.wait_for_selector(".md-search-result__item a[href*='testing']", state="attached")
    assert problems == []


def test_every_page_has_a_switch_for_dark_and_light(site: Path) -> None:
    for name in ("index", "class", "troubleshooting"):
        page = (site / f"{name}.html").read_text(encoding="utf-8")
        assert 'data-md-color-scheme="slate"' in page
        assert 'href="troubleshooting.html"' in page or name == "troubleshooting"


def test_the_landing_page_shows_the_run_and_the_reference_its_names(site: Path) -> None:
    landing = (site / "index.html").read_text(encoding="utf-8")
    assert 'src="images/run.gif"' in landing
    reference = (site / "api.html").read_text(encoding="utf-8")
    for name in ("kilotwin.World", "kilotwin.World.run", "kilotwin.testing.assert_share"):
        assert f'id="{name}"' in reference
