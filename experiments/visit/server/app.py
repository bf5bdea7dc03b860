"""The web application in which participants complete a study."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from experiments.errors import RecordError, StoreError
from experiments.visit.phases.base import Consent, TrialPhase
from experiments.visit.plan import RESULT
from experiments.visit.procedure import PhaseState, Procedure
from experiments.visit.server.admission import Admission
from experiments.visit.server.background import HostOfVisits, end_absent
from experiments.visit.server.pages import VisitPages
from experiments.visit.server.trials import Trials
from experiments.visit.store import Assignment, PersonRow
from experiments.visit.tokens import TOKEN, Keys, token_hash
from experiments.web.client_files import CHECKED, scene_route, static_routes
from experiments.web.server.guards import Network, middleware, sent_form
from experiments.web.server.player import Meter
from experiments.web.server.pool import WorkerPool
from mjsim.formats.gltf.store import scenes_folder

LOG = logging.getLogger("mjsim.study")
FILM_HEADERS = {"Cache-Control": "private, max-age=86400"}
DRAWING_TIMEOUT = 60.0  # how long a request waits until the picture of the house is drawn, in seconds
MAX_FORM = 64 * 1024  # maximum size of a submitted form, in bytes


@dataclass(frozen=True)
class ServerOptions:
    """Server options that are not part of the study plan.

    Attributes:
        secret: Secret key from which tokens are derived for participants with a platform id.
        proxies: Proxies whose X-Forwarded-For header is trusted.
        host: Name of this host if several hosts share a database, or None.
        workers: Maximum number of concurrent trials, or None to measure the machine's capacity.
        background: Background tasks that run as long as the server does.
    """

    secret: bytes = b""
    proxies: tuple[Network, ...] = ()
    meter: Meter | None = None
    host: str | None = None
    workers: int | None = None
    background: Sequence[Callable[[], Coroutine[Any, Any, None]]] = ()


class _ElsewhereError(Exception):
    """Raised if the participant's visit is handled by another host."""


