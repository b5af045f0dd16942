"""A run is seen in a real browser as it goes, and a viewer changes nothing in it."""

import contextlib
import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, WebSocketRoute
from websockets.sync.client import connect

from kilotwin.runs.reader import Run
from kilotwin.session.debug.repeated_run import Repeated, travel_in
from kilotwin.session.debug.travel import Wanted
from kilotwin.units import TICK_S

from ..processes import serving
from ..steering import steer
from .browser import chromium, comes, new_page, open_viewer, viewer
from .conftest import KILOTWIN, ROOT, WALKER, Kilotwin
from .served_table import Table
from .test_view import LIVE, picture

pytestmark = pytest.mark.waits

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
    """Starts `kilotwin run live.toml --view ...`: the process, and the page's address. Without a
    --speed among the words it is as fast as it can, and waits for no page."""
    with contextlib.ExitStack() as stack:

        def start(out: str, *words: str) -> Watched:
            command = [KILOTWIN, "run", "live.toml", "--view", "--no-browser", "--no-twin"]
            speed = [] if "--speed" in words else ["--speed", "max"]
            words = ("--json", "--out", out, *speed, *words)
            return stack.enter_context(
                serving([*command, *words], "view: ", cwd=folder, env=environment)
            )

        yield start


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def alone(folder: Path, environment: dict[str, str]) -> str:
    """The result hash of 5,000 s without a viewer."""
    words = ["--no-twin", "--json", "--set", "duration_s=5000", "--out", "alone"]
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
    process, address = watched("seen", "--set", "duration_s=5000", "--speed", "10")
    problems: list[str] = []
    with new_page(browser, problems) as page:
        open_viewer(page, address)
        times: set[str] = set()

        def goes_on() -> bool:
            times.add(page.input_value("#time"))
            return len(times) > 4

        comes(page, goes_on)
        steer(address, do="speed")
        end = f"{round(5000 / TICK_S) * TICK_S:.3f}"
        comes(page, lambda: page.input_value("#time") == end)
        page.wait_for_timeout(500)
        assert process.poll() is None
    out, _ = process.communicate(timeout=600)
    assert process.returncode == 0
    assert json.loads(out)["result_hash"] == alone
    assert problems == []


def test_a_run_waits_for_its_page_and_its_record_plays_again_when_it_is_over(
    watched: Callable[..., Watched], browser: Browser, folder: Path
) -> None:
    process, address = watched("waits", "--set", "duration_s=30", "--speed", "10")
    assert process.stderr is not None
    assert "the run waits for it, and goes 10 times real time" in process.stderr.readline()
    problems: list[str] = []
    with new_page(browser, problems) as page:
        page.wait_for_timeout(1500)
        assert len(Run.open(folder / "waits").sites()) <= 1  # of the start
        open_viewer(page, address)
        page.wait_for_selector("#steering")
        page.keyboard.press("P")
        page.wait_for_selector("#hold.on")
        assert 0 < float(time_that_stands(page)) < 30
        page.keyboard.press("P")
        page.wait_for_selector('#steering:has-text("is over")')
        comes(page, lambda: "finished" in page.inner_text("#title"))
        assert float(page.input_value("#time")) == pytest.approx(30, abs=0.1)
        page.keyboard.press("M")  # a robot cannot be moved any more
        comes(page, lambda: "start it again" in page.inner_text("#said"))
        page.click("#steering button")
        page.wait_for_function("() => Number(document.querySelector('#time').value) < 20")
        page.wait_for_function("() => Number(document.querySelector('#time').value) > 1")
        page.click("#play")
        time_that_stands(page)
    out, _ = process.communicate(timeout=600)
    assert process.returncode == 0
    assert json.loads(out)["simulated_s"] == pytest.approx(30, abs=0.1)
    assert problems == []


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["--view", "--speed", "fast"], "'fast': give simulated seconds per second, 0.01 to 10000"),
        (["--view", "--speed", "0"], "'0': give simulated seconds per second"),
        (["--speed", "5"], "--speed is that of a run beside its page; add --view, or leave it out"),
    ],
)
def test_a_speed_that_is_none_or_has_no_page_is_refused(
    folder: Path, kilotwin: Kilotwin, words: list[str], what: str
) -> None:
    done = kilotwin("run", "live.toml", *words, folder=folder, expect=2)
    assert what in done.stderr


def last_sample(run: Path) -> float:
    return float(Run.open(run).sites()["time_s"][-1].as_py())


