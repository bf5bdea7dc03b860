"""Store participants, the times of their last activity, and their platform ids."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sqlalchemy import ColumnElement, bindparam, delete, insert, select, update
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store.part import StorePart, columns_of, new_id, note, transaction
from experiments.visit.store.tables import answer, person
from experiments.visit.store.tables import identity as ids
from experiments.visit.store.values import PersonRow, utc_now

_FIELDS = columns_of(PersonRow, person)
# This query is built at import, because building a query takes as long as running it.
_FIND = select(*_FIELDS).where(
    person.c.study_id == bindparam("study"), person.c.token_hash == bindparam("token")
)


class People(StorePart):
    """Store methods for participants and their platform ids."""

    @transaction
    async def arrive(
        self,
        connection: Connection,
        platform: str,
        key: str | None,
        identity: Mapping[str, str],
        token_hash: str,
        phase: str,
    ) -> PersonRow:
        """Return the participant who has opened a link. Add a new participant if necessary.

        Returning participants keep the token hash of their first arrival, so the token must be derived from the key.

        Args:
            platform: Recruitment platform, such as `prolific`, of at most 20 characters.
            key: Hexadecimal HMAC-SHA-256 of the platform id with the study's secret, or None for links without an id.
            identity: Ids from the platform, which are stored separately and never exported. Those of the last arrival
                replace earlier ones while the participant is active.
            token_hash: Hexadecimal SHA-256 of the link's token.
        """
        now = utc_now()
        same = person.c.token_hash == token_hash if key is None else person.c.platform_key == key
        known = (await connection.execute(self._select(same))).first()
        if known is not None:
            found = replace(PersonRow(*known), returning=True)
            if found.active:  # ids change if a participant returns the task and accepts it again
                mine = ids.c.person_id == found.id
                await connection.execute(update(ids).where(mine).values(ids=dict(identity)))
            return found
        values = {
            "study_id": self._study_id,
            "token_hash": token_hash,
            "platform": platform,
            "platform_key": key,
            "status": "arrived",
            "phase": phase,
            "created": now,
            "seen": now,
            "delete_wanted": False,
        }
        number = new_id(await connection.execute(insert(person), values))
        await connection.execute(insert(ids), {"person_id": number, "ids": dict(identity)})
        return PersonRow(number, token_hash, platform, "arrived", phase, now, now, False)

    async def find(self, token_hash: str) -> PersonRow | None:
        """Return the participant whose link has this token hash, or None."""
        found = await self._database.rows(_FIND, {"study": self._study_id, "token": token_hash})
        return PersonRow(*found[0]) if found else None

    async def person(self, person_id: int) -> PersonRow:
        """Return the participant with this number. Raises StoreError if there is no such participant."""
        found = await self._database.rows(self._select(person.c.id == person_id))
        if not found:
            raise StoreError(
                f"There is no person {person_id} in this study; `mjsim study` shows the numbers."
            )
        return PersonRow(*found[0])

    async def people(self) -> tuple[PersonRow, ...]:
        """Return all participants, in order of arrival."""
        found = await self._database.rows(self._select().order_by(person.c.id))
        return tuple(PersonRow(*row) for row in found)

    async def identity(self, person_id: int) -> dict[str, str]:
        """Return a participant's platform ids, or an empty dictionary if they have been deleted."""
        query = select(ids.c.ids).where(ids.c.person_id == person_id)
        async with self._database.reading() as connection:
            return dict((await connection.execute(query)).scalar() or {})

    @transaction
    async def set_known(self, connection: Connection, known: Mapping[int, bool], who: str) -> None:
        """Store whether the platform knows each participant, as the answer to item `known` of phase `recruitment`."""
        now = utc_now()
        given = {"phase": "recruitment", "item": "known", "given": now, "final": True}
        mine = (
            answer.c.person_id.in_(known),
            *(answer.c[name] == given[name] for name in ("phase", "item")),
        )
        await connection.execute(delete(answer).where(*mine))
        for number, value in known.items():
            await connection.execute(insert(answer), {"person_id": number, "value": value, **given})
        unknown = [number for number, value in known.items() if not value]
        await note(connection, self._study_id, who, "participants reconciled", {"unknown": unknown}, now)

    @transaction
    async def beat(self, connection: Connection, person_id: int) -> None:
        """Record that a participant is active, so that the participant's place is not given away."""
        now = utc_now()
        late = person.c.seen < now
        await connection.execute(update(person).where(person.c.id == person_id, late).values(seen=now))

    def _select(self, *which: ColumnElement[bool]) -> Any:
        return select(*_FIELDS).where(person.c.study_id == self._study_id, *which)
