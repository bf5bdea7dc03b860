"""Delete identifying data when a participant has been inactive for the retention period of the study."""

import asyncio
import datetime
import hashlib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from experiments.errors import StoreError
from experiments.study.data.collect import person_name, visit_name
from experiments.study.data.erase import change_databases, erase, remove_from_files
from experiments.visit.store import PersonRow, Store, utc_now

LOG = logging.getLogger("mjsim.study")
WHO = "keep_days"  # user name of automatic deletions in the audit log
DAY = 86400.0  # one day, in seconds


@dataclass(frozen=True)
class Retained:
    """The names of all participants whose retention period has ended.

    Attributes:
        forgotten: Participants whose identifying data was deleted.
        erased: Participants whose data was completely deleted at their request.
        unpaid: Participants whose data is kept until they have been paid.
    """

    forgotten: tuple[str, ...]
    erased: tuple[str, ...]
    unpaid: tuple[str, ...]


async def forget_old(store: Store, visits: Path, keep_days: int, *, dry: bool = False) -> Retained:
    """Delete the platform ids, keys and links of participants who have been inactive for `keep_days` days.

    Participants who asked for deletion are erased. The measures and answers of all others are kept.
    Participants with a pending payment are skipped. The data is also deleted from known backups.

    Args:
        dry: True to report the affected participants without deleting anything.
    """
    before = utc_now() - datetime.timedelta(days=keep_days)
    owed = {p.person_id for p in await store.ledger.owed()}
    people = [await store.person(number) for number in await store.known(before)]
    paid = [person for person in people if person.id not in owed]
    deleted, kept = ([p for p in paid if p.delete_wanted is wanted] for wanted in (True, False))
    played, names = {row.person_id for row in await store.trials()}, await _names(store, kept)
    # If the runs of a participant are on another host, that host deletes the data.
    places = {p.id: (visits / p.token_hash, visits / names[p.id]) for p in kept}
    kept = [p for p in kept if p.id not in played or any(place.is_dir() for place in places[p.id])]
    if not dry:
        for person in deleted:
            await erase(store, visits.parent, person_name(person), WHO)
        if kept:
            await _forget(store, visits, kept, names)
    return Retained(
        tuple(map(person_name, kept)),
        tuple(map(person_name, deleted)),
        tuple(person_name(person) for person in people if person.id in owed),
    )


async def forget_daily(store: Store, visits: Path, keep_days: int) -> NoReturn:
    """Run `forget_old` once a day until cancelled."""
    while True:
        try:
            found = await forget_old(store, visits, keep_days)
            if found.forgotten or found.erased:
                LOG.info("%d people forgotten, %d erased", len(found.forgotten), len(found.erased))
        except (StoreError, OSError) as error:  # the deletion is tried again a day later
            LOG.warning("%s", error)
        await asyncio.sleep(DAY)


async def _names(store: Store, people: Sequence[PersonRow]) -> dict[int, str]:
    """Choose new names for the run folders. The old names are hashes of links, which identify participants."""
    study = await store.study()
    made = {p.id: f"{study.name} {study.created} {p.id}" for p in people}
    return {number: hashlib.sha256(text.encode()).hexdigest() for number, text in made.items()}


async def _forget(store: Store, visits: Path, people: Sequence[PersonRow], names: Mapping[int, str]) -> None:
    numbers = [person.id for person in people]

    async def gone(backup: Store) -> bool:
        ever = datetime.datetime.max.replace(tzinfo=datetime.UTC)
        identified = set(numbers) & set(await backup.known(ever))
        if identified:
            await backup.forget(sorted(identified), [names[number] for number in sorted(identified)], WHO)
        return bool(identified)

    await change_databases(store, visits.parent, gone, "them")
    for person in people:  # derived files may contain the old folder name
        traces = (person.token_hash, visit_name(person.token_hash))
        await asyncio.to_thread(remove_from_files, visits.parent, traces)
    for person in people:  # an interrupted deletion may already have renamed some folders
        if (folder := visits / person.token_hash).is_dir():
            await asyncio.to_thread(folder.rename, visits / names[person.id])
    await store.forget(numbers, [names[number] for number in numbers], WHO)