def test_a_page_that_is_late_shows_the_last_sample_all_the_same(
    watched: Callable[..., Watched], browser: Browser, folder: Path
) -> None:
    process, address = watched("late", "--set", "duration_s=1e6")
    problems: list[str] = []
    states: list[str] = []
    pages: list[WebSocketRoute] = []

    def hold(socket: WebSocketRoute) -> None:
        pages.append(socket)
        socket.connect_to_server().on_message(lambda state: states.append(str(state)))

    def sample(state: str) -> float:
        return float(json.loads(state)[0]["last_s"])

    with new_page(browser, problems) as page:
        page.route_web_socket("**/moments", lambda socket: socket.close())
        page.route_web_socket("**/live", hold)
        open_viewer(page, address)
        while len({sample(state) for state in states}) < 4:
            page.wait_for_timeout(50)
        steer(address, do="pause")
        page.wait_for_timeout(1000)  # it has written, and the server has looked again
        comes(page, lambda: sample(states[-1]) == last_sample(folder / "late"))
        earlier = next(state for state in states if sample(state) > sample(states[0]))
        last = f"{sample(states[-1]):.3f}"
        # The page is told of few samples, and is answered with all that there are by now.
        with page.expect_response("**/times?*"):
            pages[0].send(earlier)
        for state in states[states.index(earlier) + 1 :]:
            pages[0].send(state)
        page.wait_for_function("last => document.querySelector('#time').value === last", arg=last)
        page.wait_for_function("last => document.body.dataset.shown === last", arg=last)
    process.terminate()
    process.communicate(timeout=600)
    assert problems == []


@pytest.mark.long
def test_a_browser_that_reads_nothing_changes_nothing(
    watched: Callable[..., Watched], alone: str, folder: Path
) -> None:
    process, address = watched("unread", "--set", "duration_s=5000")
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
    process.communicate(timeout=600)
    assert process.returncode == 0
    with pytest.raises(ConnectionRefusedError), connect(address.replace("http", "ws") + "live"):
        pass


HEARS = """() =>
    Number(/([0-9.]+) reports/.exec(document.querySelector("#buses").textContent)?.[1]) > 0 &&
    Number(document.querySelector("#time").value) > 1"""


MOVED = "here => document.querySelector('#now').innerText !== here"


def steered(folder: Path) -> list[dict[str, object]]:
    """The events of acts by hand."""
    events = Run.open(folder).events()
    return [event for event in events if event["kind"] in ("steered", "paced")]


def acts(folder: Path) -> list[object]:
    return [event["do"] for event in steered(folder)]


def time_that_stands(page: Page) -> str:
    """The time that a page shows once it does not change any more."""
    before: list[str] = []

    def stands() -> bool:
        page.wait_for_timeout(500)
        before.append(page.input_value("#time"))
        return before[-2:-1] == before[-1:]

    comes(page, stands)
    return before[-1]


