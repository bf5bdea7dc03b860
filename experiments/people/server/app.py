"""The server of a study: a welcome, the phases one after the other, the end. Trials are played as in `mjsim play`."""

import asyncio
import base64
import datetime
import hashlib
import hmac
import logging
import time
from collections import Counter
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from experiments.errors import StoreError
from experiments.people.phases.base import Again, Page
from experiments.people.phases.played import Played
from experiments.people.recruitment.base import Arrival, Leaving, Preview, Recruiter, Refusal
from experiments.people.retention import forget_daily
from experiments.people.server.host import HostOfVisits
from experiments.people.server.procedure import Now, Procedure
from experiments.people.store import Person, utc_now
from experiments.people.study_file import CONSENT
from experiments.web.server.browser_socket import BrowserSocket
from experiments.web.server.form import sent_form
from experiments.web.server.guards import Guards, Network, Rate, allowed_hosts
from experiments.web.server.limit import SessionLimit
from experiments.web.server.meter import Meter
from experiments.web.server.pages import page
from experiments.web.server.pool import WorkerPool
from experiments.web.server.scene_files import scene_route
from experiments.web.server.sessions import Sessions
from experiments.web.server.static_files import static_routes
from experiments.web.server.visits import PLAYED, TOKEN, new_token, token_hash
from mjsim.scene_export.store import scenes_folder

LOG = logging.getLogger("mjsim.study")
NEW_PEOPLE = 60, 60.0  # people from one address, within this time, s
BEAT_PERIOD = 60.0  # s between two notes that somebody is still there
SWEEP_PERIOD = 60.0  # s between two looks for people who never return
CLOCK_SET = 30.0  # s by which the clock is off once it was set, or the machine slept
SOCKETS_OF_A_PERSON = 2  # open at a time
FILM_HEADERS = {"Cache-Control": "private, max-age=86400"}
REAL_TIME_EVERY = 20  # people of a rehearsal of whom one plays in real time
NEVER = 1e9  # s; as good as for ever
MAX_FORM = 64 * 1024  # bytes


@dataclass(frozen=True)
class Serving:
    """What a server needs besides the study.

    Attributes:
        secret: Key from which tokens of people with a platform's id are made.
        film: Of the house, if the study shows one.
        proxies: Whose word about the address of a person is believed.
        meter: Is told what sessions measure.
        host: Name of this host, where several share a database; None for the only one.
    """

    secret: bytes
    film: Path | None = None
    proxies: tuple[Network, ...] = ()
    meter: Meter | None = None
    host: str | None = None


class _ElsewhereError(Exception):
    """Another host has a person."""


