"""Summarize the progress of a study for the researcher's page."""

import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from experiments.study.file import Study
from experiments.visit.plan import DEVICE
from experiments.visit.store import PersonRow, Status, Store, StudyState, utc_now
from experiments.visit.store.ledger import by_key, paid
from experiments.web.server.sessions import Sessions

LEFT: tuple[Status, ...] = ("no_consent", "screened_out", "withdrawn", "timed_out")


@dataclass(frozen=True)
class CellLine:
    """The number of participants in a cell of the study design, by state."""

    index: int
    label: str
    wanted: int
    held: int
    finished: int
    released: int


@dataclass(frozen=True)
class PhaseLine:
    """The number of active (`here`), idle (`away`) and dropped-out (`left`) participants in a phase."""

    name: str
    here: int
    away: int
    left: Mapping[Status, int]


@dataclass(frozen=True)
class Frames:
    """The number of participants with a measured frame rate, and the lowest and the median rate in fps."""

    people: int
    lowest: float
    median: float


@dataclass(frozen=True)
class PayLine:
    """A summary of all payments of one type and currency. Amounts are in hundredths of the currency."""

    kind: str
    currency: str
    decided: int
    decided_cents: int
    confirmed: int
    confirmed_cents: int
    in_doubt: int
    failed: int


@dataclass(frozen=True)
class Overview:
    """A summary of a study. Frame rates come from device checks (`checked`) and sessions (`playing`)."""

    at: datetime
    state: StudyState
    statuses: Mapping[str, int]
    cells: Sequence[CellLine]
    phases: Sequence[PhaseLine]
    checked: Frames | None
    playing: Frames | None
    payments: Sequence[PayLine]
    waiting: int


async def overview(study: Study, store: Store, sessions: Sessions) -> Overview:
    row, counts, people = await store.study(), await store.counts(), await store.people()
    checked = [answer.value for answer in await store.answers_to(DEVICE, "frames_per_s")]
    playing = [one.display.frames_per_s for one in sessions.under_way.values() if one.display and one.browser]
    cells = [
        CellLine(
            index,
            cell.label,
            row.quotas.get(index, len(cell.trials)),
            *(getattr(counts.cells.get(index), state, 0) for state in ("held", "finished", "released")),
        )
        for index, cell in enumerate(study.cells)
    ]
    away = utc_now() - timedelta(seconds=study.settings.limits.abandoned_after)
    return Overview(
        utc_now(),
        row.state,
        counts.statuses,
        cells,
        [_phase(name, [one for one in people if one.phase == name], away) for name in study.settings.phases],
        _frames(checked),
        _frames(playing),
        await _payments(store),
        sessions.limit.waiting,
    )


def _phase(name: str, people: Sequence[PersonRow], away: datetime) -> PhaseLine:
    here = [person for person in people if person.active]
    left = Counter(person.status for person in people if person.status in LEFT)
    return PhaseLine(name, len(here), sum(person.seen < away for person in here), left)


def _frames(found: Sequence[float]) -> Frames | None:
    return Frames(len(found), min(found), statistics.median(found)) if found else None


async def _payments(store: Store) -> Sequence[PayLine]:
    payments = by_key(await store.ledger.history()).values()
    found = []
    for kind, currency in sorted({(events[0].kind, events[0].currency) for events in payments}):
        mine = [events for events in payments if (events[0].kind, events[0].currency) == (kind, currency)]
        settled = [events for events in mine if paid(events)]
        last = [events[-1] for events in mine if not paid(events)]
        found.append(
            PayLine(
                kind,
                currency,
                len(mine),
                sum(events[0].cents for events in mine),
                len(settled),
                sum(events[0].cents for events in settled),
                sum(event.in_doubt for event in last),
                sum(event.event == "failed" for event in last),
            )
        )
    return found
