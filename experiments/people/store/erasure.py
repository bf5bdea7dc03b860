"""Deletes all of a person but the fact that somebody was paid."""

from datetime import datetime
from typing import Any

from sqlalchemy import delete, select
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.errors import StoreError
from experiments.people.store import tables
from experiments.people.store.ledger import by_key, events_of, paid
from experiments.people.store.part import Part, lock_study, note
from experiments.people.store.values import utc_now

# Those first that refer to others.
OWN = (tables.answer, tables.trial, tables.phase, tables.assignment, tables.identity, tables.payment)


class Erasure(Part):
    """Deletes rows of a person."""

    async def erase(self, person_id: int, who: str, now: datetime | None = None) -> None:
        """Delete every row of a person. The audit log keeps the number, and kinds and amounts of what was paid.

        The person's folder, backups and exports are the caller's. SQLite overwrites what is deleted; MariaDB and
        PostgreSQL do so when they clean up.

        Raises:
            StoreError: There is no such person, or the person is owed something.
        """
        now = now or utc_now()

        async def work(connection: AsyncConnection) -> None:
            await lock_study(connection, self._study_id)
            mine = (tables.person.c.id == person_id, tables.person.c.study_id == self._study_id)
            if (await connection.execute(select(tables.person.c.id).where(*mine))).first() is None:
                raise StoreError(f"There is no person {person_id} in this study; nothing was deleted.")
            payments = by_key(await events_of(connection, tables.payment.c.person_id == person_id))
            if owed := [key for key, events in payments.items() if not paid(events)]:
                raise StoreError(f"Person {person_id} is owed {', '.join(owed)}: pay first, then erase.")
            settled: list[dict[str, Any]] = [
                {"kind": events[0].kind, "cents": events[0].cents, "currency": events[0].currency}
                for events in payments.values()
            ]
            for table in OWN:
                await connection.execute(delete(table).where(table.c.person_id == person_id))
            await connection.execute(delete(tables.person).where(*mine))
            details = {"person": person_id, "paid": settled}
            await note(connection, self._study_id, who, "person erased", details, now)

        await self._database.write(work)
        await self._database.empty_log()
