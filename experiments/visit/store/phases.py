"""Store the phases, answers, trials and final status of each participant."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Select, Table, bindparam, insert, select, update
from sqlalchemy import delete as delete_rows
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.visit.store.assignments import place_of, set_place, take_back
from experiments.visit.store.part import StorePart, lock_study, transaction
from experiments.visit.store.tables import answer, identity, person, trial
from experiments.visit.store.tables import phase as phases
from experiments.visit.store.values import ACTIVE, Answer, PhaseRow, Status, TrialRow, utc_now

# These queries are built at import, because building a query takes as long as running it.
_PHASE = select(*[column for column in phases.c if column.name != "id"]).where(
    phases.c.person_id == bindparam("person"), phases.c.name == bindparam("phase")
)
_IN_PHASE = update(person).where(
    person.c.id == bindparam("person"), person.c.phase == bindparam("from"), person.c.status.in_(ACTIVE)
)
_END = update(phases).where(phases.c.person_id == bindparam("person"), phases.c.name == bindparam("which"))
_ITEMS = select(answer.c.item).where(
    answer.c.person_id == bindparam("person"), answer.c.phase == bindparam("which")
)


def _rows_of(table: Table) -> Select[Any]:
    return (
        select(*[column for column in table.c if column.name != "id"])
        .join(person, person.c.id == table.c.person_id)
        .where(person.c.study_id == bindparam("study"))
        .order_by(table.c.person_id, table.c.id)
    )


_ROWS = {table: _rows_of(table) for table in (phases, answer, trial)}
_ROWS_OF_ONE = {table: rows.where(table.c.person_id == bindparam("person")) for table, rows in _ROWS.items()}


class Phases(StorePart):
    """The part of the store for phases, answers and trials."""

    @transaction
    async def show_phase(self, connection: Connection, person_id: int, name: str) -> PhaseRow:
        """Record when a phase was first shown to a participant, and return its row."""
        row = await _phase(connection, person_id, name)
        if row is None:
            row = PhaseRow(person_id, name, utc_now(), None, None, None)
            new = {"person_id": person_id, "name": name, "shown": row.shown}
            await connection.execute(insert(phases), new)
        return row

    @transaction
    async def finish_phase(
        self,
        connection: Connection,
        person_id: int,
        name: str,
        next_name: str,
        answers: Mapping[str, Any] | None = None,
        reason: str | None = None,
        *,
        status: Status | None = None,
    ) -> bool:
        """Advance a participant to the next phase and make the answers final, in one transaction.

        Return False if the participant has already left the phase, for example if a form is submitted twice.

        Args:
            answers: Answers by item, which replace answers saved earlier.
            reason: Reason why the phase ended, if several are possible.
            status: Final status, such as `finished`, if this phase ends the visit.
        """
        now = utc_now()
        if status is not None:
            await lock_study(connection, self._study_id)
        moved = await connection.execute(
            _IN_PHASE, {"person": person_id, "from": name, "phase": next_name, "seen": now}
        )
        if not moved.rowcount:
            return False
        await _save(connection, person_id, name, answers or {}, now, final=True)
        await _end_phase(connection, person_id, name, now, reason)
        if status is not None:
            await end(connection, self._study_id, person_id, status)
        return True

    @transaction
    async def save_answers(
        self, connection: Connection, person_id: int, phase: str, values: Mapping[str, Any]
    ) -> bool:
        """Save or replace answers of the current phase. Return False if the participant is in another phase.

        The answers of a phase cannot be changed after its end.
        """
        now = utc_now()
        current = await connection.execute(_IN_PHASE, {"person": person_id, "from": phase, "seen": now})
        if not current.rowcount:
            return False
        await _save(connection, person_id, phase, values, now)
        return True

    @transaction
    async def finish_trial(
        self, connection: Connection, person_id: int, phase: str, folder: str, ended: str
    ) -> None:
        """Record that a trial has ended. `folder` is its run directory, relative to the study's folder."""
        values = {"folder": folder, "ended": ended, "finished": utc_now()}
        same = (trial.c.person_id == person_id, trial.c.phase == phase)
        if not (await connection.execute(update(trial).where(*same).values(**values))).rowcount:
            await connection.execute(insert(trial).values(person_id=person_id, phase=phase, **values))

    async def phases(self, person_id: int | None = None) -> tuple[PhaseRow, ...]:
        """Return the phases of one or all participants, in the order in which they were shown."""
        return tuple(PhaseRow(*row) for row in await self._rows(phases, person_id))

    async def answers(self, person_id: int | None = None) -> tuple[Answer, ...]:
        """Return the answers of one or all participants, in the order in which they were first given."""
        return tuple(Answer(*row) for row in await self._rows(answer, person_id))

    async def answers_to(self, phase: str, item: str) -> tuple[Answer, ...]:
        """Return the final answers of all participants to one item."""
        asked = (answer.c.phase == phase, answer.c.item == item, answer.c.final.is_(True))
        return tuple(Answer(*row) for row in await self._rows(answer, None, *asked))

    async def trials(self, person_id: int | None = None) -> tuple[TrialRow, ...]:
        """Return the trials of one or all participants."""
        return tuple(TrialRow(*row) for row in await self._rows(trial, person_id))

    async def _rows(self, table: Table, person_id: int | None, *which: ColumnElement[bool]) -> Any:
        query = _ROWS[table] if person_id is None else _ROWS_OF_ONE[table]
        values = {"study": self._study_id} | ({} if person_id is None else {"person": person_id})
        return await self._database.rows(query.where(*which) if which else query, values)


