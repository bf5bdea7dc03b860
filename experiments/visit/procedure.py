"""The procedure that leads participants through the phases of a study."""

import asyncio
import dataclasses
import datetime
import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from experiments.errors import RecordError
from experiments.record.phases import FLYTHROUGH, STORY, TASK
from experiments.visit.folders import Ended, VisitFolder, VisitFolders
from experiments.visit.phases import phases_of
from experiments.visit.phases.base import Again, Answers, Done, FormData, Phase, TrialPhase, Visitor
from experiments.visit.plan import DEBRIEFING, PHASES, PLAYED, RESULT, VisitPlan
from experiments.visit.recruiter import AFTER
from experiments.visit.store import Assignment, PersonRow, Status, Store
from experiments.visit.store.values import utc_now
from experiments.web.protocol import Open
from experiments.web.server.player import LiveTrial

LOG = logging.getLogger("mjsim.study")
FULL = "full"  # reason that is recorded if a visit ends because all cells are full
ATTEMPTS = "attempts"  # name under which the number of attempts is stored among the answers of a phase


@dataclass(frozen=True)
class PhaseState:
    """The current state of a participant's visit.

    Attributes:
        phase: Current phase, or None if the visit has ended.
        number: Number of the current phase, counted from 1.
        wait: Time until the participant may end the phase, in seconds.
    """

    person: PersonRow
    phase: Phase | None
    number: int
    visitor: Visitor
    wait: float


