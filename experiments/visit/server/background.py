"""Background tasks that time out inactive participants and send heartbeats."""

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
HEARTBEAT_S = 10.0  # interval between heartbeats to the database
SWEEP_S = 60.0  # interval between searches for inactive participants
CLOCK_SET_S = 30.0  # clock deviation that indicates a clock change or a suspended machine


class HostOfVisits:
    """A host that shares a database with other hosts. Each host needs a unique `name`."""

    def __init__(self, name: str, store: Store, folders: VisitFolders) -> None:
        self._name, self._store, self._folders = name, store, folders
        self._until = 0.0  # monotonic time at which the lease expires
        self._new = False

    async def keep(self, sessions: Sessions) -> None:
        """Send heartbeats until cancelled. End all sessions if the database is unreachable for too long."""
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
        """Return True if this host may serve the participant. Claim the visit for this host if necessary."""
        if person.host is None and person.phase not in PLAYED:
            return True
        if time.monotonic() > self._until:
            return False
        if person.host == self._name:
            return True
        journal = await asyncio.to_thread(self._folders.find, person.token_hash) is not None
        return await self._store.claim(person.id, self._name, new=self._new, journal=journal)

    async def leave(self) -> None:
        """Record that this host has stopped running sessions."""
        await self._store.greet(self._name, leaves=True)


async def end_absent(procedure: Procedure) -> None:
    """Time out inactive participants until cancelled. Time during which the server is down does not count."""
    away = procedure.plan.limits.timed_out_after
    since = time.monotonic()
    ahead = time.time() - since
    while True:
        await asyncio.sleep(SWEEP_S)
        now = time.monotonic()
        if abs(time.time() - now - ahead) > CLOCK_SET_S:  # start over if the clock was changed
            since, ahead = now, time.time() - now
        if now - since < away:
            continue
        try:
            before = utc_now() - datetime.timedelta(seconds=away)
            await procedure.recover(before)  # record completed trials before the timeout
            if gone := await procedure.store.time_out(before):
                LOG.info("%d participants did not return", gone)
        except StoreError as error:  # the next sweep tries again
            LOG.warning("%s", error)
