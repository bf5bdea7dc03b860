"""Deleting a person from a study: the files first, then the rows that name them."""

import asyncio
import datetime
import re
from pathlib import Path

from experiments.errors import ConfigError, StoreError
from experiments.people import VISITS
from experiments.people.store import Store
from experiments.web.server.visits import Visits

_NAME = re.compile(r"p?(\d{1,9})", re.ASCII)


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
    found = _NAME.fullmatch(name)
    if found is None:
        raise ConfigError(f"{name!r} is no person; tables name people like p00012")
    person = await store.person(int(found[1]))
    owed = await store.ledger.owed(in_doubt_after=datetime.timedelta())
    if mine := [payment.key for payment in owed if payment.person_id == person.id]:
        raise StoreError(f"{name} is owed {', '.join(mine)}: pay first, then erase")
    await asyncio.to_thread(Visits(folder / VISITS).remove, person.token_hash)
    await store.erase(person.id, who)
