"""Delete all data of participants, or only the data that identify them."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import delete, select, update
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store import tables
from experiments.visit.store.ledger import by_key, events_of, paid
from experiments.visit.store.part import StorePart, lock_study, note
from experiments.visit.store.values import utc_now

# Tables with participants' data, in an order that allows deletion without violating foreign keys.
OWN = (tables.answer, tables.trial, tables.phase, tables.assignment, tables.identity, tables.payment)


class Erasure(StorePart):
    """Store methods that delete participants' data."""

    async def erase(self, person_id: int, who: str, *, unpaid: bool = False) -> None:
        """Delete all rows of a participant. The audit log keeps the participant's number and payments.

        The caller must delete the data in visit folders, backups and exports. SQLite overwrites deleted rows
        immediately. MariaDB and PostgreSQL overwrite them at the next clean-up. Set `unpaid` to erase a
        participant to whom payments are owed, for example in a backup that is older than the payment.

        Raises:
            StoreError: There is no such participant, or a payment is still owed.
        """

        async def work(connection: Connection) -> None:
            await lock_study(connection, self._study_id)
            mine = (tables.person.c.id == person_id, tables.person.c.study_id == self._study_id)
            if (await connection.execute(select(tables.person.c.id).where(*mine))).first() is None:
                raise StoreError(f"There is no person {person_id} in this study; nothing was deleted.")
            payments = by_key(await events_of(connection, tables.payment.c.person_id == person_id))
            owed = [key for key, events in payments.items() if not paid(events)]
            if owed and not unpaid:
                raise StoreError(f"Person {person_id} is owed {', '.join(owed)}: pay first, then erase.")
            settled: list[dict[str, Any]] = [
                {"kind": events[0].kind, "cents": events[0].cents, "currency": events[0].currency}
                for events in payments.values()
            ]
            for table in OWN:
                await connection.execute(delete(table).where(table.c.person_id == person_id))
            await connection.execute(delete(tables.person).where(*mine))
            details = {"person": person_id, "paid": settled}
            await note(connection, self._study_id, who, "person erased", details, utc_now())

        await self._database.write(work)
        await self._database.scrub()

    async def known(self, before: datetime) -> tuple[int, ...]:
        """Return the numbers of participants with identifying data who have been inactive since `before`."""
        mine = (tables.person.c.study_id == self._study_id, tables.person.c.seen < before)
        recognised = tables.identity.c.id.is_not(None) | tables.person.c.platform_key.is_not(None)
        query = select(tables.person.c.id).outerjoin(tables.identity).where(*mine, recognised)
        query = query.order_by(tables.person.c.id)
        async with self._database.reading() as connection:
            return tuple((await connection.execute(query)).scalars())

    async def forget(self, person_ids: Sequence[int], names: Sequence[str], who: str) -> None:
        """Delete the data that identify participants: platform ids, keys, links and payment receipts.

        Measures, answers and amounts are kept. The links stop working, and the participants could take part again.

        Args:
            names: New names of the participants' folders, in the same order. They replace the link hashes.
        """
        now = utc_now()

        async def work(connection: Connection) -> None:
            for number, name in zip(person_ids, names, strict=True):
                mine = (tables.person.c.id == number, tables.person.c.study_id == self._study_id)
                before = (await connection.execute(select(tables.person.c.token_hash).where(*mine))).scalar()
                if before is None:
                    continue
                runs = select(tables.trial.c.id, tables.trial.c.folder).where(
                    tables.trial.c.person_id == number
                )
                for run, folder in (await connection.execute(runs)).all():
                    moved = {"folder": folder.replace(before, name)}
                    await connection.execute(
                        update(tables.trial).where(tables.trial.c.id == run).values(**moved)
                    )
                gone = {"platform_key": None, "token_hash": name}
                await connection.execute(update(tables.person).where(*mine).values(**gone))
                await connection.execute(delete(tables.identity).where(tables.identity.c.person_id == number))
                told = (tables.payment.c.person_id == number, tables.payment.c.event != "decided")
                await connection.execute(update(tables.payment).where(*told).values(reference="", note=""))
            details = {"people": list(person_ids)}
            await note(connection, self._study_id, who, "people forgotten", details, now)

        await self._database.write(work)
        await self._database.scrub()
