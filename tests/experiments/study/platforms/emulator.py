"""A platform that plays one of those from which people come: pages and an API over real HTTP, with faults on demand."""

import socket
import threading
from collections import deque
from contextlib import contextmanager

import uvicorn
from starlette.applications import Starlette
from starlette.responses import HTMLResponse, PlainTextResponse

SECRET = "a-secret-of-the-platform"
PATIENCE = 30.0  # s
PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<link rel="icon" href="data:,"></head><body><main><h1>{title}</h1>{body}</main></body></html>"""


class Emulator:
    """A platform.

    Attributes:
        faults: What goes wrong at the next requests that move money, one after the other: `429`, `refuse`, or one of
            `500`, `hang` and `garbage` with ` before` or ` after` the platform did what it was asked for.
        stuck: Set once a request hangs.
        asked: Requests of the API: methods and paths.
        moves: How many requests were to move money.
        url: Where it is, without a slash at the end.
    """

    def __init__(self):
        self.faults, self.asked, self.stuck = deque(), [], threading.Event()
        self.url, self.lock, self.moves = "", threading.Lock(), 0
        self._app = Starlette(routes=self.routes())

    def routes(self):
        raise NotImplementedError

    def is_api(self, request):
        """Whether a request is one of the API, by its ASGI scope."""
        raise NotImplementedError

    def moves_money(self, scope):
        raise NotImplementedError

    def allowed(self, headers):
        """Whether the headers of a request hold the secret."""
        raise NotImplementedError

    async def __call__(self, scope, receive, send):
        if scope["type"] != "http" or not self.is_api(scope):
            await self._app(scope, receive, send)
            return
        headers = {name.decode(): value.decode() for name, value in scope["headers"]}
        if not self.allowed(headers):
            await PlainTextResponse("who are you?", 401)(scope, receive, send)
            return
        self.asked.append((scope["method"], headers.get("x-amz-target") or scope["path"]))
        self.moves += (moves := self.moves_money(scope))
        fault = self.faults.popleft() if self.faults and moves else ""
        await self._with_fault(fault, scope, receive, send)

    async def _with_fault(self, fault, scope, receive, send):
        kind, _, when = fault.partition(" ")
        if kind == "429":
            await PlainTextResponse("slowly", 429, {"Retry-After": "0"})(scope, receive, send)
        elif kind == "refuse":
            await PlainTextResponse("no money", 400)(scope, receive, send)
        elif not kind:
            await self._app(scope, receive, send)
        else:
            if when == "after":
                await self._app(scope, receive, _nowhere)
            if kind == "hang":
                self.stuck.set()
                while (await receive())["type"] != "http.disconnect":  # until who asked gives up
                    pass
            status, text = (500, "trouble") if kind == "500" else (200, "<html>")
            await PlainTextResponse(text, status)(scope, receive, send)

    @contextmanager
    def running(self):
        """Serve until the context is left."""
        with socket.create_server(("127.0.0.1", 0)) as listener:
            self.url = f"http://127.0.0.1:{listener.getsockname()[1]}"
            config = uvicorn.Config(self, log_config=None, lifespan="off", timeout_graceful_shutdown=1)
            server = uvicorn.Server(config)
            thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
            thread.start()
            try:
                yield self
            finally:
                server.should_exit = True
                thread.join(PATIENCE)


async def _nowhere(_):
    pass


def page(title, body):
    """A page of a platform."""
    return HTMLResponse(PAGE.format(title=title, body=body))
