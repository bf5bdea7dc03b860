"""Deleting a person from a study: the files first, then the rows that name them."""

import asyncio
import datetime
from pathlib import Path

from experiments.errors import StoreError
from experiments.people import VISITS
from experiments.people.collect import person_number
from experiments.people.store import Store
from experiments.web.server.visits import Visits


async def erase(store: Store, folder: Path, name: str, who: str) -> None:
    """Delete a person whose runs lie in the study's `folder`.

    Args:
        store: The store.
        folder: Of the study.
        name: Of the person in tables, such as `p00012`.
        who: Deletes, for the audit log.

    Raises:
        ConfigError: That is no name of a person.
        StoreError: There is no such person, or the person is owed something.
    """
    person = await store.person(person_number(name))
    owed = await store.ledger.owed(in_doubt_after=datetime.timedelta())
    if mine := [payment.key for payment in owed if payment.person_id == person.id]:
        raise StoreError(f"{name} is owed {', '.join(mine)}: pay first, then erase")
    await asyncio.to_thread(Visits(folder / VISITS).remove, person.token_hash)
    await store.erase(person.id, who)