class Procedure:
    """A procedure that leads participants through the phases of a plan."""

    def __init__(
        self, plan: VisitPlan, store: Store, folders: VisitFolders, rng: np.random.Generator
    ) -> None:
        self.plan, self.store, self.folders = plan, store, folders
        self.phases = phases_of(plan)
        self.names = [phase.name for phase in self.phases]
        self._rng = rng
        self._refusals: dict[int, tuple[str, Again]] = {}  # last refusal and its phase, by participant

    async def now(self, person: PersonRow, path: str) -> PhaseState:
        """Return the current state of a visit. Record the time if the phase is shown for the first time."""
        if not person.active and person.status != "finished":
            return PhaseState(person, None, 0, Visitor({}, 0.0, 0, path), 0.0)
        if person.phase not in self.names:
            person = await self._leave_missing_phase(person)
        number = self.names.index(person.phase)
        passed, wait = await self.times(person)
        rows = await self.store.answers(person.id)
        answers = {row.item: row.value for row in rows if row.phase == person.phase}
        visitor = Visitor(answers, passed, answers.get(ATTEMPTS, 0), path, self._metrics(person))
        return PhaseState(person, self.phases[number], number + 1, visitor, wait)

    async def times(self, person: PersonRow) -> tuple[float, float]:
        """Return how long ago the current phase was first shown and how soon it may end, both in seconds."""
        shown = await self.store.show_phase(person.id, person.phase)
        passed = (utc_now() - shown.shown).total_seconds()
        minimum = self.plan.minimum.get(person.phase, 0.0)
        # If `passed` is negative, the clock has been set back. The participant may then continue immediately.
        return passed, max(0.0, minimum - passed) if passed >= 0.0 or minimum == float("inf") else 0.0

    async def submit(self, now: PhaseState, phase: str, sent: FormData) -> None:
        """Handle a submitted form. Ignore a form of an earlier page."""
        current = now.phase
        if current is None or phase != current.name or isinstance(current, TrialPhase):
            return
        if phase == self.names[-1]:
            return
        skipped = bool(sent.get("skip")) and phase in self.plan.optional
        if now.wait > 0.0 and not skipped:
            self._refusals[now.person.id] = phase, Again(self.plan.texts["common"]["too_early"])
            return
        read = Done({"skipped": True}) if skipped else current.read(now.visitor, sent)
        attempts = {ATTEMPTS: now.visitor.attempts + 1}
        if isinstance(read, Again):
            await self.save(now, phase, sent)
            if read.counts:
                await self.store.save_answers(now.person.id, phase, {**attempts, **read.kept})
            self._refusals[now.person.id] = phase, read
            return
        answers = {**read.answers, **(attempts if now.visitor.attempts else {})}
        if read.outcome == "next":
            await self._move_on(now.person, phase, answers)
        else:
            await self.store.finish_phase(now.person.id, phase, phase, answers, status=read.outcome)

    def refusal(self, now: PhaseState) -> Again | None:
        """Return the reason why the participant's last form was refused, or None. Each reason is returned only once."""
        phase, refused = self._refusals.pop(now.person.id, ("", None))
        return refused if now.phase is not None and phase == now.phase.name else None

    async def save(self, now: PhaseState, phase: str, sent: FormData) -> None:
        """Save the answers from a form that the participant is still filling in."""
        current = now.phase
        if current is None or phase != current.name or not hasattr(current, "drafts"):
            return
        if drafts := current.drafts(sent):
            await self.store.save_answers(now.person.id, phase, drafts)

    async def assign(self, person: PersonRow) -> Assignment | None:
        """Assign the participant to a cell if needed. Return the place, or None if all cells are full."""
        plan = self.plan
        return await self.store.assign(
            person.id, plan.cells, plan.assignment, self._rng, abandoned_after=self._away
        )

    async def begin_playing(self, person: PersonRow, place: Assignment) -> VisitFolder:
        """Create the participant's visit folder, which stores the settings of the trials."""
        played = [name for name in self.names if name in PLAYED]
        ended = await self._before_playing(person)
        trials = self.plan.trials(await self._after_earlier_visit(person, place))
        return await asyncio.to_thread(self.folders.create, person.token_hash, played, trials, ended)

    async def withdraw(self, person: PersonRow, *, delete: bool) -> None:
        await self.store.withdraw(person.id, delete=delete)
        if delete:
            await asyncio.to_thread(self.folders.remove, person.token_hash)

    async def room(self) -> int:
        """Return the number of free places minus the number of participants who still need one."""
        wanted = [cell.wanted for cell in self.plan.cells]
        return await self.store.room(wanted, self.names[0], self._away)

    async def turn_away(self, person: PersonRow) -> PersonRow:
        """End the visit of a participant because no place is free."""
        here = person.phase
        await self.store.finish_phase(person.id, here, here, {}, FULL, status="screened_out")
        return await self.store.person(person.id)

    async def record_trials(self, person: PersonRow) -> PersonRow:
        """Record all trials that the participant has completed, and return the updated participant."""
        while person.active and person.phase in PLAYED:
            folder = self.folders.find(person.token_hash)
            if folder is None or not folder.is_over(person.phase):
                break
            ended = (await asyncio.to_thread(folder.metrics, person.phase))["ended"]
            run = folder.run(person.phase).relative_to(self.folders.path.parent)
            await self.store.finish_trial(person.id, person.phase, run.as_posix(), ended)
            await self._move_on(person, person.phase, {}, ended)
            person = await self.store.person(person.id)
        return person

    async def recover(self, before: datetime.datetime | None = None) -> None:
        """Add completed trials that are missing from the database.

        Only check participants who have been inactive since `before`, if given. Those who have closed the debriefing
        page have done everything, so they finish. Log and skip damaged folders.
        """
        for person in await self.store.people():
            if before is None or person.seen < before:
                try:
                    person = await self.record_trials(person)
                    if before and person.active and [person.phase] == self.names[-2:-1] == [DEBRIEFING]:
                        await self._move_on(person, DEBRIEFING, {}, "timed out")
                except (RecordError, OSError, msgspec.DecodeError) as error:
                    LOG.error("person %d: %s", person.id, error)

    async def adopt(self) -> None:
        """Add the participants of existing visit folders to the database of `mjsim play`."""
        for name in await asyncio.to_thread(self.folders.names):
            try:
                folder = self.folders.find(name)
            except RecordError as error:
                LOG.error("%s", error)
                continue
            if folder is not None and await self.store.find(folder.path.name) is None:
                here = folder.stored.phase
                if here != FLYTHROUGH or here not in self.names:
                    here = next(name for name in self.names if name in folder.stored.trials)
                await self.store.arrive(self.plan.recruiter.platform, None, {}, folder.path.name, here)

    async def _leave_missing_phase(self, person: PersonRow) -> PersonRow:
        order = (*PHASES, RESULT)
        later = order[order.index(person.phase) + 1 :] if person.phase in order else ()
        following = next((name for name in later if name in self.names), None)
        if following is None:
            raise RecordError(f"person {person.id} is in the phase {person.phase}, which the plan lacks")
        status: Status | None = "finished" if following == self.names[-1] else None
        await self.store.finish_phase(person.id, person.phase, following, {}, status=status)
        return await self.store.person(person.id)

    @property
    def _away(self) -> datetime.timedelta:
        return datetime.timedelta(seconds=self.plan.limits.abandoned_after)

    def _metrics(self, person: PersonRow) -> Mapping[str, Any] | None:
        folder = self.folders.find(person.token_hash) if person.phase == RESULT else None
        return folder.metrics(TASK) if folder is not None and folder.is_over(TASK) else None

    async def _after_earlier_visit(self, person: PersonRow, place: Assignment) -> Assignment:
        """Return `place`, but with a new house seed if the participant has already completed a visit."""
        earlier = (await self.store.identity(person.id)).get(AFTER)
        folder = self.folders.find(earlier) if earlier else None
        if folder is None or not folder.is_over(TASK):
            return place
        return dataclasses.replace(place, house_seed=folder.settings(TASK)["house_seed"] + 1)

    async def _before_playing(self, person: PersonRow) -> list[Ended]:
        wanted = [name for name in (STORY, FLYTHROUGH) if name in self.names]
        found = {phase.name: phase for phase in await self.store.phases(person.id)} if wanted else {}
        shown = [found[name] for name in wanted if name in found]
        return [Ended(phase.name, phase.duration_s or 0.0) for phase in shown]

    async def _move_on(
        self, person: PersonRow, phase: str, answers: Answers, reason: str | None = None
    ) -> None:
        names = self.names
        following = names[names.index(phase) + 1]
        status: Status | None = "finished" if following == names[-1] else None
        await self.store.finish_phase(person.id, phase, following, answers, reason, status=status)


class BrowserPlayer:
    """A participant who completes the trials of a visit in a browser."""

    def __init__(self, procedure: Procedure, person: PersonRow) -> None:
        self.key = person.token_hash
        self._procedure, self._id = procedure, person.id

    async def trial(self) -> LiveTrial | None:
        procedure = self._procedure
        person = await procedure.record_trials(await procedure.store.person(self._id))
        folder = procedure.folders.find(person.token_hash)
        if folder is None or not person.active or person.phase not in PLAYED:
            return None
        _, wait = await procedure.times(person)
        phase = person.phase
        opening = Open(
            str(folder.journal(phase)),
            str(folder.run(phase)),
            dict(folder.settings(phase)),
            await asyncio.to_thread(folder.before, phase),
            floor_plan=procedure.plan.floor_plan and phase == TASK,
            language=procedure.plan.language,
            texts=dict(procedure.plan.texts["hud"].words),
            explains_markers=procedure.plan.explain_markers,
        )
        return LiveTrial(phase, time.monotonic() + wait, opening)

    async def over(self) -> None:
        await self._procedure.record_trials(await self._procedure.store.person(self._id))
