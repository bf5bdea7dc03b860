"""The server of `mjsim play`: pages, links, WebSockets. It simulates nothing; workers do (`worker.py`)."""

import asyncio
import logging
import re
import time
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket

from experiments.errors import RecordError
from experiments.runs import records
from experiments.runs.phases import FLYTHROUGH, STORY, TASK, TRAINING
from experiments.web.browser_socket import BrowserSocket
from experiments.web.guards import Addresses, Guards, Rate
from experiments.web.pages import message_page, page, play_page, result_page, story_page
from experiments.web.pool import Places, Pool
from experiments.web.sessions import Sessions
from experiments.web.visits import PLAYED, RESULT, Ended, Visit, Visits, token_hash

LOG = logging.getLogger("mjsim.play")
STATIC = Path(__file__).parent / "static"
MAX_QUEUE = 100  # visits that may wait for a place
OPENED = re.compile(r"\d{1,15}")  # ms since 1970
LONGEST_READING = 24 * 3600.0  # s; a page may stay open over night
NEW_VISITS = 30, 60.0  # from one address within so many seconds


@dataclass(frozen=True)
class PlayConfig:
    """What is played and how.

    Attributes:
        phases: What a visit consists of, in order; `flythrough` needs a film.
        trials: Settings of the trials of a visit: `training` and `task`.
        folder: Where visits are kept.
        sessions: How many people play at a time.
        idle: After so many seconds without a sign of a person, the place is given to somebody else.
        film: The film of the fly-through, MP4, or None.
        story: Text of the first page, with blank lines between paragraphs.
    """

    phases: Sequence[str]
    trials: Mapping[str, dict[str, Any]]
    folder: Path
    sessions: int = 1
    idle: float = 1800.0
    film: Path | None = None
    story: str = ""


class PlayServer:
    """Pages and sockets.

    Args:
        config: What is played.
        pool: Workers.

    Raises:
        OSError: The folder cannot be made.
    """

    def __init__(self, config: PlayConfig, pool: Pool) -> None:
        self._config = config
        self._visits = Visits(config.folder)
        self._pool, self._places = pool, Places(config.sessions)
        self.sessions = Sessions(pool, self._places, config.idle)
        self._new = Rate(*NEW_VISITS)

    def app(self, addresses: Addresses) -> Starlette:
        """The ASGI application.

        Args:
            addresses: Under which it is reached.
        """
        return Starlette(
            routes=[
                Route("/", self._story),
                Route("/visits", self._begin, methods=["POST"]),
                Route("/play/{token}", self._visit),
                Route("/play/{token}/film", self._film),
                Route("/play/{token}/film", self._film_seen, methods=["POST"]),
                Route("/play/{token}/floor-plan.png", self._floor_plan),
                WebSocketRoute("/play/{token}", self._play),
                Mount("/static", StaticFiles(directory=STATIC)),
            ],
            middleware=[Middleware(Guards, addresses=addresses)],
            exception_handlers={
                404: _not_found,
                RecordError: _damaged,
                OSError: _damaged,
                Exception: _failed,
            },
            lifespan=self._lifespan,
        )

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self._pool.warm_up()
        watching = asyncio.create_task(self.sessions.watch())
        try:
            yield
        finally:
            watching.cancel()
            with suppress(asyncio.CancelledError):
                await watching
            await self.sessions.release()
            await self._pool.close()

    async def _story(self, _: Request) -> Response:
        return story_page(
            self._config.story, self._config.trials[TASK], training=TRAINING in self._config.phases
        )

    async def _begin(self, request: Request) -> Response:
        if not self._new.allows(request.client.host if request.client else ""):
            return message_page(429, "Too many visits", "Please wait a minute, then try again.")
        if self._places.waiting >= MAX_QUEUE:
            return message_page(503, "Everything is full", "Please come back later.")
        left_out = (STORY,) if self._config.film else (STORY, FLYTHROUGH)
        phases = [name for name in self._config.phases if name not in left_out]
        token = self._visits.create(phases, self._config.trials, self._read(await request.body()))
        LOG.info("session %s begins", token_hash(token)[:12])
        return RedirectResponse(f"/play/{token}", 303)

    def _read(self, form: bytes) -> list[Ended]:
        """The story, as the form at its end has it: when the page was made, s since 1970."""
        if STORY not in self._config.phases:
            return []
        opened = parse_qs(form.decode("ascii", "replace")).get("opened", [""])[0]
        seconds = time.time() - int(opened) / 1000.0 if OPENED.fullmatch(opened) else 0.0
        return [Ended(STORY, round(min(max(0.0, seconds), LONGEST_READING), 3))]

    async def _visit(self, request: Request) -> Response:
        token = request.path_params["token"]
        visit = self._visits.find(token)
        if visit is None:
            return await _not_found(request, None)
        if visit.phase == FLYTHROUGH and self._config.film is None:
            visit.finish(FLYTHROUGH)
        if visit.phase == FLYTHROUGH:
            visit.show()
            return page("film", "The apartment", link=f"/play/{token}/film")
        if visit.phase in PLAYED:
            return play_page(visit.phase, visit.settings(visit.phase)["objects"])
        return result_page(f"/play/{token}", visit.metrics(TASK))

    async def _film(self, request: Request) -> Response:
        visit = self._visits.find(request.path_params["token"])
        if visit is None or self._config.film is None:
            return await _not_found(request, None)
        return FileResponse(self._config.film, media_type="video/mp4")

    async def _film_seen(self, request: Request) -> Response:
        token = request.path_params["token"]
        visit = self._visits.find(token)
        if visit is None:
            return await _not_found(request, None)
        visit.finish(FLYTHROUGH)
        return RedirectResponse(f"/play/{token}", 303)

    async def _floor_plan(self, request: Request) -> Response:
        visit = self._visits.find(request.path_params["token"])
        if visit is None or visit.phase != RESULT or not (picture := _floor_plan(visit)).is_file():
            return await _not_found(request, None)
        return FileResponse(picture, media_type="image/png")

    async def _play(self, socket: WebSocket) -> None:
        try:
            visit = self._visits.find(socket.path_params["token"])
        except (RecordError, OSError) as error:
            LOG.error("%s", error)
            visit = None
        if visit is None:
            await socket.close(1008)
            return
        await socket.accept()
        await BrowserSocket(socket).serve(self.sessions.of(visit), visit.phase)


def _floor_plan(visit: Visit) -> Path:
    return visit.run(TASK) / records.TOPDOWN


async def _not_found(request: Request, _: Any) -> Response:
    if request.url.path.startswith("/static"):
        return PlainTextResponse("not found\n", 404)
    return message_page(404, "This page does not exist", "Perhaps the link is not complete.")


async def _damaged(_: Request, error: Exception) -> Response:
    LOG.error("%s", error)
    return message_page(
        500, "Something is wrong here", "The server cannot read or write its files at the moment."
    )


async def _failed(_: Request, __: Exception) -> Response:
    return message_page(500, "Something is wrong here", "The server made a mistake. What was played is kept.")
