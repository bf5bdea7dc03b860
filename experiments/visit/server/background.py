"""Background tasks of the visit server: timeouts of absent participants, and heartbeats of a host."""

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
HEARTBEAT_S = 10.0  # period of heartbeats to the database
SWEEP_S = 60.0  # period of searching for absent participants
CLOCK_SET_S = 30.0  # larger deviations mean that the clock was set or the machine slept


class HostOfVisits:
    """This host, if several hosts share a database. `name` is unique among them."""

    def __init__(self, name: str, store: Store, folders: VisitFolders) -> None:
        self._name, self._store, self._folders = name, store, folders
        self._until = 0.0  # when the lease expires, by the monotonic clock
        self._new = False

    async def keep(self, sessions: Sessions) -> None:
        """Send heartbeats until cancelled. End all sessions if the database has received none for too long."""
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
        """Return True if this host has the visit, claiming it if possible. Any host serves the phases before trials."""
        if person.host is None and person.phase not in PLAYED:
            return True
        if time.monotonic() > self._until:
            return False
        if person.host == self._name:
            return True
        journal = await asyncio.to_thread(self._folders.find, person.token_hash) is not None
        return await self._store.claim(person.id, self._name, new=self._new, journal=journal)

    async def leave(self) -> None:
        """Record that this host runs no more sessions."""
        await self._store.greet(self._name, leaves=True)


async def end_absent(procedure: Procedure) -> None:
    """Time out absent participants until cancelled. Downtime of this server does not count as absence."""
    away = procedure.plan.limits.timed_out_after
    since = time.monotonic()
    ahead = time.time() - since
    while True:
        await asyncio.sleep(SWEEP_S)
        now = time.monotonic()
        if abs(time.time() - now - ahead) > CLOCK_SET_S:  # restart, since activity is timed by that clock
            since, ahead = now, time.time() - now
        if now - since < away:
            continue
        try:
            before = utc_now() - datetime.timedelta(seconds=away)
            await procedure.recover(before)  # their trials may have ended without being recorded
            if gone := await procedure.store.time_out(before):
                LOG.info("%d participants did not return", gone)
        except StoreError as error:  # try again at the next sweep
            LOG.warning("%s", error)