class VisitServer:
    """A server for the pages and WebSockets of a study."""

    def __init__(self, procedure: Procedure, pool: WorkerPool, options: ServerOptions) -> None:
        self._procedure, self._options, self._pool = procedure, options, pool
        self._plan, self._store = procedure.plan, procedure.store
        self._trials = Trials(procedure, pool, options.workers, options.meter)
        self.sessions = self._trials.sessions
        self._pages = VisitPages(self._plan)
        self._arrivals = Admission(procedure, self._pages, Keys(options.secret, self._plan.name))
        self._host = (
            None if options.host is None else HostOfVisits(options.host, self._store, procedure.folders)
        )
        self._locks: dict[str, asyncio.Lock] = {}

    def app(self, host: str, public: str | None = None) -> Starlette:
        """Create the web application of a server at `host`. `public` is its URL behind a proxy, or None."""
        return Starlette(
            routes=[
                Route("/", self._arrivals.welcome),
                Route("/house.webp", self._picture),
                Route("/begin", self._arrivals.begin, methods=["POST"]),
                Route("/play/{token}", self._show),
                Route("/play/{token}", self._submit, methods=["POST"]),
                Route("/play/{token}/answers", self._save, methods=["POST"]),
                Route("/play/{token}/withdrawal", self._ask_to_leave),
                Route("/play/{token}/withdrawal", self._leave, methods=["POST"]),
                Route("/play/{token}/consent.txt", self._consent),
                Route("/play/{token}/film", self._film),
                Route("/play/{token}/floor-plan.png", self._floor_plan),
                Route("/play/{token}/ping", self._ping),
                WebSocketRoute("/play/{token}", self._play),
                scene_route(scenes_folder()),
                *static_routes(),
            ],
            middleware=middleware(
                host,
                public,
                self._options.proxies,
                max_body=MAX_FORM,
                embedded_by=self._plan.recruiter.embedded_by,
            ),
            exception_handlers={
                404: self._says("unknown", 404),
                _ElsewhereError: self._says("paused", 404),  # the status makes a proxy try the next host
                StoreError: self._out_of_order,
                RecordError: self._out_of_order,
                OSError: self._out_of_order,
                Exception: self._says("paused", 500),
            },
            lifespan=self._lifespan,
        )

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        await self._procedure.recover()
        works: list[Coroutine[Any, Any, None]] = [self.sessions.watch(), end_absent(self._procedure)]
        if self._host is not None:
            works.append(self._host.keep(self.sessions))
        tasks = [asyncio.create_task(work) for work in (*works, *(one() for one in self._options.background))]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task
            await self.sessions.release()
            await self._pool.close()
            if self._host is not None:
                with suppress(StoreError):  # an error does no harm, because the lease expires soon anyway
                    await self._host.leave()
            await self._store.close()

    async def _submit(self, request: Request) -> Response:
        person, form = await self._person(request), await sent_form(request)
        async with self._lock(person):
            now = await self._procedure.now(person, request.url.path)
            await self._procedure.submit(now, str(form.get("phase", "")), form)
        return RedirectResponse(request.url.path, 303)  # so that Back and reload do not send the form again

    async def _save(self, request: Request) -> Response:
        person, form = await self._person(request), await sent_form(request)
        async with self._lock(person):  # prevents an older answer from overwriting a newer one
            now = await self._procedure.now(person, request.url.path)
            await self._procedure.save(now, str(form.get("phase", "")), form)
        return Response(status_code=204)

    async def _ask_to_leave(self, request: Request) -> Response:
        if not (await self._person(request)).active:
            raise HTTPException(404)
        path = f"/play/{request.path_params['token']}"
        return self._pages.show(request, "withdrawal", section=self._plan.texts["withdrawal"], path=path)

    async def _leave(self, request: Request) -> Response:
        person, form = await self._person(request), await sent_form(request)
        if not person.active:
            raise HTTPException(404)
        async with self._lock(person):
            await self.sessions.release(lambda session: session.player.key == person.token_hash)
            self.sessions.limit.release(person.token_hash)  # a participant may have a slot but no session yet
            await self._procedure.withdraw(person, delete=form.get("data") == "delete")
        return RedirectResponse(f"/play/{request.path_params['token']}", 303)

    async def _consent(self, request: Request) -> Response:
        await self._person(request)
        consent = next((one for one in self._procedure.phases if isinstance(one, Consent)), None)
        if consent is None:
            return PlainTextResponse("not found\n", 404)
        saved = {"Content-Disposition": 'attachment; filename="consent.txt"'}
        return PlainTextResponse(consent.copy, headers=saved)

    async def _film(self, request: Request) -> Response:
        await self._person(request)
        if self._plan.film is None:
            return PlainTextResponse("not found\n", 404)
        return FileResponse(self._plan.film, headers=FILM_HEADERS, media_type="video/mp4")

    async def _picture(self, request: Request) -> Response:  # noqa: ARG002 - the same for all participants
        path, until = self._plan.picture, time.monotonic() + DRAWING_TIMEOUT
        while path is not None and not path.is_file() and time.monotonic() < until:
            await asyncio.sleep(0.2)
        if path is None or not path.is_file() or not self._plan.has_picture:
            return PlainTextResponse("not found\n", 404)
        return FileResponse(path, headers={"Cache-Control": CHECKED}, media_type="image/webp")

    async def _floor_plan(self, request: Request) -> Response:
        person = await self._person(request)
        folder = self._procedure.folders.find(person.token_hash)
        if folder is None or person.phase != RESULT or not folder.floor_plan.is_file():
            return PlainTextResponse("not found\n", 404)
        return FileResponse(folder.floor_plan, media_type="image/png")

    async def _ping(self, request: Request) -> Response:  # noqa: ARG002 - only measures latency
        return Response(status_code=204)

    async def _play(self, socket: WebSocket) -> None:
        token = socket.path_params["token"]
        person = await self._store.find(token_hash(token)) if TOKEN.fullmatch(token) else None
        if person is not None and self._host is not None and not await self._host.has(person):
            await socket.send_denial_response(Response(status_code=404))  # makes a proxy try the next host
            return
        if person is None:
            await socket.close(1008)
            return
        await self._trials.play(socket, person)

    async def _show(self, request: Request) -> Response:
        person = await self._person(request)
        async with self._lock(person):
            now = await self._procedure.now(person, request.url.path)
            if isinstance(now.phase, TrialPhase):
                return await self._played(request, now)
        finished = now.number == len(self._procedure.phases)
        identity = await self._store.identity(person.id) if finished else {}
        return self._pages.phase(request, now, identity, self._procedure.refusal(now))

    async def _played(self, request: Request, now: PhaseState) -> Response:
        person = now.person
        begun = self._procedure.folders.find(person.token_hash)  # the file is small, so no thread is needed
        here = begun or await self._procedure.assign(person)
        if here is None:
            return self._pages.left(request, await self._procedure.turn_away(person))
        if (queued := self._trials.queued(person.token_hash)) is not None:
            if begun:
                await self._store.beat(person.id)  # waiting in the queue counts as activity
            return self._pages.queue(request, now, queued)
        if isinstance(here, Assignment):
            here = await self._procedure.begin_playing(person, here)
        return self._trials.page(request, now, here)

    async def _out_of_order(self, request: Request, error: Exception) -> Response:
        LOG.error("%s", error)
        return self._pages.message(request, "paused", 503)

    def _says(self, name: str, status: int) -> Callable[[Request, Exception], Awaitable[Response]]:
        async def answer(request: Request, _: Exception) -> Response:
            return self._pages.message(request, name, status)

        return answer

    async def _person(self, request: Request) -> PersonRow:
        token = request.path_params["token"]
        person = await self._store.find(token_hash(token)) if TOKEN.fullmatch(token) else None
        if person is None:
            raise HTTPException(404)
        if self._host is not None and not await self._host.has(person):
            raise _ElsewhereError
        return person

    def _lock(self, person: PersonRow) -> asyncio.Lock:
        """Return the lock that a request holds while it changes the phase of a participant."""
        return self._locks.setdefault(person.token_hash, asyncio.Lock())
