"""A place: who has it, taking it and giving it away. The study must be locked."""

from sqlalchemy import bindparam, select, update
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.people.store.tables import assignment
from experiments.people.store.values import Assignment, PlaceState

FIELDS = [column for column in assignment.c if column.name not in ("id", "study_id", "active")]
_PLACE = select(*FIELDS).where(assignment.c.person_id == bindparam("person"))


async def place_of(connection: AsyncConnection, person_id: int) -> Assignment | None:
    """The place that a person has or had."""
    row = (await connection.execute(_PLACE, {"person": person_id})).first()
    return None if row is None else Assignment(*row)


async def take_back(connection: AsyncConnection, study_id: int, place: Assignment, state: PlaceState) -> bool:
    """Give a person a released place again; False if somebody else has it."""
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


async def set_place(connection: AsyncConnection, person_id: int, state: PlaceState) -> None:
    """Hold, finish or release the place of a person."""
    await connection.execute(
        update(assignment)
        .where(assignment.c.person_id == person_id)
        .values(state=state, active=None if state == "released" else 1)
    )
