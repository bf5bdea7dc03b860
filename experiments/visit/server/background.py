"""Background tasks that time out absent participants and send a host's heartbeats."""

import asyncio
import datetime
import logging
import time

from experiments.errors import StoreError
from experiments.visit.folders import VisitFolders
from experiments.visit.plan import PLAYED
from experiments.visit.procedure import Procedure
from experiments.visit.store import PersonRow, Store, utc_now
from experiments.visit.store.hosts import LEASE
from experiments.web.server.sessions import Sessions

LOG = logging.getLogger("mjsim.study")
HEARTBEAT_S = 10.0  # time between two heartbeats to the database
SWEEP_S = 60.0  # time between two searches for absent participants
CLOCK_SET_S = 30.0  # if two clocks deviate by more, the clock was set or the machine was suspended


class HostOfVisits:
    """This host, as one of several that share a database. `name` must be unique among them."""

    def __init__(self, name: str, store: Store, folders: VisitFolders) -> None:
        self._name, self._store, self._folders = name, store, folders
        self._until = 0.0  # time at which the lease expires, by the monotonic clock
        self._new = False

    async def keep(self, sessions: Sessions) -> None:
        """Send heartbeats until cancelled. End all sessions if no heartbeat has reached the database for too long."""
        while True:
            began = time.monotonic()
            try:
                self._new = await asyncio.wait_for(self._store.greet(self._name), HEARTBEAT_S)
                self._until = began + LEASE.total_seconds()
            except (StoreError, TimeoutError) as error:
                LOG.warning("host %s: the database does not hear it: %s", self._name, error)
            if time.monotonic() > self._until:
                await sessions.release()
            await asyncio.sleep(HEARTBEAT_S)

    async def has(self, person: PersonRow) -> bool:
        """Claim a visit if possible. Return True if this host may serve it, as any host may before the trials begin."""
        if person.host is None and person.phase not in PLAYED:
            return True
        if time.monotonic() > self._until:
            return False
        if person.host == self._name:
            return True
        journal = await asyncio.to_thread(self._folders.find, person.token_hash) is not None
        return await self._store.claim(person.id, self._name, new=self._new, journal=journal)

    async def leave(self) -> None:
        """Record that this host no longer runs sessions."""
        await self._store.greet(self._name, leaves=True)


async def end_absent(procedure: Procedure) -> None:
    """Time out absent participants until cancelled. Absence is not counted while the server is down."""
    away = procedure.plan.limits.timed_out_after
    since = time.monotonic()
    ahead = time.time() - since
    while True:
        await asyncio.sleep(SWEEP_S)
        now = time.monotonic()
        if abs(time.time() - now - ahead) > CLOCK_SET_S:  # wait again, since activity is timed by this clock
            since, ahead = now, time.time() - now
        if now - since < away:
            continue
        try:
            before = utc_now() - datetime.timedelta(seconds=away)
            await procedure.recover(before)  # record trials that have ended
            if gone := await procedure.store.time_out(before):
                LOG.info("%d participants did not return", gone)
        except StoreError as error:  # will be tried again at the next sweep
            LOG.warning("%s", error)
