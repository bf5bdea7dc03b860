"""Trials of people: their page, and the sockets over which they are played."""

import asyncio
import logging
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass

from starlette.requests import Request
from starlette.responses import Response
from starlette.websockets import WebSocket

from experiments.errors import StoreError
from experiments.people.server.procedure import Procedure
from experiments.people.store import Person
from experiments.web.server.browser_socket import BrowserSocket
from experiments.web.server.capacity import Capacity, usable_cores
from experiments.web.server.limit import SessionLimit
from experiments.web.server.meter import Meter
from experiments.web.server.pages import page, trial_texts
from experiments.web.server.pool import WorkerPool
from experiments.web.server.sessions import Sessions
from experiments.web.server.visits import PLAYED, Visit

LOG = logging.getLogger("mjsim.study")
BEAT_PERIOD = 60.0  # s between two notes that somebody is still there
SOCKETS_OF_A_PERSON = 2  # open at a time
REAL_TIME_EVERY = 20  # people of a rehearsal of whom one plays in real time
NEVER = 1e9  # s; as good as for ever
REFRESH = 10.0, 30.0  # s after which a page in the queue asks again, at least and at most
PATIENCE = 2.5  # times as long others wait for it


@dataclass(frozen=True)
class Queued:
    """Somebody who waits for a place.

    Attributes:
        position: 1 for who is next.
        wait: How long that is expected to take, s.
        refresh: After which the page is to ask again, s.
    """

    position: int
    wait: float
    refresh: float


class Trials:
    """Trials under way on this server.

    Args:
        procedure: Of the study.
        pool: Makes workers.
        workers: How many trials may run at a time; None for as many as the machine holds.
        meter: Is told what sessions measure.

    Attributes:
        sessions: Those under way.
    """

    def __init__(
        self, procedure: Procedure, pool: WorkerPool, workers: int | None, meter: Meter | None
    ) -> None:
        self._study, self._store = procedure.study, procedure.store
        settings = self._study.settings
        self._minimum = {name: 0.0 if name in settings.optional else NEVER for name in PLAYED}
        capacity = Capacity(usable_cores()) if workers is None else None
        self._limit = SessionLimit(workers or (capacity.measure({}, ()) if capacity else 1))
        self.sessions = Sessions(
            pool,
            self._limit,
            settings.limits.idle,
            self._minimum,
            meter,
            capacity,
            floor_plans=False,
            language=settings.language,
            texts=self._study.words["hud"],
        )
        self._usual = 60.0 * settings.minutes  # of the whole study, until trials have ended
        self._sockets: Counter[int] = Counter()  # by person

    def queued(self, visit: str) -> Queued | None:
        """Where a visit is in the queue, by its name; None if its trial may run."""
        wait = self._limit.expected_wait(self._limit.waiting + 1, self._usual)
        refresh = min(max(REFRESH[0], wait / 10.0), REFRESH[1])
        position = self._limit.ask(visit, PATIENCE * refresh)
        if position is None:
            return None
        return Queued(position, self._limit.expected_wait(position, self._usual), refresh)

    def page(self, request: Request, visit: Visit) -> Response:
        """The page of the trial that is next or under way."""
        settings = visit.settings(visit.phase)
        return page(
            request,
            "play",
            lang=self._study.settings.language,
            texts=trial_texts(self._study.words),
            trial=visit.phase,
            objects=settings["objects"],
            draw=settings["draw"],
            scene=self.sessions.scene(settings),
            wait=self._minimum[visit.phase],
            leave=f"{request.url.path}/withdrawal",
        )

    async def play(self, socket: WebSocket, person: Person, visit: Visit) -> None:
        if not person.active or visit.phase not in PLAYED or self._sockets[person.id] >= SOCKETS_OF_A_PERSON:
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
