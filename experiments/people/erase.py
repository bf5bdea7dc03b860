"""Deleting a person from a study: copies and files first, then the rows that name them."""

import asyncio
import csv
import datetime
import io
import shutil
from pathlib import Path

from experiments.errors import StoreError
from experiments.people import VISITS
from experiments.people.collect import person_name, person_number
from experiments.people.copies import Copy, copies
from experiments.people.export import DATA, RUNS
from experiments.people.store import Store, rewrite_backup
from experiments.trials.table import NAME, read_rows, write_tables
from experiments.web.server.visits import Visits
from mjsim.files import write_text_atomically


async def erase(store: Store, folder: Path, name: str, who: str) -> list[str]:
    """Delete a person whose runs lie in the study's `folder`, also from backups, tables and exports that it knows of.

    Args:
        store: The store.
        folder: Of the study.
        name: Of the person in tables, such as `p00012`.
        who: Deletes, for the audit log.

    Returns:
        A line for each copy that held the person, or that is no longer where it was written.

    Raises:
        ConfigError: That is no name of a person.
        StoreError: There is no such person, or the person is owed something, or a copy cannot be changed.
        OSError: A file cannot be changed.
    """
    person = await store.person(person_number(name))
    name = person_name(person)
    owed = await store.ledger.owed(in_doubt_after=datetime.timedelta())
    if mine := [payment.key for payment in owed if payment.person_id == person.id]:
        raise StoreError(f"{name} is owed {', '.join(mine)}: pay first, then erase")
    told = await _erase_from_copies(store, folder, person.id, who)
    visits = Visits(folder / VISITS)
    played = any(row.person_id == person.id for row in await store.trials())
    if played and not person.delete_wanted and not (visits.folder / person.token_hash).exists():
        told.append(f"the runs of {name} are not here; delete {VISITS}/{person.token_hash} where they are")
    await asyncio.to_thread(visits.remove, person.token_hash)
    if (visits.folder / person.token_hash).exists():
        raise StoreError(
            f"{visits.folder / person.token_hash} cannot be deleted; delete it, then erase again"
        )
    await store.erase(person.id, who)
    return told


async def _erase_from_copies(store: Store, folder: Path, person_id: int, who: str) -> list[str]:
    """Delete a person from the copies that the study knows of; what to tell about them."""
    study, name = await store.study(), f"p{person_id:05d}"

    async def gone(backup: Store) -> bool:
        if person_id not in {other.id for other in await backup.people()}:
            return False
        await backup.erase(person_id, who, unpaid=True)
        return True

    told = []
    for copy in copies(folder):
        path = Path(copy.path)
        if not path.exists():
            told.append(f"{_shown(copy)} is not there any more; where it was moved, delete {name} there")
        elif copy.kind == "backup":
            if await rewrite_backup(path, study.name, gone):
                told.append(f"{_shown(copy)} was written anew without {name}")
        elif await asyncio.to_thread(_remove_from_tables, path, name):
            told.append(f"{_shown(copy)} was written anew without {name}")
    return told


def _shown(copy: Copy) -> str:
    return f"{copy.kind} {copy.path} of {copy.made[:10]}"


def _remove_from_tables(folder: Path, name: str) -> bool:
    """Take a person out of the tables and runs of an export or a table; whether the person was in it."""
    found = False
    if (parquet := folder / f"{NAME}.parquet").is_file():
        rows = read_rows(parquet)
        others = [row for row in rows if row.get("participant") != name]
        found = len(others) < len(rows)
        if found and others:
            write_tables(folder, others)
        elif found:
            parquet.unlink()
    for path in (*folder.glob("*.csv"), *(folder / DATA).glob("*.csv")):
        found |= _remove_from_csv(path, name)
    if (runs := folder / RUNS / name).is_dir():
        shutil.rmtree(runs)
        found = True
    return found


def _remove_from_csv(path: Path, name: str) -> bool:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    if "participant" not in header:
        return False
    column = header.index("participant")
    others = [row for row in rows if row[column] != name]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *others])
    if found := len(others) < len(rows):
        write_text_atomically(path, text.getvalue())
    return found
