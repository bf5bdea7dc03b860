"""The server of `mjsim play`: pages, links, WebSockets. It simulates nothing; workers do (`experiments.web.worker`)."""

import asyncio
import logging
from collections import Counter
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from msgspec.structs import replace
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from experiments.errors import RecordError
from experiments.house import read_words
from experiments.procedure.comprehension import Question
from experiments.record.phases import FLYTHROUGH, STORY, TASK, TRAINING
from experiments.web.server.browser_socket import BrowserSocket
from experiments.web.server.guards import Guards, Network, Rate, allowed_hosts
from experiments.web.server.limit import SessionLimit
from experiments.web.server.pages import message_page, page, trial_texts
from experiments.web.server.pool import WorkerPool
from experiments.web.server.readings import Readings
from experiments.web.server.scene_files import scene_route
from experiments.web.server.sessions import Sessions
from experiments.web.server.static_files import static_routes
from experiments.web.server.visits import PLAYED, RESULT, Ended, Visits, following, new_token, token_hash
from mjsim.formats.gltf.store import scenes_folder

LOG = logging.getLogger("mjsim.play")
MAX_QUEUE = 100  # visits that may wait for a place
NEW_VISITS = 30, 60.0  # visits from one address, within this time, s
SOCKETS_OF_A_VISIT, SOCKETS_OF_AN_ADDRESS = 2, 20  # open at a time
FILM_HEADERS = {"Cache-Control": "private, max-age=86400"}
INTERNAL_ERROR = "Internal server error"


@dataclass(frozen=True)
class PlayConfig:
    """Settings of a server: the options of `mjsim play`, and the settings of the trials `training` and `task`."""

    phases: Sequence[str]
    trials: Mapping[str, dict[str, Any]]
    folder: Path
    sessions: int = 1
    idle: float = 1800.0
    film: Path | None = None
    story: str = ""
    minimum: Mapping[str, float] = field(default_factory=dict)  # s by phase before which it cannot be ended
    questions: Sequence[Question] = ()  # about the story
    proxies: Sequence[Network] = ()  # whose word about the address of a person is believed
    xr: bool = False  # whether a page offers a headset


