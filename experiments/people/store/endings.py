"""How a participation ends, and what becomes of the place."""

from datetime import datetime

from sqlalchemy import delete as delete_rows
from sqlalchemy import select, update
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.people.store.part import Part, lock_study
from experiments.people.store.tables import answer, assignment, person
from experiments.people.store.values import ACTIVE, Status, utc_now


class Endings(Part):
    """The last status of a person."""

    async def finish(self, person_id: int, status: Status = "finished", now: datetime | None = None) -> bool:
        """End a participation that is under way; whether this call did.

        The place of somebody who finished is theirs for good; that of others goes to the next person.
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
            await end(connection, person_id, status)
            return True

        return await self._database.write(work)

    async def withdraw(self, person_id: int, delete: bool, now: datetime | None = None) -> bool:
        """Note that a person wants to take part no longer, even after finishing; whether this call did.

        With `delete`, the answers are deleted at once and the place goes to the next person. The person's number and
        platform ids stay until what is owed is paid; :meth:`Store.erase` then deletes the rest.
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
            await end(connection, person_id, "withdrawn", keep_finished=not delete)
            if delete:
                await connection.execute(delete_rows(answer).where(answer.c.person_id == person_id))
            return True

        return await self._database.write(work)


async def end(
    connection: AsyncConnection, person_id: int, status: Status, *, keep_finished: bool = True
) -> None:
    """Give a person the last status, and finish or release the place; the study must be locked."""
    await connection.execute(update(person).where(person.c.id == person_id).values(status=status))
    mine = assignment.c.person_id == person_id
    place = (await connection.execute(select(assignment).where(mine))).first()
    if place is None:
        return
    if status == "finished":
        if place.active or not await _taken(connection, place.study_id, place.cell, place.place):
            await connection.execute(update(assignment).where(mine).values(state="finished", active=1))
    elif place.state == "held" or not keep_finished:
        await connection.execute(update(assignment).where(mine).values(state="released", active=None))


async def _taken(connection: AsyncConnection, study_id: int, cell: int, place: int) -> bool:
    """Whether somebody has a place that was released; then whoever had it before is one more than wanted."""
    query = select(assignment.c.id).where(
        assignment.c.study_id == study_id,
        assignment.c.cell == cell,
        assignment.c.place == place,
        assignment.c.active == 1,
    )
    return (await connection.execute(query)).first() is not None
