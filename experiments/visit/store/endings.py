"""Ends of participations, and their effect on places."""

from datetime import datetime

from sqlalchemy import delete as delete_rows
from sqlalchemy import select, update
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.visit.store.assignments import place_of, set_place, take_back
from experiments.visit.store.part import Part, lock_study
from experiments.visit.store.tables import answer, identity, person
from experiments.visit.store.values import ACTIVE, Status, utc_now


class Endings(Part):
    """Changes of the final status."""

    async def finish(self, person_id: int, status: Status = "finished", now: datetime | None = None) -> bool:
        """End an active participation. Return True if it was active.

        A finished participant keeps the place. Otherwise it is released.
        """
        now = now or utc_now()

        async def work(connection: AsyncConnection) -> bool:
            await lock_study(connection, self._study_id)
            active = person.c.status.in_(ACTIVE)
            ended = await connection.execute(
                update(person).where(person.c.id == person_id, active).values(seen=now)
            )
            if not ended.rowcount:
                return False
            await end(connection, self._study_id, person_id, status)
            return True

        return await self._database.write(work)

    async def time_out(self, before: datetime) -> int:
        """Time out participants inactive since `before`, and release their places. Return their number."""
        gone = (person.c.study_id == self._study_id, person.c.status.in_(ACTIVE), person.c.seen < before)

        async def work(connection: AsyncConnection) -> int:
            await lock_study(connection, self._study_id)
            found = (await connection.execute(select(person.c.id).where(*gone))).scalars().all()
            for person_id in found:
                await end(connection, self._study_id, person_id, "timed_out")
            return len(found)

        return await self._database.write(work)

    async def withdraw(self, person_id: int, delete: bool, now: datetime | None = None) -> bool:
        """Withdraw a participant, even after finishing. Return True if this call did.

        With `delete`, the answers are deleted at once and the place is released. The number and platform ids stay until
        all payments are made. :meth:`Store.erase` then deletes the rest.
        """
        now = now or utc_now()

        async def work(connection: AsyncConnection) -> bool:
            await lock_study(connection, self._study_id)
            mine = person.c.id == person_id
            may = person.c.status.in_((*ACTIVE, "finished"))
            if delete:
                may = person.c.delete_wanted.is_(False)
            values = {"seen": now, "delete_wanted": True} if delete else {"seen": now}
            if not (await connection.execute(update(person).where(mine, may).values(**values))).rowcount:
                return False
            await end(connection, self._study_id, person_id, "withdrawn", keep_finished=not delete)
            if delete:
                await connection.execute(delete_rows(answer).where(answer.c.person_id == person_id))
            return True

        return await self._database.write(work)


async def end(
    connection: AsyncConnection, study_id: int, person_id: int, status: Status, *, keep_finished: bool = True
) -> None:
    """Set the final status of a participant, and finish or release the place. The study must be locked."""
    await connection.execute(update(person).where(person.c.id == person_id).values(status=status))
    if status == "no_consent":  # ids are only needed for payment; the keyed hash still recognizes the person
        await connection.execute(delete_rows(identity).where(identity.c.person_id == person_id))
    place = await place_of(connection, person_id)
    if place is None:
        return
    if status != "finished":
        if place.state == "held" or not keep_finished:
            await set_place(connection, person_id, "released")
    elif place.state == "held":
        await set_place(connection, person_id, "finished")
    else:  # if another participant has the place by now, the cell gets one more than wanted
        await take_back(connection, study_id, place, "finished")
