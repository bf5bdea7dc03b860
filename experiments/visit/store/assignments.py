"""Assign participants to the cells of the experimental design, in transactions that lock the study."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any

import numpy as np
from sqlalchemy import Select, bindparam, func, insert, or_, select, update
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store.part import StorePart, columns_of, lock_study, note, transaction
from experiments.visit.store.tables import assignment, person, study
from experiments.visit.store.values import (
    ACTIVE,
    Assignment,
    CellCount,
    CellQuota,
    Counts,
    PlaceState,
    Rule,
    utc_now,
)

SEEDS = 2**53  # seeds are below this value, because JavaScript represents such integers exactly
FIELDS = columns_of(Assignment, assignment)
_PLACE = select(*FIELDS).where(assignment.c.person_id == bindparam("person"))

# These queries are built at import, because building a query takes as long as running it.
_ACTIVE = update(person).where(
    person.c.id == bindparam("person"),
    person.c.study_id == bindparam("study"),
    person.c.status.in_(ACTIVE),
)
_FRESH = or_(assignment.c.state == "finished", person.c.seen >= bindparam("since"))
_TAKEN = (
    select(assignment.c.cell, func.count())
    .join(person, person.c.id == assignment.c.person_id)
    .where(assignment.c.study_id == bindparam("study"), assignment.c.active == 1, _FRESH)
    .group_by(assignment.c.cell)
)
_HOLDERS = (
    select(assignment.c.place, assignment.c.person_id, _FRESH.label("fresh"))
    .join(person, person.c.id == assignment.c.person_id)
    .where(
        assignment.c.study_id == bindparam("study"),
        assignment.c.active == 1,
        assignment.c.cell == bindparam("of"),
    )
    .order_by(person.c.seen)
)


class Assignments(StorePart):
    """The part of the store that assigns participants to the cells of the design."""

    @transaction
    async def assign(
        self,
        connection: Connection,
        person_id: int,
        cells: Sequence[CellQuota],
        rule: Rule,
        rng: np.random.Generator,
        abandoned_after: timedelta = timedelta(minutes=30),
    ) -> Assignment | None:
        """Assign a participant to a cell if needed. Return the place, or None if all cells are full.

        A place counts as abandoned after its participant has been inactive for `abandoned_after`. It is then
        given to the next participant of the cell unless another place is free. Participants who return later
        keep their place if no other participant has it. Otherwise, they get a new place in any cell. Once
        a trial has started, call :meth:`assignment` instead.

        Args:
            cells: Quotas from the study file. Quotas set by :meth:`set_quota` take precedence.
            rule: Rule for choosing a cell; see :func:`choose`.
            abandoned_after: Period of inactivity after which a place counts as abandoned.

        Raises:
            StoreError: The participation has ended.
        """
        now = utc_now()
        quotas = await lock_study(connection, self._study_id)
        await self._check_active(connection, person_id, now)
        before = await place_of(connection, person_id)
        if before is not None:
            if before.state != "released":
                return before
            if await take_back(connection, self._study_id, before, "held"):
                return await place_of(connection, person_id)
        wanted = [quotas.get(str(index), cell.wanted) for index, cell in enumerate(cells)]
        here = {"study": self._study_id, "since": now - abandoned_after}
        while True:  # repeat if an inactive participant returned between the two queries
            taken = await _tally(connection, _TAKEN, here)
            cell = choose([taken.get(index, 0) for index in range(len(cells))], wanted, rule, rng)
            if cell is None:
                return None
            holders = (await connection.execute(_HOLDERS, {**here, "of": cell})).all()
            if (place := await _free_place(connection, holders, wanted[cell])) is not None:
                break
        await self._give(connection, person_id, (cell, place), cells, rng, now, new=before is None)
        return await place_of(connection, person_id)

    async def room(self, wanted: Sequence[int], first: str, abandoned_after: timedelta) -> int:
        """Return the number of free places minus the number of participants who still need one.

        Args:
            wanted: Quotas from the study file.
            first: Name of the first phase. Participants in this phase are not counted.
            abandoned_after: Period of inactivity after which participants and their places are not counted.
        """
        since = utc_now() - abandoned_after
        mine = person.c.study_id == self._study_id, person.c.status == "arrived"
        coming = select(func.count()).where(*mine, person.c.phase != first, person.c.seen >= since)
        async with self._database.reading() as connection:
            changed = select(study.c.quotas).where(study.c.id == self._study_id)
            quotas = dict((await connection.execute(changed)).scalar_one())
            counts = await _tally(connection, _TAKEN, {"study": self._study_id, "since": since})
            on_the_way = (await connection.execute(coming)).scalar_one()
        free = (quotas.get(str(cell), count) - counts.get(cell, 0) for cell, count in enumerate(wanted))
        return int(sum(max(0, number) for number in free) - on_the_way)

    async def assignment(self, person_id: int) -> Assignment | None:
        """Return a participant's place, even if it has been released, or None if none was ever assigned."""
        async with self._database.reading() as connection:
            return await place_of(connection, person_id)

    async def assignments(self) -> tuple[Assignment, ...]:
        """Return all assigned and released places, in the order in which they were first assigned."""
        query = select(*FIELDS).where(assignment.c.study_id == self._study_id).order_by(assignment.c.id)
        return tuple(Assignment(*row) for row in await self._database.rows(query))

    @transaction
    async def set_quota(self, connection: Connection, cell: int, wanted: int, who: str) -> None:
        """Change the target number of participants in a cell. Places that are already assigned are kept."""
        if cell < 0 or wanted < 0:
            raise StoreError(f"Cell {cell} cannot have {wanted} people; both are counted from 0.")
        quotas = {**await lock_study(connection, self._study_id), str(cell): wanted}
        await connection.execute(update(study).where(study.c.id == self._study_id).values(quotas=quotas))
        await note(
            connection, self._study_id, who, "quota changed", {"cell": cell, "wanted": wanted}, utc_now()
        )

    async def counts(self) -> Counts:
        mine = person.c.study_id == self._study_id
        by_status = select(person.c.status, func.count()).where(mine).group_by(person.c.status)
        by_place = (
            select(assignment.c.cell, assignment.c.state, func.count())
            .where(assignment.c.study_id == self._study_id)
            .group_by(assignment.c.cell, assignment.c.state)
        )
        async with self._database.snapshot() as connection:
            statuses = await _tally(connection, by_status)
            cells: dict[int, dict[str, int]] = {}
            for cell, state, number in await connection.execute(by_place):
                cells.setdefault(cell, {})[state] = number
        return Counts(statuses, {cell: CellCount(**states) for cell, states in sorted(cells.items())})

    async def _check_active(self, connection: Connection, person_id: int, now: datetime) -> None:
        mine = {"person": person_id, "study": self._study_id}
        active = await connection.execute(_ACTIVE, {**mine, "seen": now})
        if not active.rowcount:
            raise StoreError(
                f"Person {person_id} has ended the participation, or does not exist: no place is given."
            )

    async def _give(
        self,
        connection: Connection,
        person_id: int,
        place: tuple[int, int],
        cells: Sequence[CellQuota],
        rng: np.random.Generator,
        now: datetime,
        *,
        new: bool,
    ) -> None:
        values = {
            "cell": place[0],
            "place": place[1],
            "active": 1,
            "state": "held",
            "house_seed": cells[place[0]].house_seed(place[1]),
        }
        if new:
            own = {name: int(rng.integers(SEEDS)) for name in ("person_seed", "order_seed")}
            mine = {"person_id": person_id, "study_id": self._study_id, "created": now}
            await connection.execute(insert(assignment), {**mine, **own, **values})
        else:
            await connection.execute(
                update(assignment).where(assignment.c.person_id == person_id).values(**values)
            )
        await connection.execute(update(person).where(person.c.id == person_id).values(status="assigned"))


