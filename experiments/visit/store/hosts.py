"""Coordinate several hosts that share a database. Hosts send heartbeats, and each visit belongs to one host.

Times are measured with the database's clock, because the clocks of the hosts may be wrong.
"""

from datetime import timedelta

from sqlalchemy import delete, exists, insert, or_, select, update
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store.part import StorePart, database_now, note, transaction
from experiments.visit.store.tables import assignment, host, person
from experiments.visit.store.values import Host

LEASE = timedelta(seconds=60)  # time without a successful heartbeat after which a host ends its sessions
SILENT = timedelta(seconds=90)  # time without a heartbeat after which a host's visits may be handed over
HANDED_OVER = "-"  # host name of a visit that any host with the journal may take over


class Hosts(StorePart):
    """Store methods for hosts and the visits assigned to them."""

    @transaction
    async def greet(self, connection: Connection, name: str, *, leaves: bool = False) -> bool:
        """Record a host's heartbeat or departure. Return True if the host accepts new visits."""
        mine = (host.c.study_id == self._study_id, host.c.name == name)
        seen = await database_now(connection) - SILENT * leaves
        if not (await connection.execute(update(host).where(*mine).values(seen=seen))).rowcount:
            values = {"study_id": self._study_id, "name": name, "seen": seen, "draining": False}
            await connection.execute(insert(host).values(**values))
        return not (await connection.execute(select(host.c.draining).where(*mine))).scalar_one()

    async def hosts(self) -> tuple[Host, ...]:
        query = select(host.c.name, host.c.seen, host.c.draining).where(host.c.study_id == self._study_id)
        return tuple(Host(*row) for row in await self._database.rows(query.order_by(host.c.name)))

    @transaction
    async def claim(
        self, connection: Connection, person_id: int, name: str, *, new: bool, journal: bool
    ) -> bool:
        """Claim a participant's visit for a host if possible. Return True if the visit belongs to this host.

        Args:
            new: True if the host accepts new visits.
            journal: True if the host has the journal of the visit.
        """
        may = [person.c.host == name]
        if journal:
            may += [person.c.host.is_(None), person.c.host == HANDED_OVER]
        elif new:  # a participant who has a place has journals on another host
            may += [person.c.host.is_(None) & ~exists().where(assignment.c.person_id == person.c.id)]
        claimed = update(person).where(person.c.id == person_id, or_(*may)).values(host=name)
        return bool((await connection.execute(claimed)).rowcount)

    @transaction
    async def drain(self, connection: Connection, name: str, draining: bool, who: str) -> None:
        """Stop or allow new visits on a host. Visits that have already started are not affected."""
        mine = (host.c.study_id == self._study_id, host.c.name == name)
        if not (await connection.execute(update(host).where(*mine).values(draining=draining))).rowcount:
            raise StoreError(f"There is no host {name!r}; `mjsim study hosts` lists them.")
        action = "host drained" if draining else "host opened"
        await note(connection, self._study_id, who, action, {"host": name}, await database_now(connection))

    @transaction
    async def hand_over(self, connection: Connection, name: str, who: str) -> int:
        """Allow other hosts to take over the visits of a failed host. Return the number of visits.

        The other host must have the journal of the visit. Raises StoreError if the host may still be running.
        """
        at = await database_now(connection)
        mine = (host.c.study_id == self._study_id, host.c.name == name)
        seen = (await connection.execute(select(host.c.seen).where(*mine).with_for_update())).scalar()
        if seen is None:
            raise StoreError(f"There is no host {name!r}; `mjsim study hosts` lists them.")
        if at - seen < SILENT:
            raise StoreError(
                f"Host {name!r} may be running: stop its server, or wait until nothing was heard of it for "
                f"{SILENT.total_seconds():.0f} s."
            )
        theirs = (person.c.study_id == self._study_id, person.c.host == name)
        moved = await connection.execute(update(person).where(*theirs).values(host=HANDED_OVER))
        await connection.execute(delete(host).where(*mine))
        details = {"host": name, "visits": moved.rowcount}
        await note(connection, self._study_id, who, "host handed over", details, at)
        return moved.rowcount
