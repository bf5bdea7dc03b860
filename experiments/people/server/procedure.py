"""How a person gets through a study: the phase under way, what is sent in it, and what follows."""

import asyncio
import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from experiments.people.phases.base import Again, Answers, Done, FormData, Phase, Visitor
from experiments.people.phases.played import Played
from experiments.people.store import Assignment, CellQuota, Person, Status, Store
from experiments.people.store.values import utc_now
from experiments.people.study_file import PLAYED, Study
from experiments.record.phases import FLYTHROUGH, STORY, TASK, TRAINING
from experiments.trials.training import training_config
from experiments.web.server.visits import Ended, Visit, Visits

TRAINING_LIMIT = 24 * 3600.0  # s; as good as none
FULL = "full"  # why a phase ended for somebody who got no place
ATTEMPTS = "attempts"  # answer in which the attempts at a phase are counted


@dataclass(frozen=True)
class Now:
    """Where a person is.

    Attributes:
        phase: Under way; None for somebody who has ended.
        number: Of the phase, from 1.
        wait: Seconds before it may be ended.
    """

    person: Person
    phase: Phase | None
    number: int
    visitor: Visitor
    wait: float


class Procedure:
    """The phases of a study, its store, and the visits of its people.

    Args:
        study: The study.
        phases: Its phases.
        store: Keeps what is known of people.
        visits: Keep what is played.
        rng: Draws cells.
    """

    def __init__(
        self, study: Study, phases: Sequence[Phase], store: Store, visits: Visits, rng: np.random.Generator
    ) -> None:
        self.study, self.phases, self.store, self.visits = study, phases, store, visits
        self._rng = rng
        self._names = [phase.name for phase in phases]

    async def now(self, person: Person, path: str) -> Now:
        """Where a person is; trials that are over are noted first."""
        person = await self.after_trials(person)
        if not person.active and person.status != "finished":
            return Now(person, None, 0, Visitor({}, 0.0, 0, path), 0.0)
        number = self._names.index(person.phase)
        shown = await self.store.show_phase(person.id, person.phase)
        passed = (utc_now() - shown.shown).total_seconds()
        minimum = self.study.settings.minimum.get(person.phase, 0.0)
        wait = max(0.0, minimum - passed) if passed >= 0.0 else 0.0  # the clock was set back
        rows = await self.store.answers(person.id)
        answers = {row.item: row.value for row in rows if row.phase == person.phase}
        visitor = Visitor(answers, passed, answers.get(ATTEMPTS, 0), path)
        return Now(person, self.phases[number], number + 1, visitor, wait)

    async def submit(self, now: Now, phase: str, sent: FormData) -> Again | None:
        """Take what was sent in a phase; what is wrong with it, or None. What comes from an earlier page is ignored."""
        current, settings = now.phase, self.study.settings
        if current is None or phase != current.name or isinstance(current, Played):
            return None
        if phase == self._names[-1]:
            return None
        skipped = bool(sent.get("skip")) and phase in settings.optional
        if now.wait > 0.0 and not skipped:
            return Again(self.study.texts["common"]["too_early"])
        read = Done({"skipped": True}) if skipped else current.read(now.visitor, sent)
        attempts = {ATTEMPTS: now.visitor.attempts + 1}
        if isinstance(read, Again):
            await self.store.save_answers(now.person.id, phase, attempts)
            return read
        answers = {**read.answers, **(attempts if now.visitor.attempts else {})}
        if read.outcome == "next":
            await self._move_on(now.person, phase, answers)
        else:
            await self.store.finish_phase(now.person.id, phase, phase, answers, status=read.outcome)
        return None

    async def save(self, now: Now, phase: str, sent: FormData) -> None:
        """Keep answers of a form that is not sent yet."""
        current = now.phase
        if current is None or phase != current.name or not hasattr(current, "drafts"):
            return
        if drafts := current.drafts(sent):
            await self.store.save_answers(now.person.id, phase, drafts)

    async def assign(self, person: Person) -> Assignment | None:
        """The place of a person who has not begun to play; a sign of life as well. None if all cells are full."""
        trials = (cell.trials for cell in self.study.cells)
        quotas = [CellQuota(len(each), [trial.house_seed for trial in each]) for each in trials]
        rule = self.study.settings.assignment
        return await self.store.assign(person.id, quotas, rule, self._rng, abandoned_after=self._away)

    async def begin_playing(self, person: Person, place: Assignment, token: str) -> Visit:
        """Start the visit in which a person plays, with the first phase that is played."""
        ended = await self._before_playing(person)
        played = [name for name in self._names if name in PLAYED]
        return await asyncio.to_thread(self.visits.create, token, played, self._trials(place), ended)

    async def withdraw(self, person: Person, *, delete: bool) -> None:
        await self.store.withdraw(person.id, delete=delete)
        if delete:
            await asyncio.to_thread(self.visits.remove, person.token_hash)

    async def room(self) -> int:
        """How many places are free to whom nobody is on the way."""
        wanted = [len(cell.trials) for cell in self.study.cells]
        return await self.store.room(wanted, self._names[0], self._away)

    async def turn_away(self, person: Person) -> Person:
        """End the participation of somebody for whom there is no place."""
        here = person.phase
        await self.store.finish_phase(person.id, here, here, {}, FULL, status="screened_out")
        return await self.store.person(person.id)

    @property
    def _away(self) -> datetime.timedelta:
        return datetime.timedelta(seconds=self.study.settings.limits.abandoned_after)

    def _trials(self, place: Assignment) -> Mapping[str, dict[str, Any]]:
        task = msgspec.structs.replace(
            self.study.cells[place.cell].trial(place.place),
            house_seed=place.house_seed,
            person_seed=place.person_seed,
            order_seed=place.order_seed,
        )
        training = msgspec.structs.replace(training_config(task), time_limit=TRAINING_LIMIT)
        return {TRAINING: training.settings(), TASK: task.settings()}

    async def _before_playing(self, person: Person) -> list[Ended]:
        """The phases that the record of the task tells of."""
        wanted = [name for name in (STORY, FLYTHROUGH) if name in self._names]
        found = {phase.name: phase for phase in await self.store.phases(person.id)} if wanted else {}
        told = [found[name] for name in wanted if name in found]
        return [Ended(phase.name, phase.duration_s or 0.0) for phase in told]

    async def after_trials(self, person: Person) -> Person:
        """The person, after all trials that are over were noted; their runs are on the disk."""
        while person.active and person.phase in PLAYED:
            visit = self.visits.named(person.token_hash)
            if visit is None or visit.phase == person.phase:
                break
            metrics = await asyncio.to_thread(visit.metrics, person.phase)
            folder = visit.run(person.phase).relative_to(self.visits.folder.parent)
            await self.store.finish_trial(person.id, person.phase, folder.as_posix(), metrics["ended"])
            await self._move_on(person, person.phase, {}, metrics["ended"])
            person = await self.store.person(person.id)
        return person

    async def _move_on(self, person: Person, phase: str, answers: Answers, reason: str | None = None) -> None:
        """End a phase; who reaches the last one has finished the study."""
        following = self._names[self._names.index(phase) + 1]
        status: Status | None = "finished" if following == self._names[-1] else None
        await self.store.finish_phase(person.id, phase, following, answers, reason, status=status)