async def _phase(connection: Connection, person_id: int, name: str) -> PhaseRow | None:
    row = (await connection.execute(_PHASE, {"person": person_id, "phase": name})).first()
    return None if row is None else PhaseRow(*row)


async def _end_phase(
    connection: Connection, person_id: int, name: str, now: datetime, reason: str | None
) -> None:
    row = await _phase(connection, person_id, name)
    passed = max(0.0, (now - row.shown).total_seconds()) if row else 0.0
    ending = {"ended": now, "duration_s": passed, "reason": reason}
    if row is None:  # the phase has never been shown
        await connection.execute(
            insert(phases), {"person_id": person_id, "name": name, "shown": now, **ending}
        )
    else:
        await connection.execute(_END, {"person": person_id, "which": name, **ending})


async def _save(
    connection: Connection,
    person_id: int,
    phase: str,
    values: Mapping[str, Any],
    now: datetime,
    *,
    final: bool = False,
) -> None:
    mine = (answer.c.person_id == person_id, answer.c.phase == phase)
    known = set((await connection.execute(_ITEMS, {"person": person_id, "which": phase})).scalars())
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


class Endings(StorePart):
    """Store methods that end visits."""

    @transaction
    async def time_out(self, connection: Connection, before: datetime) -> int:
        """Time out all participants who have been inactive since `before`, and return their number."""
        gone = (person.c.study_id == self._study_id, person.c.status.in_(ACTIVE), person.c.seen < before)
        await lock_study(connection, self._study_id)
        found = (await connection.execute(select(person.c.id).where(*gone))).scalars().all()
        for person_id in found:
            await end(connection, self._study_id, person_id, "timed_out")
        return len(found)

    @transaction
    async def withdraw(self, connection: Connection, person_id: int, delete: bool) -> bool:
        """Withdraw a participant, who may already have finished the study. Return False if nothing changed.

        With `delete`, the answers are deleted immediately and the place is released. The number and platform ids are
        kept until all payments are made and :meth:`Store.erase` is called.
        """
        now = utc_now()
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


async def end(
    connection: Connection, study_id: int, person_id: int, status: Status, *, keep_finished: bool = True
) -> None:
    """Set a participant's final status, and keep or release their place. The study must be locked."""
    await connection.execute(update(person).where(person.c.id == person_id).values(status=status))
    if status == "no_consent":  # the ids are only needed for payments
        await connection.execute(delete_rows(identity).where(identity.c.person_id == person_id))
    place = await place_of(connection, person_id)
    if place is None:
        return
    if status != "finished":
        if place.state == "held" or not keep_finished:
            await set_place(connection, person_id, "released")
    elif place.state == "held":
        await set_place(connection, person_id, "finished")
    else:  # the place was released, so another participant may have it now
        await take_back(connection, study_id, place, "finished")
