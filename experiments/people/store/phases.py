"""How far a person is: phases, answers and trials."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, insert, select, update
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.people.store.endings import end
from experiments.people.store.part import Part, lock_study
from experiments.people.store.tables import answer, person, trial
from experiments.people.store.tables import phase as phases
from experiments.people.store.values import ACTIVE, Answer, PhaseRow, Status, TrialRow, utc_now


class Phases(Part):
    """Rows of `phase`, `answer` and `trial`."""

    async def show_phase(self, person_id: int, name: str, now: datetime | None = None) -> PhaseRow:
        """Note when a phase was shown first; the phase, as it was shown first."""
        now = now or utc_now()

        async def work(connection: AsyncConnection) -> PhaseRow:
            row = await _phase(connection, person_id, name)
            if row is None:
                await connection.execute(insert(phases).values(person_id=person_id, name=name, shown=now))
                return PhaseRow(person_id, name, now, None, None, None, None)
            return row

        return await self._database.write(work)

    async def finish_phase(
        self,
        person_id: int,
        name: str,
        next_name: str,
        answers: Mapping[str, Any] | None = None,
        reason: str | None = None,
        *,
        duration_s: float | None = None,
        attempts: int | None = None,
        status: Status | None = None,
        now: datetime | None = None,
    ) -> bool:
        """Move a person to the next phase and make the answers of this one final, in one transaction.

        Returns whether this call did. It does nothing if another phase is under way (a form that was sent twice, the
        back button, a second tab) or if the participation is over.

        Args:
            person_id: The person.
            name: The phase that ends.
            next_name: The phase that follows.
            answers: Answers by item; they replace those that were saved before.
            reason: Why the phase ended, where it can end in several ways.
            duration_s: How long it took, s; by default since it was shown first.
            attempts: How many attempts it took.
            status: Ends the participation as well, such as `finished` after the last phase.
            now: The time, with its zone.
        """
        now = now or utc_now()

        async def work(connection: AsyncConnection) -> bool:
            if status is not None:
                await lock_study(connection, self._study_id)
            moved = await connection.execute(
                update(person)
                .where(person.c.id == person_id, person.c.phase == name, person.c.status.in_(ACTIVE))
                .values(phase=next_name, seen=now)
            )
            if not moved.rowcount:
                return False
            await _save(connection, person_id, name, answers or {}, now, final=True)
            how = {"duration_s": duration_s, "attempts": attempts, "reason": reason}
            await _end_phase(connection, person_id, name, now, how)
            if status is not None:
                await end(connection, self._study_id, person_id, status)
            return True

        return await self._database.write(work)

    async def save_answers(
        self, person_id: int, phase: str, values: Mapping[str, Any], now: datetime | None = None
    ) -> bool:
        """Keep answers as they are given; saving again replaces them. Whether they are kept.

        They are not if another phase is under way: answers of a phase that has ended never change.
        """
        now = now or utc_now()

        async def work(connection: AsyncConnection) -> bool:
            current = await connection.execute(
                update(person)
                .where(person.c.id == person_id, person.c.phase == phase, person.c.status.in_(ACTIVE))
                .values(seen=now)
            )
            if not current.rowcount:
                return False
            await _save(connection, person_id, phase, values, now)
            return True

        return await self._database.write(work)

    async def finish_trial(
        self, person_id: int, phase: str, folder: str, ended: str, now: datetime | None = None
    ) -> None:
        """Note a trial that is over, its run directory relative to the study's folder, and how it ended.

        Doing it again replaces what was noted.
        """
        values = {"folder": folder, "ended": ended, "finished": now or utc_now()}

        async def work(connection: AsyncConnection) -> None:
            same = (trial.c.person_id == person_id, trial.c.phase == phase)
            if not (await connection.execute(update(trial).where(*same).values(**values))).rowcount:
                await connection.execute(insert(trial).values(person_id=person_id, phase=phase, **values))

        await self._database.write(work)

    async def phases(self, person_id: int | None = None) -> tuple[PhaseRow, ...]:
        """Phases of a person, or of everybody, in the order in which they were shown."""
        return tuple(PhaseRow(*row) for row in await self._rows(phases, person_id))

    async def answers(self, person_id: int | None = None) -> tuple[Answer, ...]:
        """Answers of a person, or of everybody, in the order in which they were given first."""
        return tuple(Answer(*row) for row in await self._rows(answer, person_id))

    async def answers_to(self, phase: str, item: str) -> tuple[Answer, ...]:
        """Final answers of everybody to one item."""
        asked = (answer.c.phase == phase, answer.c.item == item, answer.c.final.is_(True))
        return tuple(Answer(*row) for row in await self._rows(answer, None, *asked))

    async def trials(self, person_id: int | None = None) -> tuple[TrialRow, ...]:
        """Trials of a person, or of everybody."""
        return tuple(TrialRow(*row) for row in await self._rows(trial, person_id))

    async def _rows(self, table: Any, person_id: int | None, *which: ColumnElement[bool]) -> Any:
        columns = [column for column in table.c if column.name != "id"]
        query = (
            select(*columns)
            .join(person, person.c.id == table.c.person_id)
            .where(person.c.study_id == self._study_id, *which)
            .order_by(table.c.person_id, table.c.id)
        )
        if person_id is not None:
            query = query.where(table.c.person_id == person_id)
        async with self._database.reading() as connection:
            return (await connection.execute(query)).all()


async def _phase(connection: AsyncConnection, person_id: int, name: str) -> PhaseRow | None:
    columns = [column for column in phases.c if column.name != "id"]
    query = select(*columns).where(phases.c.person_id == person_id, phases.c.name == name)
    row = (await connection.execute(query)).first()
    return None if row is None else PhaseRow(*row)


async def _end_phase(
    connection: AsyncConnection, person_id: int, name: str, now: datetime, how: dict[str, Any]
) -> None:
    row = await _phase(connection, person_id, name)
    if how["duration_s"] is None:
        how["duration_s"] = max(0.0, (now - row.shown).total_seconds()) if row else 0.0
    if row is None:  # it was never shown, such as a phase that is skipped
        await connection.execute(
            insert(phases).values(person_id=person_id, name=name, shown=now, ended=now, **how)
        )
        return
    mine = (phases.c.person_id == person_id, phases.c.name == name)
    await connection.execute(update(phases).where(*mine).values(ended=now, **how))


async def _save(
    connection: AsyncConnection,
    person_id: int,
    phase: str,
    values: Mapping[str, Any],
    now: datetime,
    *,
    final: bool = False,
) -> None:
    """Insert or replace; with `final`, make all answers of the phase final. The person's row must be locked."""
    mine = (answer.c.person_id == person_id, answer.c.phase == phase)
    known = set((await connection.execute(select(answer.c.item).where(*mine))).scalars())
    for item in known & set(values):
        await connection.execute(
            update(answer)
            .where(*mine, answer.c.item == item, answer.c.final.is_(False))
            .values(value=values[item], given=now)
        )
    if final and known:
        await connection.execute(update(answer).where(*mine).values(final=True))
    new = [
        {"person_id": person_id, "phase": phase, "item": item, "value": value, "given": now, "final": final}
        for item, value in values.items()
        if item not in known
    ]
    if new:
        await connection.execute(insert(answer), new)
