"""Trials of people: their page, and the sockets over which they are played."""

import asyncio
import logging
import math
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass

from starlette.requests import Request
from starlette.responses import Response
from starlette.websockets import WebSocket

from experiments.errors import StoreError
from experiments.record.phases import TASK
from experiments.visit.folders import VisitFolder
from experiments.visit.plan import PLAYED
from experiments.visit.procedure import BrowserPlayer, Now, Procedure
from experiments.visit.store import Person
from experiments.visit.texts import words_of
from experiments.web.server.browser_socket import BrowserSocket
from experiments.web.server.capacity import Capacity, usable_cores
from experiments.web.server.limit import SessionLimit
from experiments.web.server.pages import page, trial_texts
from experiments.web.server.player import Meter
from experiments.web.server.pool import WorkerPool
from experiments.web.server.sessions import Sessions

LOG = logging.getLogger("mjsim.study")
BEAT_PERIOD = 60.0  # s between two notes that somebody is still there
SOCKETS_OF_A_PERSON, SOCKETS_OF_AN_ADDRESS = 2, 20  # open at a time
REAL_TIME_EVERY = 20  # people of a rehearsal of whom one plays in real time
NEVER = 1e9  # seconds; HTML has no infinity
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
        self._procedure, self._plan, self._store = procedure, procedure.plan, procedure.store
        capacity = Capacity(usable_cores()) if workers is None else None
        self._limit = SessionLimit(workers or (capacity.measure({}, ()) if capacity else 1))
        self.sessions = Sessions(pool, self._limit, self._plan.limits.idle, meter, capacity)
        self._default_wait = 60.0 * self._plan.minutes  # of a whole visit, until trials have ended
        self._sockets: Counter[str] = Counter()  # by participant and by address

    def queued(self, visit: str) -> Queued | None:
        """Where a visit is in the queue, by its name; None if its trial may run."""
        wait = self._limit.expected_wait(self._limit.waiting + 1, self._default_wait)
        refresh = min(max(REFRESH[0], wait / 10.0), REFRESH[1])
        position = self._limit.ask(visit, PATIENCE * refresh)
        if position is None:
            return None
        return Queued(position, self._limit.expected_wait(position, self._default_wait), refresh)

    def page(self, request: Request, now: Now, folder: VisitFolder) -> Response:
        """Show the page of the trial that is next or under way."""
        phase = now.person.phase
        settings = folder.settings(phase)
        by_hand = self._plan.minimum.get(TASK, 0.0) < math.inf
        return page(
            request,
            "play",
            lang=self._plan.language,
            texts=trial_texts(words_of(self._plan.texts)),
            trial=phase,
            objects=settings["objects"],
            draw=settings["draw"],
            scene=self.sessions.scene(settings),
            wait=min(now.wait, NEVER),
            leave="" if by_hand else f"{request.url.path}/withdrawal",
            xr=self._plan.headset,
        )

    async def play(self, socket: WebSocket, person: Person) -> None:
        player, address = BrowserPlayer(self._procedure, person), socket.client.host if socket.client else ""
        sockets = (person.token_hash, address)
        folder = self._procedure.folders.find(person.token_hash)
        if not person.active or person.phase not in PLAYED or folder is None or not self._has_room(*sockets):
            await socket.close(1008)
            return
        self._sockets.update(sockets)
        beating = asyncio.create_task(self._beat(person))
        try:
            await socket.accept()
            hurries = self._plan.rehearsal and person.id % REAL_TIME_EVERY > 0
            session = self.sessions.of(player, as_inputs_come=hurries)
            await BrowserSocket(socket).serve(session)
        finally:
            self._sockets.subtract(sockets)
            self._sockets += Counter()  # forgets those without any
            beating.cancel()
            with suppress(asyncio.CancelledError):
                await beating

    def _has_room(self, participant: str, address: str) -> bool:
        """Return whether one more socket of a participant and an address is served."""
        # All participants may be behind one address. A page that is loaded again has two sockets for a moment.
        playing = max(self._limit.count, len(self._limit.held))
        from_address = max(SOCKETS_OF_AN_ADDRESS, SOCKETS_OF_A_PERSON * playing)
        return self._sockets[participant] < SOCKETS_OF_A_PERSON and self._sockets[address] < from_address

    async def _beat(self, person: Person) -> None:
        while True:
            try:
                await self._store.beat(person.id)
            except StoreError as error:  # the next one may be noted
                LOG.warning("%s", error)
            await asyncio.sleep(BEAT_PERIOD)