def test_a_run_is_steered_from_its_page_and_says_so(
    watched: Callable[..., Watched], browser: Browser, folder: Path, environment: dict[str, str]
) -> None:
    process, address = watched("steered", "--set", "duration_s=1e6")
    problems: list[str] = []
    with new_page(browser, problems) as page:
        open_viewer(page, address)
        page.wait_for_selector("#steering")
        page.keyboard.press("P")
        page.wait_for_selector("#hold.on")
        time = time_that_stands(page)
        page.keyboard.press(">")
        page.wait_for_function("time => document.querySelector('#time').value !== time", arg=time)
        stepped = float(page.input_value("#time")) - float(time)
        assert stepped == pytest.approx(4 * TICK_S, abs=0.002)  # a world step
        page.keyboard.press("M")
        robot, (x, y) = drag_first_robot(page, folder / "steered")
        page.keyboard.down("Shift")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x, y - 60, steps=4)
        page.mouse.up()
        page.keyboard.up("Shift")
        comes(page, lambda: acts(folder / "steered")[-1] == "turn")
        assert page.inner_text("#said") == ""
        page.select_option("#steering select", "sleep")
        page.fill("#steering form input", f"robot = {robot + 1}")
        page.click("#steering form button")
        comes(page, lambda: acts(folder / "steered")[-1] == "send")
        assert page.inner_text("#said") == ""
        page.keyboard.press("P")
        page.wait_for_selector("#hold:not(.on)")
    process.terminate()
    process.communicate(timeout=600)
    assert problems == []
    done = steered(folder / "steered")
    assert acts(folder / "steered") == ["pause", "step", "place", "turn", "send", "resume"]
    assert done[2]["robot"] == done[3]["robot"] == robot
    assert done[3]["heading_rad"] == pytest.approx(np.pi / 2, abs=0.2)
    touched = Run.open(folder / "steered").manifest["touched"]
    assert touched == {"first_s": done[2]["time_s"]}
    words = [str(KILOTWIN), "run", "--verify", "steered", "--out", "again", "--json"]
    verdict = subprocess.run(
        words, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert verdict.returncode == 0, verdict.stderr
    assert json.loads(verdict.stdout)["same"]
    # A debugger's forks of it too.
    result = Run.open(folder / "again").manifest["summary"]["result_hash"]
    with travel_in(Repeated.of(folder / "steered", []), [robot]) as (travel, _):
        begin = travel.start([robot], 0.5)
        for _ in range(2):
            assert travel.go_on(Wanted()).why == "end"
            assert travel.result_hash() == result
            travel.go_to(begin.place)


def drag_first_robot(page: Page, run: Path) -> tuple[int, tuple[float, float]]:
    """Drags a robot near the middle to where there is room, and says which it is, and to where."""
    box = page.locator(".pane").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for radius in range(0, 200, 6):
        for angle in range(0, 360, 15):
            at = x + radius * np.cos(np.radians(angle)), y + radius * np.sin(np.radians(angle))
            page.mouse.click(*at)
            if page.is_visible("#inspector h2"):
                robot = int(page.inner_text("#inspector h2").split()[-1]) - 1
                way = 45 * direction_with_room(run, robot)
                to = at[0] + float(way[0]), at[1] - float(way[1])
                for known in ("motors", "battery", "messages"):  # not asked for
                    page.wait_for_selector(f'#now dt:text-is("{known}")')
                here = page.inner_text("#now")
                page.mouse.move(*at)
                page.mouse.down()
                page.mouse.move(*to, steps=4)
                page.mouse.up()
                page.wait_for_function(MOVED, arg=here)
                assert page.inner_text("#said") == ""
                return robot, to
    raise AssertionError("no robot")


def direction_with_room(run: Path, robot: int) -> np.ndarray:
    """In which others are farthest from where the robot would be 8 cm away."""
    rows = Run.open(run).last_robots().to_pydict()
    places = np.stack([rows["x_m"], rows["y_m"]], axis=1)
    angles = np.radians(np.arange(0, 360, 15))
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    there = places[robot] + 0.08 * ways
    away = np.linalg.norm(there[:, None] - np.delete(places, robot, axis=0), axis=2).min(axis=1)
    return np.asarray(ways[away.argmax()])


def circled(seen: np.ndarray) -> int:
    """Pixels of the circles around robots' reports."""
    return int(np.all(np.abs(seen - np.array([0xCC, 0x33, 0x99])) < 40, axis=2).sum())


def test_a_kilogrid_is_seen_while_it_is_recorded(
    tmp_path: Path, environment: dict[str, str], browser: Browser
) -> None:
    grid = "tests/system/grid_small.toml"
    speed = ["--speed", "3", "--set", "duration_s=100000", "--no-browser", "--view"]
    table = Table(grid, tmp_path, environment, *speed)
    words = ["record", grid, "--can", table.bus, *speed, "--out", tmp_path / "recorded", "-q"]
    with contextlib.ExitStack() as stack:
        stack.callback(table.close)
        command = [KILOTWIN, *words]
        host, address = stack.enter_context(serving(command, "view: ", cwd=ROOT, env=environment))
        problems: list[str] = []
        with new_page(browser, problems) as page:
            open_viewer(page, address)
            page.wait_for_function("() => Number(document.querySelector('#time').value) > 5")
            assert page.is_visible("#live")
            assert page.query_selector("#steering") is None
            before, robots = picture(page), Run.open(tmp_path / "recorded").robots()
            assert len(robots) > 0
            page.keyboard.press("r")  # where each was heard, and how far it may be
            comes(page, lambda: circled(picture(page)) > 50)
            page.wait_for_function("() => Number(document.querySelector('#time').value) > 8")
            assert np.any(picture(page) != before)
            with viewer(environment, grid, "--can", table.bus) as heard:
                open_viewer(page, heard)
                page.wait_for_function(HEARS)
                said = page.inner_text("#buses")
                assert "no module is silent" in said
                assert "can0: " in said
                assert "can1: " in said
                page.goto("about:blank")  # a page whose server is gone complains
        host.send_signal(2)
        host.wait(600)
        assert problems == []
    summary = Run.open(tmp_path / "recorded").manifest["summary"]
    assert summary["grid"]["foreign_orders"] == []
