"""Serve the web page and the WebSocket of each participant's trials."""

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
from experiments.visit.procedure import BrowserPlayer, PhaseState, Procedure
from experiments.visit.store import PersonRow
from experiments.visit.texts import words_of
from experiments.web.client_files import page, trial_texts
from experiments.web.server.browser_socket import BrowserSocket
from experiments.web.server.limit import SessionLimit
from experiments.web.server.player import Meter
from experiments.web.server.pool import WorkerPool
from experiments.web.server.sessions import Capacity, Sessions, usable_cores

LOG = logging.getLogger("mjsim.study")
BEAT_PERIOD = 60.0  # interval at which a participant's activity is recorded, in seconds
SOCKETS_OF_A_PERSON, SOCKETS_OF_AN_ADDRESS = 2, 20  # maximum WebSockets per participant and per address
REAL_TIME_EVERY = 20  # during a rehearsal, one in this many participants plays in real time
NEVER = 1e9  # finite number of seconds that represents an infinite duration in HTML
REFRESH = 10.0, 30.0  # shortest and longest polling interval of the queue page, in seconds
PATIENCE = 2.5  # number of polling intervals without a request after which other pages may overtake a page


@dataclass(frozen=True)
class Queued:
    """A participant's position in the queue.

    Attributes:
        position: Position in the queue, counted from 1.
        wait: Expected waiting time, in seconds.
        refresh: Time until the page reloads itself, in seconds.
    """

    position: int
    wait: float
    refresh: float


class Trials:
    """The trials that are currently running on this server.

    Args:
        workers: Maximum number of concurrent trials, or None to measure the machine's capacity.
    """

    def __init__(
        self, procedure: Procedure, pool: WorkerPool, workers: int | None, meter: Meter | None
    ) -> None:
        self._procedure, self._plan, self._store = procedure, procedure.plan, procedure.store
        capacity = Capacity(usable_cores()) if workers is None else None
        self._limit = SessionLimit(workers or (capacity.measure({}, ()) if capacity else 1))
        self.sessions = Sessions(pool, self._limit, self._plan.limits.idle, meter, capacity)
        self._default_wait = 60.0 * self._plan.minutes  # assumed duration of a trial, in seconds
        self._sockets: Counter[str] = Counter()  # number of open WebSockets, by participant and by address

    def queued(self, visit: str) -> Queued | None:
        """Return a participant's position in the queue, or None if the trial may start."""
        wait = self._limit.expected_wait(self._limit.waiting + 1, self._default_wait)
        refresh = min(max(REFRESH[0], wait / 10.0), REFRESH[1])
        position = self._limit.ask(visit, PATIENCE * refresh)
        if position is None:
            return None
        return Queued(position, self._limit.expected_wait(position, self._default_wait), refresh)

    def page(self, request: Request, now: PhaseState, folder: VisitFolder) -> Response:
        """Show the page of the participant's current or next trial."""
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

    async def play(self, socket: WebSocket, person: PersonRow) -> None:
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
            self._sockets += Counter()  # removes counts that have dropped to zero
            beating.cancel()
            with suppress(asyncio.CancelledError):
                await beating

    def _has_room(self, participant: str, address: str) -> bool:
        # All participants may share one IP address. While a page reloads, it briefly has two WebSockets.
        playing = max(self._limit.count, len(self._limit.held))
        from_address = max(SOCKETS_OF_AN_ADDRESS, SOCKETS_OF_A_PERSON * playing)
        return self._sockets[participant] < SOCKETS_OF_A_PERSON and self._sockets[address] < from_address

    async def _beat(self, person: PersonRow) -> None:
        while True:
            try:
                await self._store.beat(person.id)
            except StoreError as error:  # the next heartbeat tries again
                LOG.warning("%s", error)
            await asyncio.sleep(BEAT_PERIOD)
