"""Create a study that all participants have finished, with its file, database and visits."""

import asyncio
import hashlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, create_engine, insert

from benchmarks.support.grown_records import Source, grow_visits
from experiments.cli.study.database import DATABASE, sqlite_url
from experiments.record.phases import TASK
from experiments.study.file import read_people_study
from experiments.visit.store import Store
from experiments.visit.store.tables import answer, assignment, person, phase, trial

STUDY = """
[[cells]]
assistance = "optimal"
objects = 1
people = {people}
fidelity = "event"

[study]
name = "grown"
title = "A study that has grown"
institution = "a benchmark"
contact = "study@example.org"
phases = ["consent", "comprehension", "task", "survey", "completion"]
"""
ANSWERS: Mapping[str, Mapping[str, Any]] = {
    "consent": {"agreed": True},
    "comprehension": {"attempts": 1, "hands": "Two"},
    "survey": {"useful": 4, "games": "Every day", "age": 30, "comments": "It went well."},
}
BEGAN = datetime(2026, 1, 1, tzinfo=UTC)


def fill_study(folder: Path, real: Mapping[str, Sequence[Source]], people: int) -> Path:
    """Write the study to a new folder. Return the path of the study file."""
    folder.mkdir(parents=True)
    file = folder / "study.toml"
    file.write_text(STUDY.format(people=people))
    study, url = read_people_study(file), sqlite_url(folder / DATABASE)
    asyncio.run(_make(url, study.settings.name, study.sha256))
    tokens = [hashlib.sha256(str(number).encode()).hexdigest() for number in range(people)]
    _fill(create_engine(url), tokens, study.settings.phases)
    grow_visits(real, [folder / "visits" / token / TASK for token in tokens])
    return file


async def _make(url: str, name: str, file_hash: str) -> None:
    store = await Store.open(url, name, file_hash)
    await store.close()


def _fill(engine: Engine, tokens: Sequence[str], phases: Sequence[str]) -> None:
    """Add all participants in a single transaction, which is much faster than one transaction each."""
    people, places, passed, given, trials = [], [], [], [], []
    for number, token in enumerate(tokens, start=1):
        began = BEGAN + timedelta(minutes=number)
        ended = began + timedelta(minutes=20)
        mine = {"person_id": number}
        people.append(
            {"id": number, "study_id": 1, "token_hash": token, "platform": "link", "status": "finished"}
            | {"phase": phases[-1], "created": began, "seen": ended, "delete_wanted": False}
        )
        places.append(
            {**mine, "study_id": 1, "cell": 0, "place": number - 1, "active": 1, "state": "finished"}
            | {"house_seed": number, "person_seed": number, "order_seed": number, "created": began}
        )
        passed += [
            {**mine, "name": name, "shown": began, "ended": ended, "duration_s": 60.0} for name in phases[:-1]
        ]
        given += [
            {**mine, "phase": name, "item": item, "value": value, "given": ended, "final": True}
            for name, answers in ANSWERS.items()
            for item, value in answers.items()
        ]
        folder = f"visits/{token}/{TASK}"
        trials.append({**mine, "phase": TASK, "folder": folder, "ended": "all delivered", "finished": ended})
    with engine.begin() as connection:
        for table, rows in zip(
            (person, assignment, phase, answer, trial), (people, places, passed, given, trials), strict=True
        ):
            connection.execute(insert(table), rows)
    engine.dispose()