class StudyServer:
    """Pages and sockets of a study.

    Attributes:
        sessions: Those under way.
    """

    def __init__(
        self, procedure: Procedure, recruiter: Recruiter, pool: WorkerPool, serving: Serving
    ) -> None:
        self._procedure, self._recruiter, self._serving = procedure, recruiter, serving
        self._study, self._store = procedure.study, procedure.store
        limits = self._study.settings.limits
        self._pool = pool
        optional = self._study.settings.optional
        self._minimum = {name: 0.0 if name in optional else NEVER for name in PLAYED}
        self.sessions = Sessions(
            pool, SessionLimit(limits.sessions), limits.idle, self._minimum, serving.meter
        )
        self._new = Rate(*NEW_PEOPLE)
        self._sockets: Counter[int] = Counter()  # by person
        self._host = (
            None if serving.host is None else HostOfVisits(serving.host, self._store, procedure.visits)
        )
        self._locks: dict[str, asyncio.Lock] = {}

    def app(self, host: str, public: str | None = None) -> Starlette:
        """The ASGI application that listens at `host`; `public` is the URL under which a proxy makes it public."""
        return Starlette(
            routes=[
                Route("/", self._welcome),
                Route("/begin", self._begin, methods=["POST"]),
                Route("/play/{token}", self._show),
                Route("/play/{token}", self._submit, methods=["POST"]),
                Route("/play/{token}/answers", self._save, methods=["POST"]),
                Route("/play/{token}/withdrawal", self._ask_to_leave),
                Route("/play/{token}/withdrawal", self._leave, methods=["POST"]),
                Route("/play/{token}/film", self._film),
                Route("/play/{token}/ping", self._ping),
                WebSocketRoute("/play/{token}", self._play),
                scene_route(scenes_folder()),
                *static_routes(),
            ],
            middleware=[
                Middleware(
                    TrustedHostMiddleware, allowed_hosts=allowed_hosts(host, public), www_redirect=False
                ),
                Middleware(
                    Guards,
                    public=public,
                    proxies=self._serving.proxies,
                    max_body=MAX_FORM,
                    embedded_by=self._recruiter.embedded_by,
                ),
            ],
            exception_handlers={
                404: self._unknown,
                _ElsewhereError: self._elsewhere,
                StoreError: self._out_of_order,
            },
            lifespan=self._lifespan,
        )

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        tasks = [asyncio.create_task(task) for task in (self.sessions.watch(), self._sweep())]
        if days := self._study.settings.limits.keep_days:
            visits = self._procedure.visits.folder
            tasks.append(asyncio.create_task(forget_daily(self._store, visits, days)))
        if self._host is not None:
            tasks.append(asyncio.create_task(self._host.keep(self.sessions)))
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
                with suppress(StoreError):  # it is silent soon
                    await self._host.leave()
            await self._store.close()

    async def _sweep(self) -> None:
        """End the participation of people who never return. Time in which this server did not run does not count."""
        away = self._study.settings.limits.timed_out_after
        since = time.monotonic()
        ahead = time.time() - since
        while True:
            await asyncio.sleep(SWEEP_PERIOD)
            now = time.monotonic()
            if abs(time.time() - now - ahead) > CLOCK_SET:  # signs of life are noted by that clock
                since, ahead = now, time.time() - now
            if now - since < away:
                continue
            try:
                await self._end_abandoned(utc_now() - datetime.timedelta(seconds=away))
            except StoreError as error:  # the next sweep may find them
                LOG.warning("%s", error)

    async def _end_abandoned(self, before: datetime.datetime) -> None:
        """End the participation of people of whom there is no sign of life since then.

        A trial that was over when its page was closed is noted; its person may still answer the survey.
        """
        for person in await self._store.people():
            if person.active and person.seen < before and person.phase in PLAYED:
                async with self._lock(person):
                    await self._procedure.after_trials(person)
        if gone := await self._store.time_out(before):
            LOG.info("%d people did not return", gone)

    async def _welcome(self, request: Request) -> Response:
        came = self._recruiter.arrive(request.query_params)
        if isinstance(came, Refusal):
            LOG.warning("a link was refused: %s", came.reason)
            return self._message(request, "unknown", 400)
        if isinstance(came, Arrival) and came.key is not None:
            token = self._token(came.key)
            if await self._store.find(token_hash(token)) is not None:
                return await self._arrive(came, token)
        if (closed := await self._closed()) is not None:
            return self._message(request, closed)
        given = {name: request.query_params.get(name, "") for name in self._recruiter.parameters}
        return self._page(
            request,
            "welcome",
            section=self._study.texts["welcome"],
            parameters=given,
            remembers=self._recruiter.platform == "link",
            forgets=self._recruiter.platform == "lab",
            preview=isinstance(came, Preview),
        )

    async def _begin(self, request: Request) -> Response:
        if not self._new.allows(request.client.host if request.client else ""):
            return self._message(request, "paused", 429)
        came = self._recruiter.arrive(
            {name: str(value) for name, value in (await sent_form(request)).items()}
        )
        if not isinstance(came, Arrival):
            return self._message(request, "unknown", 400)
        token = new_token() if came.key is None else self._token(came.key)
        if await self._store.find(token_hash(token)) is None and (closed := await self._closed()) is not None:
            return self._message(request, closed)
        return await self._arrive(came, token)

    async def _arrive(self, came: Arrival, token: str) -> Response:
        """Note who comes, or comes again."""
        key = None if came.key is None else self._keyed(f"key:{came.key}").hex()
        person = await self._store.arrive(
            self._recruiter.platform, key, came.identity, token_hash(token), self._procedure.phases[0].name
        )
        if not person.returning:
            LOG.info("person %d arrives", person.id)
        return RedirectResponse(f"/play/{token}", 303)

    async def _show(self, request: Request) -> Response:
        person = await self._person(request)
        if person is None:
            return self._message(request, "unknown", 404)
        return await self._show_phase(request, person)

    async def _submit(self, request: Request) -> Response:
        person = await self._person(request)
        if person is None:
            return self._message(request, "unknown", 404)
        form = await sent_form(request)
        async with self._lock(person):
            now = await self._procedure.now(person, request.url.path)
            refused = await self._procedure.submit(now, str(form.get("phase", "")), form)
        if refused is not None:
            return await self._show_phase(request, person, refused)
        return RedirectResponse(request.url.path, 303)

    async def _save(self, request: Request) -> Response:
        person = await self._person(request)
        if person is None:
            return Response(status_code=404)
        form = await sent_form(request)
        async with self._lock(person):  # so that an answer does not replace a later one
            now = await self._procedure.now(person, request.url.path)
            await self._procedure.save(now, str(form.get("phase", "")), form)
        return Response(status_code=204)

    async def _ask_to_leave(self, request: Request) -> Response:
        person = await self._person(request)
        if person is None or not person.active:
            return self._message(request, "unknown", 404)
        path = f"/play/{request.path_params['token']}"
        return self._page(request, "withdrawal", section=self._study.texts["withdrawal"], path=path)

    async def _leave(self, request: Request) -> Response:
        person = await self._person(request)
        if person is None or not person.active:
            return self._message(request, "unknown", 404)
        form = await sent_form(request)
        async with self._lock(person):
            await self.sessions.release(lambda session: session.visit.name == person.token_hash)
            await self._procedure.withdraw(person, delete=form.get("data") == "delete")
        return RedirectResponse(f"/play/{request.path_params['token']}", 303)

    async def _film(self, request: Request) -> Response:
        if await self._person(request) is None or self._serving.film is None:
            return PlainTextResponse("not found\n", 404)
        return FileResponse(self._serving.film, headers=FILM_HEADERS, media_type="video/mp4")

    async def _ping(self, request: Request) -> Response:  # noqa: ARG002 - only the time counts
        return Response(status_code=204)

    async def _play(self, socket: WebSocket) -> None:
        token = socket.path_params["token"]
        person = await self._store.find(token_hash(token)) if TOKEN.fullmatch(token) else None
        visit = None if person is None else await asyncio.to_thread(self._procedure.visits.find, token)
        if person is not None and self._host is not None and not await self._host.has(person):
            await socket.send_denial_response(Response(status_code=404))  # the proxy asks the next host
            return
        if person is None or visit is None or not person.active or visit.phase not in PLAYED:
            await socket.close(1008)
            return
        if self._sockets[person.id] >= SOCKETS_OF_A_PERSON:
            await socket.close(1008)
            return
        self._sockets[person.id] += 1
        beating = asyncio.create_task(self._beat(person))
        try:
            await socket.accept()
            hurries = self._study.rehearsal and person.id % REAL_TIME_EVERY > 0
            session = self.sessions.of(visit, as_inputs_come=hurries)
            await BrowserSocket(socket).serve(session, visit.phase)
        finally:
            self._sockets.subtract([person.id])
            self._sockets += Counter()  # forgets those without any
            beating.cancel()
            with suppress(asyncio.CancelledError):
                await beating

    async def _beat(self, person: Person) -> None:
        while True:
            try:
                await self._store.beat(person.id)
            except StoreError as error:  # the next one may be noted
                LOG.warning("%s", error)
            await asyncio.sleep(BEAT_PERIOD)

    async def _show_phase(self, request: Request, person: Person, refused: Again | None = None) -> Response:
        async with self._lock(person):
            now = await self._procedure.now(person, request.url.path)
            if isinstance(now.phase, Played):
                return await self._played(request, now)
        if now.phase is None:
            return self._left(request, now.person)
        shown = now.phase.page(now.visitor, refused)
        if now.number == len(self._procedure.phases):
            return await self._end(request, now.person, shown)
        return self._page(request, shown.template, **{**self._around(now), **shown.values})

    def _around(self, now: Now) -> dict[str, Any]:
        """What the pages of all phases have."""
        common, name = self._study.texts["common"], now.phase.name if now.phase else ""
        step = common["step"].replace("{step}", str(now.number))
        section = self._study.texts.get(name)
        return {
            "step": step.replace("{steps}", str(len(self._procedure.phases))),
            "path": now.visitor.path,
            "phase": name,
            "wait": now.wait,
            "optional": name in self._study.settings.optional,
            "leave": name != CONSENT,
            "paragraphs": section.paragraphs() if section else [],
            "story_title": self._study.texts["story"]["title"],
        }

    async def _played(self, request: Request, now: Now) -> Response:
        token = request.path_params["token"]
        visit = await self._procedure.visit(now.person, token)
        if visit is None:
            return self._message(request, "full")
        settings = visit.settings(visit.phase)
        return page(
            request,
            "play",
            trial=visit.phase,
            objects=settings["objects"],
            draw=settings["draw"],
            scene=self.sessions.scene(settings),
            wait=self._minimum[visit.phase],
            leave=f"{request.url.path}/withdrawal",
        )

    async def _end(self, request: Request, person: Person, shown: Page) -> Response:
        back = self._recruiter.way_back("finished", await self._store.identity(person.id))
        section = self._study.texts["completion"]
        values = {**shown.values, "paragraphs": section.paragraphs(), "completion": section}
        return self._page(request, shown.template, **values, back=back, finished=True)

    def _left(self, request: Request, person: Person) -> Response:
        """The last page of somebody who did not finish."""
        names: Mapping[str, tuple[str, str, Leaving]] = {
            "no_consent": ("consent", "declined", "no_consent"),
            "withdrawn": ("withdrawal", "left", "withdrawn"),
            "screened_out": (person.phase, "failed", "screened_out"),
        }
        section, text, how = names.get(person.status, ("welcome", "timed_out", "timed_out"))
        words = self._study.texts[section]
        back = self._recruiter.way_back(how, {})
        heading = {"title": words[f"{text}_title"]}
        return self._page(
            request,
            "completion",
            section=heading,
            paragraphs=[words[text]],
            completion=self._study.texts["completion"],
            back=back,
        )

    def _message(self, request: Request, name: str, status: int = 200) -> Response:
        words = self._study.texts["welcome"]
        heading = {"title": words[f"{name}_title"]}
        return self._page(request, "study", status, section=heading, paragraphs=[words[name]])

    async def _out_of_order(self, request: Request, error: Exception) -> Response:
        LOG.error("%s", error)
        return self._message(request, "paused", 503)

    async def _unknown(self, request: Request, _: Exception) -> Response:
        return self._message(request, "unknown", 404)

    def _page(self, request: Request, template: str, status: int = 200, **values: Any) -> Response:
        section: Any = values.get("section")
        if "paragraphs" not in values:
            values["paragraphs"] = section.paragraphs()
        return page(
            request,
            template,
            status,
            common=self._study.texts["common"],
            lang=self._study.settings.language,
            **values,
        )

    async def _closed(self) -> str | None:
        """Why nobody new may come: the name of a text; None if people may."""
        state = (await self._store.study()).state
        return {"open": None, "paused": "paused"}.get(state, "full")

    async def _elsewhere(self, request: Request, _: Exception) -> Response:
        """With 404 a proxy asks the next host; where there is none, the person reads this."""
        return self._message(request, "paused", 404)

    async def _person(self, request: Request) -> Person | None:
        token = request.path_params["token"]
        person = await self._store.find(token_hash(token)) if TOKEN.fullmatch(token) else None
        if person is not None and self._host is not None and not await self._host.has(person):
            raise _ElsewhereError
        return person

    def _lock(self, person: Person) -> asyncio.Lock:
        """Held while a person's phase is read or changed, so that two pages of one person take turns."""
        return self._locks.setdefault(person.token_hash, asyncio.Lock())

    def _token(self, key: str) -> str:
        """The token of a platform's person, the same whenever that person comes."""
        return base64.urlsafe_b64encode(self._keyed(f"token:{key}")).decode().rstrip("=")

    def _keyed(self, text: str) -> bytes:
        name = self._study.settings.name
        return hmac.new(self._serving.secret, f"{name}:{text}".encode(), hashlib.sha256).digest()
