"""The viewer's server lets in its own page only, and keeps within bounds."""

import contextlib
import json
import select
import socket
import threading
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import connect
from websockets.typing import Origin

from kilotwin.errors import InputError, RunError
from kilotwin.runs.packing import pack
from kilotwin.runs.reader import Run
from kilotwin.session.attached import Place
from kilotwin.session.live_link import LENGTH
from kilotwin.view import server
from kilotwin.view.helm import Helm
from kilotwin.view.run_link import RunLink
from kilotwin.view.served_run import ServedRun
from kilotwin.view.server import MOST_CONNECTIONS, Viewer

from ..known_run import Begin, samples


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """A page, whether or not one was built."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "index.html").write_text("the page")
    monkeypatch.setattr(server, "_PAGE", folder)


@contextlib.contextmanager
def serving(viewer: Viewer) -> Iterator[str]:
    """Its address, while it answers."""
    ready, ended = threading.Event(), threading.Event()
    thread = threading.Thread(target=viewer.serve, args=(ready.set, ended))
    thread.start()
    assert ready.wait(600)
    yield viewer.address
    ended.set()
    thread.join(600)
    assert not thread.is_alive()


@pytest.fixture
def address(begin: Begin, page: None) -> Iterator[str]:
    """Where a run of three samples is served."""
    writer = begin()
    writer.add(samples([0, 10, 20]))
    writer.add_event({"kind": "crash", "robot": 2, "tick": 10})
    writer.add_event({"kind": "print", "robot": 2, "tick": 10, "text": "dice 3"})
    with serving(Viewer([ServedRun(Run.open(writer.folder))])) as address:
        yield address


def ask(address: str, **headers: str) -> tuple[int, bytes]:
    """Status and body of a GET."""
    request = urllib.request.Request(address, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=600) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def test_the_page_and_what_it_asks_for_are_served(address: str) -> None:
    assert ask(address) == (200, b"the page")
    (scene,) = json.loads(ask(f"{address}scenes")[1])
    assert (scene["name"], scene["robots"], scene["samples"]) == ("small", 10, 3)
    assert [site["name"] for site in scene["sites"]] == ["black", "white"]
    for path in ("times?first=0", "samples?first=0&count=9&stride=1", "series"):
        assert ask(f"{address}runs/0/{path}")[0] == 200
    assert json.loads(ask(f"{address}runs/0/events")[1])["number"] == 1
    for words, number in (
        ("", 2),
        ("robot%203", 2),
        ("ROBOT%203%20DICE", 1),
        ("crash", 1),
        ("x", 0),
    ):
        said = json.loads(ask(f"{address}runs/0/log?words={words}")[1])
        assert said["number"] == len(said["events"]) == number
    robot = json.loads(ask(f"{address}runs/0/robots/2")[1])
    assert [event.get("text") for event in robot["events"]] == [None, "dice 3"]


@pytest.mark.parametrize(
    "path",
    [
        "runs/1/events",
        "runs/0/robots/10",
        "runs/0/samples?first=-1&count=1&stride=1",
        "runs/0/samples?first=0&count=1&stride=0",
        "runs/0/samples?first=0&count=1",
        "runs/0/samples?first=a&count=1&stride=1",
        "nothing.js",
    ],
)
def test_what_is_not_there_is_404(path: str, address: str) -> None:
    assert ask(address + path)[0] == 404


@pytest.mark.parametrize("trick", ["../server.py", "..%2fserver.py", "%2e%2e/server.py", "//etc/"])
def test_no_path_leads_out_of_the_page(trick: str, address: str) -> None:
    place = urllib.parse.urlsplit(address)
    with socket.create_connection((place.hostname, place.port), 20) as raw:
        raw.sendall(f"GET {place.path}{trick} HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n".encode())
        answer = raw.recv(4096)
    assert answer.startswith(b"HTTP/1.1 40")


def test_a_wrong_token_is_refused(address: str) -> None:
    base = address.rsplit("/", 2)[0]
    for path in ("/", "/scenes", "/wrong/", "/wrong/scenes"):
        status, said = ask(base + path)
        assert status == 403
        assert b"open the address that kilotwin printed" in said


def test_other_hosts_and_other_pages_are_refused(address: str) -> None:
    assert ask(address, Host="evil.example")[0] == 400
    assert ask(f"{address}scenes", Origin="http://evil.example")[0] == 403
    place = urllib.parse.urlsplit(address)
    assert ask(f"{address}scenes", Origin=f"http://{place.netloc}")[0] == 200


def test_a_page_from_elsewhere_gets_no_live_states(address: str) -> None:
    live = address.replace("http", "ws") + "live"
    with connect(live) as own:
        assert json.loads(own.recv(20))[0]["samples"] == 3
    with pytest.raises(WebSocketException), connect(live, origin=Origin("http://evil.example")):
        pass
    with pytest.raises(WebSocketException), connect(live.replace("/live", "x/live")):
        pass


def test_answers_may_run_nothing_from_elsewhere_and_are_not_kept(address: str) -> None:
    with urllib.request.urlopen(address, timeout=600) as answer:
        assert "default-src 'none'" in answer.headers["content-security-policy"]
        assert answer.headers["cache-control"] == "no-store"
        assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_thousand_connections_are_bounded_and_harm_nothing(address: str) -> None:
    place = urllib.parse.urlsplit(address)
    with contextlib.ExitStack() as stack:
        for _ in range(1000):
            stack.enter_context(socket.create_connection((place.hostname, place.port), 20))
        assert ask(address) == (200, b"the page")
    assert MOST_CONNECTIONS < 1000
    assert ask(address) == (200, b"the page")


def test_an_address_with_a_number_of_5000_digits_is_refused(address: str) -> None:
    assert ask(f"{address}runs/{'1' * 5_000}/times")[0] == 403
    assert ask(f"{address}runs/{'1' * 800}/times")[0] == 404


def test_a_port_that_is_taken_is_refused_with_what_to_type(begin: Begin, page: None) -> None:
    run = ServedRun(Run.open(begin().folder))
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"--port {port}: .*; name another, or 0"):
            Viewer([run], Place.at(port))


def test_without_the_built_page_it_says_what_to_type(
    begin: Begin, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = begin()
    monkeypatch.setattr(server, "_PAGE", writer.folder / "none")
    with pytest.raises(RunError, match="type: make setup"):
        Viewer([ServedRun(Run.open(writer.folder))])


def moment_for(run: socket.socket, *, closely: bool = False, **head: float) -> bytes:
    """Waits until a moment is asked for, and sends one."""
    (length,) = LENGTH.unpack(run.recv(LENGTH.size, socket.MSG_WAITALL))
    wanted = {"do": "look", "closely": True} if closely else {"do": "look"}
    assert json.loads(run.recv(length, socket.MSG_WAITALL)) == wanted
    packed = pack(head, {})
    run.sendall(LENGTH.pack(len(packed)) + packed)
    return packed


def test_pages_get_moments_of_a_run_that_goes_on_here_until_it_is_over(
    begin: Begin, page: None
) -> None:
    run, end = socket.socketpair()
    viewer = Viewer([ServedRun(Run.open(begin().folder))], link=RunLink(end))
    with run, serving(viewer) as address:
        run.settimeout(20)
        (scene,) = json.loads(ask(f"{address}scenes")[1])
        assert scene["moments"]
        assert scene["recorded"] is None  # all of them, though there is no sample yet
        moments = address.replace("http", "ws") + "moments"
        with connect(moments) as one, connect(moments) as other:
            one.send("look")
            other.send("look")
            packed = moment_for(run, time_s=3.5)
            assert one.recv(20) == packed
            if other_asked_later := select.select([run], [], [], 0.5)[0]:
                packed = moment_for(run, time_s=4.5)
            assert other.recv(20) == packed, other_asked_later
            one.send("closely")
            moment_for(run, closely=True, time_s=5.5)
            one.recv(20)
            other.send("look")  # soon after: the first page may be waiting for that one, too
            moment_for(run, closely=True, time_s=6.5)
            other.recv(20)
            one.send("look")
            run.shutdown(socket.SHUT_RDWR)
            with pytest.raises(ConnectionClosed):
                one.recv(20)


def test_moments_are_not_for_pages_from_elsewhere(begin: Begin, page: None) -> None:
    run, end = socket.socketpair()
    viewer = Viewer([ServedRun(Run.open(begin().folder))], link=RunLink(end))
    with run, serving(viewer) as address:
        moments = address.replace("http", "ws") + "moments"
        for refused, origin in ((moments, "http://evil.example"), (moments[:-9] + "/x", None)):
            with (
                pytest.raises(WebSocketException),
                connect(refused, origin=Origin(origin) if origin else None),
            ):
                pass


def test_what_a_program_wrote_into_the_link_ends_it_and_nothing_else(
    begin: Begin, page: None
) -> None:
    run, end = socket.socketpair()
    viewer = Viewer([ServedRun(Run.open(begin().folder))], link=RunLink(end))
    with run, serving(viewer) as address:
        run.sendall(LENGTH.pack(6) + b"robots")
        with connect(address.replace("http", "ws") + "moments") as page_of_it:
            page_of_it.send("look")
            with pytest.raises(ConnectionClosed):
                page_of_it.recv(20)
        assert ask(address)[0] == 200


class Wheel(Helm):
    """Passes on what is asked."""

    def __init__(self) -> None: ...

    def offers(self) -> dict[str, Any]:
        return {"grid": False, "commands": ["pause"], "parameters": {}}

    def order(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        if asked.get("do") != "pause":
            raise InputError("not that")
        return dict(asked)


def steer(address: str, body: bytes, **headers: str) -> tuple[int, str]:
    """Status and text of a POST, by default as our page does it."""
    place = urllib.parse.urlsplit(address)
    ours = {"Origin": f"http://{place.netloc}", "Content-Type": "application/json"}
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    sent = {name: value for name, value in {**ours, **given}.items() if value}
    request = urllib.request.Request(f"{address}steer", data=body, headers=sent, method="POST")
    try:
        with urllib.request.urlopen(request, timeout=600) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


@contextlib.contextmanager
def steered(begin: Begin) -> Iterator[tuple[str, socket.socket]]:
    """The address of a run that can be steered, and the run's end of its link."""
    run, end = socket.socketpair()
    run.settimeout(20)
    viewer = Viewer([ServedRun(Run.open(begin().folder))], link=RunLink(end), helm=Wheel())
    with run, serving(viewer) as address:
        yield address, run


