"""The web application with which researchers monitor and control a study."""

import asyncio
import logging
import math
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from experiments.errors import StoreError
from experiments.study.data.collect import person_name
from experiments.study.file import Study
from experiments.study.researcher.access import Access, may
from experiments.study.researcher.metrics import ServerMetrics
from experiments.study.researcher.overview import overview
from experiments.visit.store import PersonRow, Researcher, Role, Store, StudyState
from experiments.visit.texts import words_of
from experiments.web.client_files import page, scene_route, static_routes, trial_texts
from experiments.web.server.browser_socket import BrowserSocket
from experiments.web.server.guards import Network, middleware, sent_form
from experiments.web.server.played_session import PlayedSession
from experiments.web.server.sessions import Sessions
from mjsim.formats.gltf.store import scenes_folder

LOG = logging.getLogger("mjsim.study")
HEALTH_TIMEOUT = 3.0  # timeout for the database in a health check, in seconds
CHECK_PERIOD = 5.0  # interval between login checks while a researcher watches, in seconds
PAGE_SIZE = 100  # number of participants on each page of the list
MAX_WANTED = 1_000_000  # maximum number of participants that can be requested for a cell
METRICS_TYPE = "text/plain; version=0.0.4; charset=utf-8"
UNKNOWN = "Not found", "This page does not exist."
_PAGE = re.compile(r"\d{1,9}", re.ASCII)
Handler = Callable[[Request, Researcher], Awaitable[Response]]


@dataclass(frozen=True)
class ResearcherContext:
    """The data sources of the researcher's page."""

    study: Study
    store: Store
    sessions: Sessions
    metrics: ServerMetrics


