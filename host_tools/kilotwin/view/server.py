"""Serves the page and the runs on 127.0.0.1, in a process of its own.

Who has the address, with its token, sees the runs, and steers one that was begun with a page. A
browser asks for samples when it can draw them, so that a slow one has fewer, and a run that goes on
is not held up: this process reads its folder, and asks for a moment when a page has asked
(run_link.py).
"""

import asyncio
import contextlib
import json
import secrets
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol

from kilotwin.errors import InputError, RunError
from kilotwin.session.attached import HOST, PAGE, Place, check_page
from kilotwin.view.helm import Helm
from kilotwin.view.run_link import RunLink
from kilotwin.view.served_run import ServedRun

MOST_CONNECTIONS = 64
"""A further one takes the place of the oldest that has asked nothing; where all have asked, it is
answered that the server is busy."""

_PAGE = PAGE
_LOOK_S = 0.2
_MOST_POINTS = 4_000
_LARGEST = 1 << 31
_MOST_ORDER_BYTES = 1 << 14
_LONGEST_PATH = 1_000

_POLICY = "Content-Security-Policy"
_NOTEBOOKS = "http://127.0.0.1:* http://localhost:*"
_HEADERS = {
    _POLICY: "default-src 'none'; script-src 'self'; style-src 'self' "
    "'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class _Guard:
    """Lets in what has the token and comes from our own page."""

    def __init__(self, app: ASGIApp, token: str, framed: bool) -> None:
        """`framed`: pages of this computer may have ours in a frame, as a notebook has."""
        self._app = app
        self._token = token
        policy = _HEADERS[_POLICY]
        if framed:
            policy = policy.replace("frame-ancestors 'none'", f"frame-ancestors {_NOTEBOOKS}")
        self._headers = {**_HEADERS, _POLICY: policy}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """403 for others; our headers for all."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if refusal is None:
            await self._app(scope, receive, _with_headers(send, self._headers))
        elif scope["type"] == "websocket":
            await WebSocket(scope, receive, send).close(4403, refusal)
        else:
            response = PlainTextResponse(refusal + "\n", 403, headers=_HEADERS)
            await response(scope, receive, send)

    def _refusal(self, scope: Scope) -> str | None:
        if len(scope["path"]) > _LONGEST_PATH:
            return "no address of ours is so long"
        first = scope["path"].split("/", 2)[1] if "/" in scope["path"] else ""
        if not secrets.compare_digest(first.encode(), self._token.encode()):
            return "wrong token; open the address that kilotwin printed"
        headers = Headers(scope=scope)
        origin = headers.get("origin")
        if origin is not None and origin != f"http://{headers.get('host', '')}":
            return "not from this page"
        return None


def _with_headers(send: Send, headers: Mapping[str, str]) -> Send:
    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
            message["headers"] = [*message.get("headers", []), *own]
        await send(message)

    return sent


@dataclass
class Pages:
    """The pages that are open."""

    open: int = 0
    closed_at: float | None = None
    """When the last one was closed, by time.monotonic(); None before."""


def application(
    runs: Sequence[ServedRun],
    token: str,
    pages: Pages,
    link: RunLink | None = None,
    helm: Helm | None = None,
    *,
    framed: bool = False,
    bus: Callable[[], dict[str, Any]] | None = None,
) -> Starlette:
    """The page at /TOKEN/, and beside it `scenes`, `live` and `runs/K/...` of run number K.

    With a `link` the first run is one that goes on here, and its `moments` are served too; with a
    `helm` pages may `steer` it; `bus` tells of the buses of a grid that is listened to.
    """

    def served(request: Request) -> ServedRun:
        number: int = request.path_params["run"]
        return runs[number]

    def samples(request: Request) -> Response:
        first, count, stride = (
            _number(request, name, low) for name, low in (("first", 0), ("count", 1), ("stride", 1))
        )
        return _binary(served(request).samples.chunk(first, count, stride))

    def times(request: Request) -> Response:
        return _binary(served(request).samples.times(_number(request, "first", 0)))

    def frames(request: Request) -> Response:
        from_s, to_s = (float(request.query_params[name]) for name in ("from_s", "to_s"))
        return JSONResponse(served(request).frames(from_s, to_s))

    def scenes() -> list[dict[str, Any]]:
        steers = None if helm is None else helm.offers()
        here = {"moments": link is not None, "steers": steers, "buses": bus is not None}
        return [{**run.scene(), **here} for run in runs]

    routes = [
        _route("/scenes", lambda _: JSONResponse(scenes())),
        _route("/runs/{run:int}/times", times),
        _route("/runs/{run:int}/samples", samples),
        _route("/runs/{run:int}/series", lambda r: _binary(served(r).samples.series(_MOST_POINTS))),
        _route("/runs/{run:int}/events", lambda r: JSONResponse(served(r).events())),
        _route(
            "/runs/{run:int}/log",
            lambda r: JSONResponse(served(r).log(r.query_params.get("words", ""))),
        ),
        _route(
            "/runs/{run:int}/robots/{robot:int}",
            lambda r: JSONResponse(served(r).robot(r.path_params["robot"])),
        ),
        _route(
            "/runs/{run:int}/modules/{column:int}/{row:int}",
            lambda r: JSONResponse(served(r).module(r.path_params["column"], r.path_params["row"])),
        ),
        _route("/runs/{run:int}/reports", lambda r: JSONResponse(served(r).reports(_time_s(r)))),
        _route("/runs/{run:int}/cells", lambda r: JSONResponse(served(r).cells(_time_s(r)))),
        _route("/runs/{run:int}/frames", frames),
        WebSocketRoute("/live", _live_of(runs, pages)),
        *([] if link is None else _routes_of_link(link, helm)),
        *([] if bus is None else [_route("/bus", lambda _: JSONResponse(bus()))]),
        Mount("/", StaticFiles(directory=_PAGE, html=True)),
    ]
    return Starlette(
        routes=[Mount(f"/{token}", routes=routes)],
        middleware=[
            Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"]),
            Middleware(_Guard, token=token, framed=framed),
        ],
    )


def _route(path: str, answer: Callable[[Request], Response]) -> Route:
    async def endpoint(request: Request) -> Response:
        try:
            return await run_in_threadpool(answer, request)
        except (IndexError, KeyError, ValueError):
            return PlainTextResponse("no such run, robot or sample\n", 404)
        except (InputError, OSError) as error:
            return PlainTextResponse(f"{error}\n", 503)

    return Route(path, endpoint)


def _live_of(runs: Sequence[ServedRun], pages: Pages) -> Callable[[WebSocket], Awaitable[None]]:
    """Each run's state, when one has changed."""

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        told = ""
        with contextlib.suppress(WebSocketDisconnect, RuntimeError), _counted(pages):
            while True:
                states = await run_in_threadpool(lambda: [run.state() for run in runs])
                if (text := json.dumps(states)) != told:
                    await socket.send_text(text)
                    told = text
                await _pause_or_end(socket)

    return live


@contextlib.contextmanager
def _counted(pages: Pages) -> Iterator[None]:
    pages.open += 1
    try:
        yield
    finally:
        pages.open -= 1
        pages.closed_at = time.monotonic()


def _routes_of_link(link: RunLink, helm: Helm | None) -> list[BaseRoute]:
    routes: list[BaseRoute] = [WebSocketRoute("/moments", _moments_of(link))]
    if helm is not None:
        routes.append(Route("/steer", _steer_of(link, helm), methods=["POST"]))
    return routes


def _steer_of(link: RunLink, helm: Helm) -> Callable[[Request], Awaitable[Response]]:
    """204 when it was done; 400 or 409 with a line that says why it was not."""

    async def steer(request: Request) -> Response:
        # A form of another page has no such type, and a browser names the page that asks.
        if request.headers.get("origin") is None or not _is_json(request):
            return PlainTextResponse("not from this page\n", 403)
        try:
            asked = json.loads(await _body(request))
            if not isinstance(asked, dict):
                raise ValueError("an order is an object")
            error = await link.order(await run_in_threadpool(helm.order, asked))
        except (ValueError, RecursionError, InputError) as refused:
            return PlainTextResponse(f"{refused}\n", 400)
        except RunError as over:
            error = str(over)
        return PlainTextResponse(f"{error}\n", 409) if error else Response(status_code=204)

    return steer


def _is_json(request: Request) -> bool:
    return request.headers.get("content-type", "").split(";")[0] == "application/json"


async def _body(request: Request) -> bytes:
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > _MOST_ORDER_BYTES:
            raise ValueError("an order is shorter")
    return body


def _moments_of(link: RunLink) -> Callable[[WebSocket], Awaitable[None]]:
    """A page that has drawn one asks for the next, `closely` for more of each robot."""

    async def moments(socket: WebSocket) -> None:
        await socket.accept()
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while asked := await socket.receive_text():
                try:
                    await socket.send_bytes(await link.moment(closely=asked == "closely"))
                except RunError:
                    await socket.close()
                    return

    return moments


async def _pause_or_end(socket: WebSocket) -> None:
    """Waits until it is time to look again; WebSocketDisconnect when the page is closed."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_LOOK_S):
            await socket.receive_text()


def _number(request: Request, name: str, low: int) -> int:
    value = int(request.query_params[name])
    if not low <= value < _LARGEST:
        raise ValueError(name)
    return value


def _time_s(request: Request) -> float:
    return float(request.query_params["time_s"])


def _binary(data: bytes) -> Response:
    return Response(data, media_type="application/octet-stream")


class _Connection(H11Protocol):
    """A connection that makes room for itself: any program of this computer may open many."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self.since = time.monotonic()
        if len(self.connections) < MOST_CONNECTIONS:
            return
        idle = [other for other in self.connections if other is not self and _is_idle(other)]
        if idle:
            oldest = min(idle, key=lambda other: other.since)
            self.connections.discard(oldest)
            oldest.transport.close()


def _is_idle(connection: object) -> TypeGuard[_Connection]:
    """Whether it has asked nothing yet; a web socket has."""
    if not isinstance(connection, _Connection):
        return False
    asked: object = connection.cycle  # None before the first request, whatever its type says
    return asked is None and connection.transport.get_protocol() is connection


class Viewer:
    """A server that listens already; `address` is what to open."""

    def __init__(
        self,
        runs: Sequence[ServedRun],
        place: Place | None = None,
        link: RunLink | None = None,
        helm: Helm | None = None,
        *,
        framed: bool = False,
        bus: Callable[[], dict[str, Any]] | None = None,
    ) -> None:
        """RunError without the built page. `link`: to the first run, which goes on; `helm`: makes
        the orders by which pages may steer it; `framed`: a notebook may have it in a frame."""
        check_page(_PAGE)
        place = place or Place.at()
        self._socket = place.socket
        self._link = link
        self.address = place.address
        self.pages = Pages()
        self._application = application(
            runs, place.token, self.pages, link, helm, framed=framed, bus=bus
        )

    def serve(self, started: Callable[[], None], ended: threading.Event | None = None) -> None:
        """Until Ctrl-C, or until `ended` is set. `started` is called once the server answers."""

        @contextlib.asynccontextmanager
        async def lifespan(_: Any) -> AsyncIterator[None]:
            watch = asyncio.create_task(_end_at(uvicorn_server, ended)) if ended else None
            if self._link is not None:
                await self._link.open()
            started()
            yield
            if watch:
                watch.cancel()
            if self._link is not None:
                await self._link.close()

        self._application.router.lifespan_context = lifespan
        config = uvicorn.Config(
            self._application,
            log_level="warning",
            access_log=False,
            server_header=False,
            http=_Connection,
            limit_concurrency=MOST_CONNECTIONS,
            ws_max_size=1 << 16,
            timeout_graceful_shutdown=1,
        )
        uvicorn_server = uvicorn.Server(config)
        with contextlib.suppress(KeyboardInterrupt):
            uvicorn_server.run(sockets=[self._socket])


async def _end_at(running: uvicorn.Server, ended: threading.Event) -> None:
    while not ended.is_set():
        await asyncio.sleep(_LOOK_S)
    running.should_exit = True