def test_an_order_is_done_when_the_run_has_answered(begin: Begin, page: None) -> None:
    with steered(begin) as (address, run), ThreadPoolExecutor() as pool:
        assert json.loads(ask(f"{address}scenes")[1])[0]["steers"]["commands"] == ["pause"]
        for error, expected in (("", (204, "")), ("no room", (409, "no room\n"))):
            asked = pool.submit(steer, address, b'{"do": "pause"}')
            (length,) = LENGTH.unpack(run.recv(LENGTH.size, socket.MSG_WAITALL))
            order = json.loads(run.recv(length, socket.MSG_WAITALL))
            packed = pack({"answer": order["id"], "error": error}, {})
            run.sendall(LENGTH.pack(len(packed)) + packed)
            assert asked.result(20) == expected
        run.shutdown(socket.SHUT_RDWR)
        assert steer(address, b'{"do": "pause"}') == (409, "the run is over\n")


def test_nobody_steers_but_our_own_page(begin: Begin, page: None) -> None:
    with steered(begin) as (address, run):
        order = b'{"do": "pause"}'
        assert steer(address, order, Origin="http://evil.example")[0] == 403
        assert steer(address, order, Origin="")[0] == 403
        assert steer(address, order, Origin="null")[0] == 403
        assert steer(address, order, Content_Type="text/plain")[0] == 403
        assert steer(address, order, Host="evil.example")[0] == 400
        assert steer(address[:-3] + "xx/", order)[0] == 403
        assert ask(f"{address}steer")[0] in (404, 405)
        assert not select.select([run], [], [], 0.2)[0]


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[1]", b'{"do": "jump"}', b"\xff", b"[" * 9000, b" " * 20_000]
)
def test_what_is_no_order_never_reaches_the_run(begin: Begin, page: None, body: bytes) -> None:
    with steered(begin) as (address, run):
        assert steer(address, body)[0] == 400
        assert not select.select([run], [], [], 0.1)[0]


def test_a_run_that_is_only_seen_has_nothing_to_steer_by(address: str) -> None:
    assert json.loads(ask(f"{address}scenes")[1])[0]["steers"] is None
    assert steer(address, b'{"do": "pause"}')[0] in (404, 405)