class ResearcherServer:
    """A server for the researcher's page, the health check and the metrics.

    Args:
        public: Public URL of the page, or None if the page is not behind a proxy.
        proxies: Proxies whose X-Forwarded-For header is trusted.
    """

    def __init__(
        self, watched: ResearcherContext, public: str | None = None, proxies: tuple[Network, ...] = ()
    ) -> None:
        self._watched, self._public, self._proxies = watched, public, proxies
        self._study, self._store = watched.study, watched.store
        secure = public is not None and public.startswith("https:")
        self._access = Access(watched.store.researchers, secure=secure)

    def app(self, host: str) -> Starlette:
        """Create the ASGI application of a server that listens on `host`."""
        return Starlette(
            routes=[
                Route("/health", self._health),
                Route("/metrics", self._metrics),
                Route("/login", self._ask),
                Route("/login", self._log_in, methods=["POST"]),
                Route("/logout", self._for("viewer", self._log_out), methods=["POST"]),
                Route("/", self._for("viewer", self._overview)),
                Route("/people", self._for("viewer", self._people)),
                Route("/people/{number:int}", self._for("viewer", self._person)),
                Route("/people/{number:int}/watch", self._for("viewer", self._watch_page)),
                WebSocketRoute("/people/{number:int}/watch", self._watch),
                Route("/audit", self._for("assistant", self._audit)),
                Route("/pause", self._change("assistant", "open", "paused"), methods=["POST"]),
                Route("/continue", self._change("assistant", "paused", "open"), methods=["POST"]),
                Route("/stop", self._change("owner", None, "closed"), methods=["POST"]),
                Route("/reopen", self._change("owner", "closed", "open"), methods=["POST"]),
                Route("/quota", self._for("owner", self._set_quota), methods=["POST"]),
                scene_route(scenes_folder()),
                *static_routes(),
            ],
            middleware=middleware(host, self._public, self._proxies),
            exception_handlers={404: self._unknown, StoreError: self._out_of_order},
            lifespan=self._lifespan,
        )

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        logging.getLogger().addHandler(self._watched.metrics.log)
        try:
            yield
        finally:
            logging.getLogger().removeHandler(self._watched.metrics.log)

    def _for(self, role: Role, handler: Handler) -> Callable[[Request], Awaitable[Response]]:
        async def endpoint(request: Request) -> Response:
            who = await self._access.who(request)
            if who is None:
                return RedirectResponse("/login", 303)
            if not may(who, role):
                text = f"This page is for {role}s. You are logged in as {who.role}."
                return self._message(request, 403, "Not allowed", text)
            return await handler(request, who)

        return endpoint

    async def _health(self, request: Request) -> Response:  # noqa: ARG002
        try:
            async with asyncio.timeout(HEALTH_TIMEOUT):
                state = (await self._store.study()).state
        except (StoreError, TimeoutError):
            return JSONResponse({"database": "down"}, 503)
        limit = self._watched.sessions.limit
        sessions = {"capacity": limit.count, "in_use": len(limit.held), "waiting": limit.waiting}
        return JSONResponse({"database": "up", "study": state, "sessions": sessions})

    async def _metrics(self, request: Request) -> Response:  # noqa: ARG002
        text = self._watched.metrics.text(await self._store.counts(), self._watched.sessions)
        return Response(text, media_type=METRICS_TYPE)

    async def _ask(self, request: Request) -> Response:
        return page(request, "researcher/login", title=self._study.settings.title)

    async def _log_in(self, request: Request) -> Response:
        form = await sent_form(request)
        name, title = form.get("name", ""), self._study.settings.title
        if not self._access.may_try(request.client.host if request.client else "", name):
            note = "Too many attempts. Wait five minutes, then try again."
            return page(request, "researcher/login", 429, title=title, note=note)
        token = await self._access.log_in(request, name, form.get("password", ""))
        if token is None:
            LOG.warning("failed login to the researcher's page")
            known = name in {one.name for one in await self._store.researchers.all()}
            await self._store.audit(name if known else "unknown", "login failed")
            note = "Name or password is wrong."
            return page(request, "researcher/login", 403, title=title, note=note)
        await self._store.audit(name, "logged in")
        response = RedirectResponse("/", 303)
        self._access.remember(response, token)
        return response

    async def _log_out(self, request: Request, who: Researcher) -> Response:
        if (await sent_form(request)).get("where") == "everywhere":
            await self._store.researchers.change(who.name)
        await self._access.log_out(request)
        response = RedirectResponse("/login", 303)
        self._access.forget(response)
        return response

    async def _overview(self, request: Request, who: Researcher) -> Response:
        now = await overview(self._study, self._store, self._watched.sessions)
        return self._page(request, who, "overview", now=now, faults=self._watched.metrics.log.latest)

    async def _people(self, request: Request, who: Researcher) -> Response:
        find, asked = (request.query_params.get(name, "").strip() for name in ("find", "page"))
        people = [one for one in await self._store.people() if find.lower() in _described(one)]
        cells = {place.person_id: place.cell for place in await self._store.assignments()}
        last = max(1, math.ceil(len(people) / PAGE_SIZE))
        number = min(max(1, int(asked)), last) if _PAGE.fullmatch(asked) else 1
        shown = people[(number - 1) * PAGE_SIZE : number * PAGE_SIZE]
        return self._page(
            request,
            who,
            "people",
            people=[(one, cells.get(one.id), self._session(one)) for one in shown],
            found=len(people),
            find=find,
            number=number,
            last=last,
            labels=[cell.label for cell in self._study.cells],
        )

    async def _person(self, request: Request, who: Researcher) -> Response:
        person = await self._found(request.path_params["number"])
        if person is None:
            return self._message(request, 404, *UNKNOWN)
        return self._page(
            request,
            who,
            "person",
            person=person,
            session=self._session(person),
            place=await self._store.assignment(person.id),
            labels=[cell.label for cell in self._study.cells],
            phases=await self._store.phases(person.id),
            trials=await self._store.trials(person.id),
            payments=await self._store.ledger.history(person.id),
        )

    async def _watch_page(self, request: Request, who: Researcher) -> Response:
        person = await self._found(request.path_params["number"])
        if person is None:
            return self._message(request, 404, *UNKNOWN)
        return self._page(
            request, who, "watch", person=person, texts=trial_texts(words_of(self._study.texts))
        )

    async def _watch(self, socket: WebSocket) -> None:
        who = await self._access.who(socket)
        person = await self._found(socket.path_params["number"])
        session = None if person is None else self._session(person)
        if who is None or person is None or session is None:
            await socket.close(1008)
            return
        await self._store.audit(who.name, "watches", {"person": person.id})
        await socket.accept()
        watching = asyncio.create_task(BrowserSocket(socket).watch(session))
        try:
            while not (await asyncio.wait([watching], timeout=CHECK_PERIOD))[0]:
                if await self._access.who(socket) is None:
                    break  # the researcher has logged out
        finally:
            watching.cancel()
            with suppress(asyncio.CancelledError):
                await watching
        with suppress(RuntimeError, WebSocketDisconnect):  # the connection is already closed
            await socket.close(1008)

    async def _audit(self, request: Request, who: Researcher) -> Response:
        return self._page(request, who, "audit", rows=(await self._store.audit_log())[::-1])

    def _change(
        self, role: Role, before: StudyState | None, after: StudyState
    ) -> Callable[[Request], Awaitable[Response]]:
        """Create an endpoint that sets the state of the study to `after`. The old state must be `before`."""

        async def change(request: Request, who: Researcher) -> Response:
            state = (await self._store.study()).state
            if before is not None and state != before:
                return self._message(request, 409, "Not changed", f"The study is now {state}.")
            await self._store.set_state(after, who.name)
            LOG.info("the study is %s", after)
            return RedirectResponse("/", 303)

        return self._for(role, change)

    async def _set_quota(self, request: Request, who: Researcher) -> Response:
        form = await sent_form(request)
        numbers = [form.get(name, "") for name in ("cell", "wanted")]
        if not all(text.isascii() and text.isdecimal() and len(text) < 10 for text in numbers):
            return self._message(request, 400, "Not changed", "The quota must be a whole number from 0.")
        cell, wanted = map(int, numbers)
        if cell >= len(self._study.cells) or wanted > MAX_WANTED:
            return self._message(
                request, 400, "Not changed", "The cell does not exist, or the quota is too high."
            )
        await self._store.set_quota(cell, wanted, who.name)
        return RedirectResponse("/", 303)

    async def _found(self, number: int) -> PersonRow | None:
        return next((one for one in await self._store.people() if one.id == number), None)

    def _session(self, person: PersonRow) -> PlayedSession | None:
        session = self._watched.sessions.under_way.get(person.token_hash)
        return session if session and person.active and session.trial is not None else None

    def _page(self, request: Request, who: Researcher, name: str, **values: Any) -> Response:
        common: dict[str, Any] = {"who": who, "title": self._study.settings.title, "name_of": person_name}
        allowed = {role: may(who, role) for role in ("assistant", "owner")}
        return page(request, f"researcher/{name}", **common, may=allowed, **values)

    def _message(self, request: Request, status: int, title: str, text: str) -> Response:
        return page(request, "message", status, title=title, text=text)

    async def _unknown(self, request: Request, _: Exception) -> Response:
        return self._message(request, 404, *UNKNOWN)

    async def _out_of_order(self, request: Request, error: Exception) -> Response:
        LOG.error("%s", error)
        return self._message(
            request, 503, "Database unavailable", "The request failed. The log has the reason."
        )


def _described(person: PersonRow) -> str:
    return f"{person_name(person)} {person.status.replace('_', ' ')} {person.phase}".lower()
