"""Background of a server of visits: time-outs of absent participants, and one host among several."""

import asyncio
import datetime
import logging
import time

from experiments.errors import StoreError
from experiments.visit.folders import VisitFolders
from experiments.visit.plan import PLAYED
from experiments.visit.procedure import Procedure
from experiments.visit.store import Person, Store, utc_now
from experiments.visit.store.hosts import LEASE
from experiments.web.server.sessions import Sessions

LOG = logging.getLogger("mjsim.study")
PERIOD = 10.0  # s between two words to the database


class HostOfVisits:
    """This host among others.

    Args:
        name: Of the host, another one than those of the others.
        store: Knows all hosts.
        folders: Hold the journals of this host.
    """

    def __init__(self, name: str, store: Store, folders: VisitFolders) -> None:
        self._name, self._store, self._folders = name, store, folders
        self._until = 0.0  # of the monotonic clock
        self._new = False

    async def keep(self, sessions: Sessions) -> None:
        """Say for ever that this host is there; end its sessions where nobody has heard that for long."""
        while True:
            began = time.monotonic()
            try:
                self._new = await asyncio.wait_for(self._store.greet(self._name), PERIOD)
                self._until = began + LEASE.total_seconds()
            except (StoreError, TimeoutError) as error:
                LOG.warning("host %s: the database does not hear it: %s", self._name, error)
            if time.monotonic() > self._until:
                await sessions.release()
            await asyncio.sleep(PERIOD)

    async def has(self, person: Person) -> bool:
        """Whether a person's pages are here; those of the first phases are everywhere."""
        if person.host is None and person.phase not in PLAYED:
            return True
        if time.monotonic() > self._until:
            return False
        if person.host == self._name:
            return True
        journal = await asyncio.to_thread(self._folders.find, person.token_hash) is not None
        return await self._store.claim(person.id, self._name, new=self._new, journal=journal)

    async def leave(self) -> None:
        """Note that nothing runs here any more."""
        await self._store.greet(self._name, leaves=True)


LOG = logging.getLogger("mjsim.study")
SWEEP_PERIOD = 60.0  # s between two looks for people who never return
CLOCK_SET = 30.0  # s by which the clock is off once it was set, or the machine slept


async def end_absent(procedure: Procedure) -> None:
    """Time out participants who do not return. Time in which this server did not run does not count."""
    away = procedure.plan.limits.timed_out_after
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
            gone = await procedure.store.time_out(utc_now() - datetime.timedelta(seconds=away))
            if gone:
                LOG.info("%d participants did not return", gone)
        except StoreError as error:  # the next sweep may find them
            LOG.warning("%s", error)