class PlayServer:
    """Pages and sockets, and all sessions."""

    def __init__(self, config: PlayConfig, pool: WorkerPool) -> None:
        self._config = config
        self._visits = Visits(config.folder)
        self._pool, self._limit = pool, SessionLimit(config.sessions)
        self.sessions = Sessions(pool, self._limit, config.idle, config.minimum)
        self._new = Rate(*NEW_VISITS)
        self._readings = Readings()
        self._sockets: Counter[str] = Counter()  # by visit and by address

    def app(self, host: str, public: str | None = None) -> Starlette:
        """The ASGI application that listens at `host`; `public` is the URL under which a proxy makes it public."""
        return Starlette(
            routes=[
                Route("/", self._story),
                Route("/visits", self._begin, methods=["POST"]),
                Route("/play/{token}", self._visit),
                Route("/play/{token}/film", self._film),
                Route("/play/{token}/film", self._film_seen, methods=["POST"]),
                Route("/play/{token}/floor-plan.png", self._floor_plan),
                WebSocketRoute("/play/{token}", self._play),
                scene_route(scenes_folder()),
                *static_routes(),
            ],
            middleware=[
                Middleware(
                    TrustedHostMiddleware, allowed_hosts=allowed_hosts(host, public), www_redirect=False
                ),
                Middleware(Guards, public=public, proxies=self._config.proxies),
            ],
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
        watching = asyncio.create_task(self.sessions.watch())
        try:
            yield
        finally:
            watching.cancel()
            with suppress(asyncio.CancelledError):
                await watching
            await self.sessions.release()
            await self._pool.close()

    def _story(self, request: Request) -> Response:
        return self._story_page(request, self._readings.open(), request.query_params.get("after", ""))

    def _story_page(self, request: Request, opened: str, after: str, note: str = "") -> Response:
        reading = self._readings.reading(opened)
        read = reading.duration_s if reading else 0.0
        return page(
            request,
            "story",
            200,
            wait=max(0.0, self._config.minimum.get(STORY, 0.0) - read),
            questions=self._config.questions,
            note=note,
            story=[text for text in self._config.story.split("\n\n") if text.strip()],
            condition=str(self._config.trials[TASK]["assistance"]).split("-")[0],
            training=TRAINING in self._config.phases,
            opened=opened,
            after=after,
        )

    async def _begin(self, request: Request) -> Response:
        if not self._new.allows(request.client.host if request.client else ""):
            return message_page(request, 429, "Too many visits", "Please wait a minute, then try again.")
        if self._limit.waiting >= MAX_QUEUE:
            return message_page(request, 503, "All places are taken", "Please come back later.")
        left_out = (STORY,) if self._config.film else (STORY, FLYTHROUGH)
        phases = [name for name in self._config.phases if name not in left_out]
        form = {
            name: values[0]
            for name, values in parse_qs((await request.body()).decode("utf-8", "replace")).items()
        }
        after, opened = form.get("after", ""), form.get("opened", "")
        reading = self._readings.reading(opened)
        if STORY in self._config.phases and (note := self._fault(reading, form)):
            if reading:
                self._readings.fail(opened)
            return self._story_page(request, opened if reading else self._readings.open(), after, note)
        ended = [self._ended(reading)] if STORY in self._config.phases else []
        trials = await run_in_threadpool(self._trials, after)
        token = new_token()
        visit = await run_in_threadpool(self._visits.create, token, phases, trials, ended)
        LOG.info("session %s begins", visit.name[:12])
        return RedirectResponse(f"/play/{token}", 303)

    def _trials(self, after: str) -> Mapping[str, dict[str, Any]]:
        """Settings of a visit's trials: the order seed of the settings or, for later visits, a following one.

        Who has seen the best way through an episode gets the next one.
        """
        number, before = self._visits.number(), self._visits.find(after)
        trials = {
            name: {**trial, "order_seed": following(trial["order_seed"], number)}
            for name, trial in self._config.trials.items()
        }
        if before is None or before.phase != RESULT:
            return trials
        return {
            name: {**trial, "house_seed": following(before.settings(name)["house_seed"])}
            for name, trial in trials.items()
        }

    def _ended(self, reading: Ended | None) -> Ended:
        """The phase of reading the story as the log has it; no duration is known of a form that is not the server's."""
        if reading is None:
            return Ended(STORY, 0.0)
        return reading if self._config.questions else replace(reading, attempts=None)

    def _fault(self, reading: Ended | None, form: Mapping[str, str]) -> str:
        """Why the story has to be read on; empty if it was read and understood."""
        minimum = self._config.minimum.get(STORY, 0.0)
        if (reading.duration_s if reading else 0.0) < minimum or (reading is None and self._config.questions):
            return "Please take the time to read the text."
        answers = [form.get(f"answer{i}") for i in range(len(self._config.questions))]
        right = [question.answer for question in self._config.questions]
        return "" if answers == right else "Not all answers are right. Please read the text again."

    def _visit(self, request: Request) -> Response:
        visit = self._visits.find(request.path_params["token"])
        if visit is None:
            return _not_found(request, None)
        if visit.phase == FLYTHROUGH and self._config.film is None:
            visit.finish(FLYTHROUGH)
        if visit.phase != RESULT:
            visit.show()
        wait = visit.wait(self._config.minimum)
        if visit.phase == FLYTHROUGH:
            return page(request, "film", wait=wait)
        if visit.phase in PLAYED:
            settings = visit.settings(visit.phase)
            return page(
                request,
                "play",
                texts=trial_texts(read_words()),
                trial=visit.phase,
                objects=settings["objects"],
                draw=settings["draw"],
                scene=self.sessions.scene(settings),
                wait=wait,
                xr=self._config.xr,
            )
        again = visit.settings(TASK)["episode"] is None  # else there is but one, whose best way was shown
        words, token = read_words(), request.path_params["token"]
        texts = {**words["hud"], **words["result"]}
        return page(request, "result", texts=texts, metrics=visit.metrics(TASK), again=again, token=token)

    def _film(self, request: Request) -> Response:
        visit = self._visits.find(request.path_params["token"])
        if visit is None or self._config.film is None:
            return _not_found(request, None)
        return FileResponse(self._config.film, headers=FILM_HEADERS, media_type="video/mp4")

    def _film_seen(self, request: Request) -> Response:
        visit = self._visits.find(request.path_params["token"])
        if visit is None:
            return _not_found(request, None)
        if visit.phase == FLYTHROUGH and not visit.wait(self._config.minimum):
            visit.finish(FLYTHROUGH)
        return RedirectResponse(request.url.path.removesuffix("/film"), 303)

    def _floor_plan(self, request: Request) -> Response:
        visit = self._visits.find(request.path_params["token"])
        if visit is None or visit.phase != RESULT or not visit.floor_plan.is_file():
            return _not_found(request, None)
        return FileResponse(visit.floor_plan, media_type="image/png")

    async def _play(self, socket: WebSocket) -> None:
        token, address = socket.path_params["token"], socket.client.host if socket.client else ""
        visit = None
        try:
            if self._has_room(token_hash(token), address):
                visit = await run_in_threadpool(self._visits.find, token)
        except (RecordError, OSError) as error:
            LOG.error("%s", error)
        if visit is None or not self._has_room(visit.name, address):  # others may have come meanwhile
            await socket.close(1008)
            return
        self._sockets.update((visit.name, address))
        try:
            await socket.accept()
            await BrowserSocket(socket).serve(self.sessions.of(visit), visit.phase)
        finally:
            self._sockets.subtract((visit.name, address))
            self._sockets += Counter()  # forgets those without any

    def _has_room(self, visit: str, address: str) -> bool:
        """Whether one more socket of a visit and an address is served."""
        from_address = max(SOCKETS_OF_AN_ADDRESS, self._config.sessions)  # all may sit behind one address
        return self._sockets[visit] < SOCKETS_OF_A_VISIT and self._sockets[address] < from_address


def _not_found(request: Request, _: Any) -> Response:
    if request.url.path.startswith("/static"):
        return PlainTextResponse("not found\n", 404)
    return message_page(request, 404, "This page does not exist", "The link may be incomplete.")


def _damaged(request: Request, error: Exception) -> Response:
    LOG.error("%s", error)
    return message_page(
        request, 500, INTERNAL_ERROR, "The server cannot read or write its files at the moment."
    )


def _failed(request: Request, _: Exception) -> Response:
    return message_page(request, 500, INTERNAL_ERROR, "What you did so far is kept. Please try again.")
