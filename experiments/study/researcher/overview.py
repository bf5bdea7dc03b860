"""Summarize the progress of a study for the researcher's page."""

import statistics
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any

from experiments.study.file import Study
from experiments.visit.plan import DEVICE
from experiments.visit.store import PaymentEvent, PersonRow, Status, Store, utc_now
from experiments.visit.store.ledger import by_key, paid
from experiments.web.server.sessions import Sessions


async def overview(study: Study, store: Store, sessions: Sessions) -> Mapping[str, Any]:
    """Return the values that the template `researcher/overview.html` shows."""
    row, counts, people = await store.study(), await store.counts(), await store.people()
    checked = [answer.value for answer in await store.answers_to(DEVICE, "frames_per_s")]
    playing = [one.display.frames_per_s for one in sessions.under_way.values() if one.display and one.browser]
    away = utc_now() - timedelta(seconds=study.settings.limits.abandoned_after)
    return {
        "at": utc_now(),
        "state": row.state,
        "statuses": counts.statuses,
        "cells": [
            (cell.label, row.quotas.get(index, len(cell.trials)), counts.cells.get(index))
            for index, cell in enumerate(study.cells)
        ],
        "phases": [
            (name, *_phase([one for one in people if one.phase == name], away))
            for name in study.settings.phases
        ],
        "checked": _frames(checked),
        "playing": _frames(playing),
        "payments": list(_payments(await store.ledger.history())),
        "waiting": sessions.limit.waiting,
    }


def _phase(people: Sequence[PersonRow], away: datetime) -> tuple[int, int, Mapping[Status, int]]:
    """Return the number of active participants, of those who are idle, and of the others by status."""
    here = [person for person in people if person.active]
    left = Counter(person.status for person in people if not person.active)
    return len(here), sum(person.seen < away for person in here), left


def _frames(found: Sequence[float]) -> Mapping[str, float] | None:
    return {"people": len(found), "lowest": min(found), "median": statistics.median(found)} if found else None


def _payments(history: Sequence[PaymentEvent]) -> Iterator[Mapping[str, Any]]:
    """Summarize the payments by type and currency. Amounts are in hundredths of the currency unit."""
    payments = by_key(history).values()
    for kind, currency in sorted({(events[0].kind, events[0].currency) for events in payments}):
        mine = [events for events in payments if (events[0].kind, events[0].currency) == (kind, currency)]
        settled = [events for events in mine if paid(events)]
        last = [events[-1] for events in mine if not paid(events)]
        yield {
            "kind": kind,
            "currency": currency,
            "decided": len(mine),
            "decided_cents": sum(events[0].cents for events in mine),
            "confirmed": len(settled),
            "confirmed_cents": sum(events[0].cents for events in settled),
            "in_doubt": sum(event.in_doubt for event in last),
            "failed": sum(event.event == "failed" for event in last),
        }
