"""The page and its interface behind the headers of a careful server."""

from __future__ import annotations

import contextlib
import errno
import socket
from collections.abc import AsyncIterator
from importlib.resources import files
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from indexer_env.errors import refuse
from monitor.outputs.metrics import Metrics
from monitor.store import StoreDown
from monitor.web.api import Api

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = (
    (b"content-security-policy", _POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-frame-options", b"DENY"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)

_OPEN = ("/", "/health", "/api/sign-in")
"""What anybody may ask for; the page itself holds nothing but the form of a sign-in then."""

STATIC = files("monitor.web") / "static"


def make_app(api: Api, metrics: Metrics, local: bool, host: str | None = None) -> Starlette:
    """The application.

    Parameters
    ----------
    api : Api
    metrics : Metrics
    local : bool
        Only this host is served: any other name in the Host header is refused, as a page elsewhere would send it.
    host : str, optional
        The address that is served, where it is not one of the usual names of this host.
    """

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        api.hub.open()
        yield
        api.hub.close()

    page = (STATIC / "index.html").read_bytes()

    async def index(_: Request) -> Response:
        return Response(page, media_type="text/html", headers={"cache-control": "no-cache"})

    async def health(_: Request) -> Response:
        if api.engine.failure is not None:
            return PlainTextResponse("failed", 503)
        # the reason may name a host, and anybody may ask
        return PlainTextResponse(*(("ok", 200) if api.engine.trouble is None else ("the store cannot be used", 503)))

    async def told(_: Request) -> Response:
        return PlainTextResponse(await run_in_threadpool(metrics.text), media_type="text/plain; version=0.0.4")

    async def down(_: Request, __: Exception) -> Response:
        return JSONResponse({"error": "the store cannot be reached; trying again"}, 503)

    hosts = ["localhost", "127.0.0.1", "[::1]", "::1", *([] if host is None else [host])]
    hosts = hosts if local else ["*"]
    return Starlette(
        routes=[
            Route("/", index),
            Route("/health", health),
            Route("/metrics", told),
            *api.routes(),
            Mount("/static", StaticFiles(directory=str(STATIC))),
        ],
        middleware=[
            Middleware(Headers),
            Middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False),
            Middleware(Entrance, api=api),
            Middleware(GZipMiddleware, minimum_size=1000),
        ],
        exception_handlers={StoreDown: down},
        lifespan=lifespan,
    )


class Headers:
    """Puts the headers of `_HEADERS` on every answer."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *_HEADERS]
            await send(message)

        await self._app(scope, receive, with_headers)


class Entrance:
    """Lets in whom the gate knows, and no request that another site has sent."""

    def __init__(self, app: ASGIApp, api: Api) -> None:
        self._app, self._api = app, api

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        origin = request.headers.get("origin")
        acts = request.method not in ("GET", "HEAD")
        if acts and origin is not None and urlsplit(origin).netloc != request.headers.get("host"):
            await JSONResponse({"error": "another site has sent this"}, 403)(scope, receive, send)
            return
        person = self._api.gate.person(request)
        path = scope["path"]
        if person is None and path not in _OPEN and not path.startswith("/static/"):
            await JSONResponse({"error": "sign in first"}, 401)(scope, receive, send)
            return
        scope.setdefault("state", {})["person"] = person
        await self._app(scope, receive, send)


def listener(host: str, port: int) -> socket.socket:
    """Bound to the address; raises ParameterError where the port is taken."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    bound = socket.socket(family, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((host, port))
    except OSError as error:
        bound.close()
        if isinstance(error, socket.gaierror) or error.errno == errno.EADDRNOTAVAIL:
            rule = f"an address of this host ({error.strerror})"
            raise refuse("monitor", "host", rule, host, "0.0.0.0 stands for all of them") from None
        rule = f"one that is free on {host} ({error.strerror})"
        raise refuse("monitor", "port", rule, port, "choose another") from None
    return bound