async def _free_place(connection: Connection, holders: Sequence[Any], wanted: int) -> int | None:
    taken = {holder.place for holder in holders}
    free = next((place for place in range(wanted) if place not in taken), None)
    if free is not None:
        return free
    abandoned = next((one for one in holders if not one.fresh and one.place < wanted), None)
    if abandoned is None:
        return None
    await set_place(connection, abandoned.person_id, "released")
    return int(abandoned.place)


async def _tally(
    connection: Connection, query: Select[Any], values: Mapping[str, Any] | None = None
) -> dict[Any, int]:
    return {row[0]: row[1] for row in await connection.execute(query, values)}


def choose(counts: Sequence[int], quotas: Sequence[int], rule: Rule, rng: np.random.Generator) -> int | None:
    """Choose a cell of the design for the next participant.

    Args:
        counts: Number of participants in each cell.
        quotas: Number of participants wanted in each cell.
        rule: `balanced` for the least filled cell, or `uniform` for any free cell. Ties are broken at random.

    Returns:
        Index of the cell, or None if all are full.
    """
    room = [cell for cell, (count, quota) in enumerate(zip(counts, quotas, strict=True)) if count < quota]
    if not room:
        return None
    if rule == "balanced":
        filled = {cell: counts[cell] / quotas[cell] for cell in room}
        least = min(filled.values())
        room = [cell for cell in room if filled[cell] == least]
    return room[int(rng.integers(len(room)))]


async def place_of(connection: Connection, person_id: int) -> Assignment | None:
    row = (await connection.execute(_PLACE, {"person": person_id})).first()
    return None if row is None else Assignment(*row)


async def take_back(connection: Connection, study_id: int, place: Assignment, state: PlaceState) -> bool:
    """Give a released place back to its participant. Return False if another participant has it now."""
    query = select(assignment.c.id).where(
        assignment.c.study_id == study_id,
        assignment.c.cell == place.cell,
        assignment.c.place == place.place,
        assignment.c.active == 1,
    )
    if (await connection.execute(query)).first() is not None:
        return False
    await set_place(connection, place.person_id, state)
    return True


async def set_place(connection: Connection, person_id: int, state: PlaceState) -> None:
    await connection.execute(
        update(assignment)
        .where(assignment.c.person_id == person_id)
        .values(state=state, active=None if state == "released" else 1)
    )
