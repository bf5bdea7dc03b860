"""Deleting by date who people are: `keep_days` of the study file."""

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
from experiments.visit.store import Person, Store, utc_now

LOG = logging.getLogger("mjsim.study")
WHO = "keep_days"  # in the audit log
DAY = 86400.0  # s


@dataclass(frozen=True)
class Retained:
    """What was deleted.

    Attributes:
        forgotten: People of whom nobody can tell any more who they are.
        erased: People who wanted their data deleted, and of whom nothing is left.
        unpaid: People who are kept until they are paid.
    """

    forgotten: tuple[str, ...]
    erased: tuple[str, ...]
    unpaid: tuple[str, ...]


async def forget_old(
    store: Store, visits: Path, keep_days: int, *, dry: bool = False, now: datetime.datetime | None = None
) -> Retained:
    """Delete who people are `keep_days` after their last sign: ids of platforms, keys and links.

    People who wanted their data deleted are erased; of the others, what they did and answered stays under their
    number. Who is owed a payment is kept until it is made. Backups that the study knows of are written anew.

    Args:
        store: The store.
        visits: The folder of visits in the study's folder.
        keep_days: Days.
        dry: Only say what would be deleted.
        now: The time, with its zone.
    """
    before = (now or utc_now()) - datetime.timedelta(days=keep_days)
    owed = {p.person_id for p in await store.ledger.owed(in_doubt_after=datetime.timedelta())}
    people = [await store.person(number) for number in await store.known(before)]
    paid = [person for person in people if person.id not in owed]
    deleted, kept = ([p for p in paid if p.delete_wanted is wanted] for wanted in (True, False))
    played, names = {row.person_id for row in await store.trials()}, await _names(store, kept)
    # People whose runs are on another host are forgotten there.
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
    """Do so once a day, for as long as the server runs."""
    while True:
        try:
            found = await forget_old(store, visits, keep_days)
            if found.forgotten or found.erased:
                LOG.info("%d people forgotten, %d erased", len(found.forgotten), len(found.erased))
        except (StoreError, OSError) as error:  # tomorrow it may work
            LOG.warning("%s", error)
        await asyncio.sleep(DAY)


async def _names(store: Store, people: Sequence[Person]) -> dict[int, str]:
    """New names for the hashes of links: with the study's secret, these follow from the platform's ids."""
    study = await store.study()
    made = {p.id: f"{study.name} {study.created} {p.id}" for p in people}
    return {number: hashlib.sha256(text.encode()).hexdigest() for number, text in made.items()}


async def _forget(store: Store, visits: Path, people: Sequence[Person], names: Mapping[int, str]) -> None:
    numbers = [person.id for person in people]

    async def gone(backup: Store) -> bool:
        ever = datetime.datetime.max.replace(tzinfo=datetime.UTC)
        identified = set(numbers) & set(await backup.known(ever))
        if identified:
            await backup.forget(sorted(identified), [names[number] for number in sorted(identified)], WHO)
        return bool(identified)

    await change_databases(store, visits.parent, gone, "them")
    for person in people:  # what was made of a folder of visits names the hash of the link
        traces = (person.token_hash, visit_name(person.token_hash))
        await asyncio.to_thread(remove_from_files, visits.parent, traces)
    for person in people:  # done again after a stop: who is moved already is not there
        if (folder := visits / person.token_hash).is_dir():
            await asyncio.to_thread(folder.rename, visits / names[person.id])
    await store.forget(numbers, [names[number] for number in numbers], WHO)
