"""Erase a participant from a study, first from files and copies and then from the database."""

import asyncio
import csv
import shutil
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

from experiments.analysis.study.table import ANALYSIS, FILES
from experiments.errors import StoreError
from experiments.record.files import csv_text
from experiments.study.data.collect import person_name, person_number, visit_name
from experiments.study.data.copies import DATABASES, Copy, copies, forget_copies
from experiments.study.data.export import DATA, RUNS
from experiments.trials.table import NAME, read_rows, write_tables
from experiments.visit.folders import VISITS, VisitFolders
from experiments.visit.store import PersonRow, Store, change_database
from mjsim.support.files import WORK, remove_leftovers, write_text_atomically

LEFTOVER_S = 3600.0  # age after which temporary files are considered abandoned, in seconds


async def erase(store: Store, folder: Path, name: str, who: str) -> list[str]:
    """Erase a participant from a study and from all its known backups, tables and exports.

    Args:
        name: The participant's name in tables, such as `p00012`.

    Returns:
        A message for each copy that was changed or is missing.

    Raises:
        ConfigError: `name` is not a participant's name.
        StoreError: There is no such participant, a payment is still owed, or a copy cannot be changed.
        OSError: A file cannot be changed.
    """
    person = await store.person(person_number(name))
    name = person_name(person)
    owed = await store.ledger.owed()
    if mine := [payment.key for payment in owed if payment.person_id == person.id]:
        raise StoreError(f"{name} is owed {', '.join(mine)}: pay first, then erase")
    told = await _erase_from_copies(store, folder, person, who)
    visits = VisitFolders(folder / VISITS)
    played = any(row.person_id == person.id for row in await store.trials())
    if played and not person.delete_wanted and not (visits.path / person.token_hash).exists():
        told.append(
            f"the runs of {name} are not on this machine; delete {VISITS}/{person.token_hash} where they are"
        )
    await asyncio.to_thread(visits.remove, person.token_hash)
    if (visits.path / person.token_hash).exists():
        raise StoreError(f"{visits.path / person.token_hash} cannot be deleted; delete it, then erase again")
    await store.erase(person.id, who)
    return told


async def _erase_from_copies(store: Store, folder: Path, person: PersonRow, who: str) -> list[str]:
    async def gone(other: Store) -> bool:
        # Numbers are reused after an old backup is restored, so the arrival times must match as well.
        same = {one.id for one in await other.people() if one.created == person.created} & {person.id}
        for number in same:
            await other.erase(number, who, unpaid=True)
        return bool(same)

    name, token = person_name(person), person.token_hash
    told = await change_databases(store, folder, gone, name)
    return told + await asyncio.to_thread(remove_from_files, folder, (name, token, visit_name(token)))


async def change_databases(
    store: Store, folder: Path, work: Callable[[Store], Awaitable[bool]], name: str
) -> list[str]:
    """Apply a function to all backups and restored databases. Return a message for each changed copy."""
    study, told = await store.study(), []
    for copy in copies(folder):
        path = Path(copy.path)
        if copy.kind in DATABASES and not store.is_at(path):
            if not path.exists():
                told.append(_missing(copy, name))
            elif await change_database(path, study.name, work):
                told.append(f"{_shown(copy)} was rewritten without {name}")
    return told


def remove_from_files(folder: Path, names: Sequence[str]) -> list[str]:
    """Remove a participant from all files that were made from a folder. Return a message for each file."""
    told, deleted, listed = list[str](), set[str](), copies(folder)
    if (usual := folder / ANALYSIS).is_dir():  # earlier versions did not list analyses as copies
        listed.append(Copy("analysis", str(usual), ""))
    for place in {folder, *(Path(copy.path).parent for copy in listed)}:
        for left in place.glob(f"{WORK}*"):
            process = left.name.removeprefix(WORK).partition("-")[0]
            if not Path("/proc", process).exists():
                remove_leftovers(place, LEFTOVER_S, f"{WORK}{process}-")
    for copy in listed:
        path = Path(copy.path)
        files = [path / name for name in FILES if (path / name).is_file()] if path.is_dir() else [path]
        if copy.kind in DATABASES:
            continue
        if not path.exists():
            told.append(_missing(copy, names[0]))
        elif copy.kind in ("table", "export"):
            told += remove_from_files(path, names) if path != folder.absolute() else []
            if _remove_from_tables(path, names):
                told.append(f"{_shown(copy)} was rewritten without {names[0]}")
        elif not set(names).isdisjoint(Path(copy.source).parts) or any(
            name.encode() in file.read_bytes() for file in files for name in names
        ):
            for file in files:
                file.unlink()
            deleted.add(copy.path)
            told.append(f"{_shown(copy)} was deleted because it contained {names[0]}; make it again")
    forget_copies(folder, deleted)
    return told


def _missing(copy: Copy, name: str) -> str:
    return f"{_shown(copy)} is missing; if it was moved, delete {name} there and in files made from it"


def _shown(copy: Copy) -> str:
    return f"{copy.kind} {copy.path}" + f" of {copy.made[:10]}" * bool(copy.made)


def _remove_from_tables(folder: Path, names: Sequence[str]) -> bool:
    found = False
    if (parquet := folder / f"{NAME}.parquet").is_file():
        rows = read_rows(parquet)
        others = [row for row in rows if row.get("participant") not in names]
        found = len(others) < len(rows)
        if found and others:
            write_tables(folder, others)
        elif found:
            parquet.unlink()
    for path in (*folder.glob("*.csv"), *(folder / DATA).glob("*.csv")):
        found |= _remove_from_csv(path, names)
    if (runs := folder / RUNS / names[0]).is_dir():
        shutil.rmtree(runs)
        found = True
    return found


def _remove_from_csv(path: Path, names: Sequence[str]) -> bool:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    if "participant" not in header:
        return False
    column = header.index("participant")
    others = [row for row in rows if row[column] not in names]
    if found := len(others) < len(rows):
        write_text_atomically(path, csv_text(header, others))
    return found
