"""Report on a rehearsal, and compare the database with the outcomes of the simulated visits."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from experiments.analysis.study.table import ANALYSIS
from experiments.errors import ConfigError
from experiments.record.files import read_json
from experiments.study.data.collect import check_people, collect, write_collected
from experiments.study.data.copies import note_copy
from experiments.study.data.export import export
from experiments.study.file import Study
from experiments.study.payments.rules import decide, due
from experiments.study.rehearsal.person import Rehearsed
from experiments.study.rehearsal.run import SERVED, RehearsalSettings
from experiments.visit.recruiter import Leaving
from experiments.visit.store import Store
from experiments.visit.tokens import token_hash
from mjsim.support.files import write_text_atomically

REPORT, TABLE, EXPORT = "rehearsal.json", "table", "export"
STATUS: dict[str, Leaving] = {  # expected status in the database for each outcome of a visit
    "finished": "finished",
    "withdraws": "withdrawn",
    "withdraws and deletes": "withdrawn",
    "refuses": "no_consent",
    "fails": "screened_out",
    "gives up": "screened_out",
}


@dataclass(frozen=True)
class RehearsalReport:
    """The result of a rehearsal.

    Attributes:
        cells: Number of participants who finished, by cell.
        owed: Total amount of all payments that would be due, in hundredths of the currency.
    """

    settings: RehearsalSettings
    passed: bool
    outcomes: dict[str, int]
    cells: dict[int, int]
    owed: int
    faults: list[str]


async def report(
    study: Study, settings: RehearsalSettings, store: Store, people: Sequence[Rehearsed], out: Path
) -> RehearsalReport:
    """Record payments, export and analyse the data, check the database, and write the rehearsal's report."""
    from experiments.study.data.analyses import analysis_faults  # `study pay` needs no statistics

    study, served = replace(study, rehearsal=True), out / SERVED
    known = {person.token_hash: person for person in await store.people()}
    faults = [f"person {one.number}: {fault}" for one in people for fault in one.faults]
    for one in people:
        person = known.pop(token_hash(one.link.rpartition("/")[2]), None)
        wanted = STATUS.get(one.outcome)
        if person is None:
            faults.append(f"person {one.number} is not in the database")
        elif wanted is not None and person.status != wanted:
            faults.append(f"person {one.number} {one.outcome}, and is {person.status} in the database")
    faults += [f"{name} is in the database but not in the plan" for name in known]
    payments = due(study, await store.people(), await store.trials())
    await decide(store, payments)
    if await decide(store, payments):
        faults.append("payments were decided twice")
    found = await collect(study, store, served)
    faults += [f"{person}: {fault}" for person, fault in found.unusable.items()]
    if found.rows:
        note_copy(served, "table", out / TABLE)
        write_collected(found, out / TABLE)
        await export(study, store, served, out / EXPORT, replace=True)
    faults += analysis_faults(study, out / TABLE, out / ANALYSIS)
    counts = (await store.counts()).cells
    made = RehearsalReport(
        settings,
        not faults,
        dict(Counter(one.outcome for one in people)),
        {cell: count.finished for cell, count in counts.items()},
        sum(payment.cents for payment in payments),
        faults,
    )
    write_text_atomically(out / REPORT, msgspec.json.format(msgspec.json.encode(made)).decode() + "\n")
    return made


PASSED, WITHOUT = "rehearsal passed", "pays without a rehearsal"


async def require_rehearsal(store: Store, study: Study, folder: Path | None, *, without: bool) -> None:
    """Raise an error unless a study file has been rehearsed, and record the rehearsal in the audit log.

    Args:
        folder: Folder of a rehearsal, or None if the audit log already contains a successful rehearsal.
        without: True to allow a study without a rehearsal, which is then recorded in the audit log.

    Raises:
        ConfigError: There is no successful rehearsal of this version of the study file.
        RecordError: The database contains simulated participants.
    """
    check_people(study, await store.people())
    log = await store.audit_log()
    if any(row.action == PASSED and row.details.get("study") == study.sha256 for row in log):
        return
    if folder is not None:
        found = read_json(folder / REPORT)
        if found.get("settings", {}).get("study") != study.sha256:
            raise ConfigError(
                f"{folder / REPORT} is that of another study file; rehearse {study.path} as it is now"
            )
        if found.get("passed") is not True:
            raise ConfigError(f"{folder / REPORT} lists what went wrong; correct it and rehearse again")
        await store.audit("mjsim", PASSED, {"study": study.sha256, "people": found["settings"]["people"]})
    elif without:
        await store.audit("mjsim", WITHOUT, {"study": study.sha256})
    else:
        raise ConfigError(
            f"no rehearsal of {study.path} has passed: run `mjsim study rehearse` and name its folder by --rehearsal, "
            "or pay all the same by --without-rehearsal"
        )
