"""A dry run: the study is served in a folder that is thrown away, and people who are made up go through it by HTTP."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import httpx
import msgspec
import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from experiments.record.phases import TRAINING
from experiments.study.data.collect import collect
from experiments.study.file import Cell, Study
from experiments.study.plan import plan_of
from experiments.study.rehearsal.reading import words_of
from experiments.study.rehearsal.server import serving
from experiments.visit.folders import VISITS, VisitFolders
from experiments.visit.phases.base import Comprehension, Phase
from experiments.visit.phases.played import Played
from experiments.visit.plan import COMPREHENSION, CONSENT, DEVICE
from experiments.visit.procedure import Procedure
from experiments.visit.recruiter import Leaving, Recruiter
from experiments.visit.server.app import ServerOptions, VisitServer
from experiments.visit.store import Person, Store
from experiments.visit.tokens import token_hash
from experiments.web.server.pool import WorkerPool

MINIMUM = 1.0  # s; the longest that the dry run waits in a phase
TASK_TIME = 1.0  # s that the task lasts
PLACES = 10  # in place of each one, so that there is one for everybody who is made up
PATIENCE = 400.0  # s for a trial or an answer, the compiling of kernels on a loaded machine included
STUDY_IDS = ("STUDY_ID", "projectId", "hitId")  # as platforms call it

Photograph = Callable[[str, str], Awaitable[None]]  # takes a name and a URL


@dataclass
class Walked:
    """What the dry run found.

    Attributes:
        faults: What does not work.
        words: How many words the page of a phase has.
    """

    faults: list[str] = field(default_factory=list)
    words: dict[str, int] = field(default_factory=dict)


async def dry_run(
    study: Study, platform: Recruiter, folder: Path, pool: WorkerPool, photograph: Photograph
) -> Walked:
    """Let made-up people go through a study: one to the end, the others out of it on each way that there is.

    Every phase has to refuse what is wrong or too early and to take what is right once. Minimum times are at most a
    second here, the training is left at once, and the task ends after a second.
    """
    study = _shortened(study)
    store = await Store.open(f"sqlite:///{folder / 'study.db'}", study.settings.name, study.sha256)
    folders, rng = VisitFolders(folder / VISITS), np.random.default_rng(0)
    procedure = Procedure(plan_of(study, platform=platform), store, folders, rng)
    app = VisitServer(procedure, pool, ServerOptions(b"dry run", workers=1)).app("127.0.0.1")
    async with serving(app) as base:
        headers = {"Origin": base}
        async with httpx.AsyncClient(base_url=base, headers=headers, timeout=PATIENCE) as client:
            return await _DryRun(study, procedure, folder, client, photograph).walk()


def _shortened(study: Study) -> Study:
    settings = study.settings
    cells = [
        Cell([msgspec.structs.replace(trial, time_limit=TASK_TIME) for trial in c.trials] * PLACES)
        for c in study.cells
    ]
    minimum = {name: min(seconds, MINIMUM) for name, seconds in settings.minimum.items()}
    optional = (*settings.optional, *(n for n in (TRAINING,) if n in settings.phases))
    settings = msgspec.structs.replace(settings, minimum=minimum, optional=tuple(dict.fromkeys(optional)))
    return replace(study, cells=cells, settings=settings)


class _StuckError(Exception):
    """Somebody cannot go on; the fault is noted."""


class _DryRun:
    def __init__(
        self,
        study: Study,
        procedure: Procedure,
        folder: Path,
        client: httpx.AsyncClient,
        photograph: Photograph,
    ) -> None:
        self._study, self._procedure, self._folder = study, procedure, folder
        self._recruiter, self._store, self._client = procedure.plan.recruiter, procedure.store, client
        self._photograph = photograph
        self._people = 0
        self._walked = Walked()

    async def walk(self) -> Walked:
        names = [phase.name for phase in self._procedure.phases]
        await self._try(self._to_the_end)
        if CONSENT in names:
            refuses = {"agree": "no"}
            await self._try(self._ends, CONSENT, refuses, 1, "no_consent")
        if DEVICE in names:
            device = self._phase(DEVICE)
            slow = {**_example(device), "latency_ms": "999999", "give_up": "yes"}
            await self._try(self._ends, DEVICE, slow, 1, "screened_out")
        if wrong := self._wrong(COMPREHENSION):
            attempts = self._study.settings.limits.attempts
            await self._try(self._ends, COMPREHENSION, wrong, attempts, "screened_out")
        await self._try(self._withdraws)
        return self._walked

    async def _try(self, way: Callable[..., Awaitable[None]], *arguments: Any) -> None:
        try:
            await way(*arguments)
        except _StuckError:
            pass
        except (httpx.HTTPError, OSError) as error:
            self._fault(f"the server did not answer ({type(error).__name__}: {error})")

    async def _to_the_end(self) -> None:
        link = await self._arrive(shown=True)
        for phase in self._procedure.phases[:-1]:
            page = await self._page(link, phase.name)
            self._walked.words[phase.name] = 0 if isinstance(phase, Played) else words_of(page)
            await self._check_minimum(link, phase)
            await self._photograph(phase.name, self._url(link))
            if isinstance(phase, Played):
                await self._play(link, phase.name)
            else:
                await self._check_form(link, phase)
        await self._check_end(link, "finished")
        found = await collect(self._study, self._store, self._folder)
        for why in found.unusable.values():
            self._fault(f"the run that was recorded cannot be used: {why}")

    async def _check_minimum(self, link: str, phase: Phase) -> None:
        if isinstance(phase, Played) or phase.name not in self._study.settings.minimum:
            return
        await self._send(link, phase.name, _example(phase))
        if not await self._is_in(link, phase.name):
            self._fault(f"{phase.name} ends before its minimum time")
        await asyncio.sleep(self._study.settings.minimum[phase.name])

    async def _check_form(self, link: str, phase: Phase) -> None:
        """What is wrong is refused, what is right is taken once."""
        name, right = phase.name, _example(phase)
        last = name == COMPREHENSION and self._study.settings.limits.attempts == 1
        wrong = self._wrong(name)
        if wrong is not None and not last:
            answer = await self._send(link, name, wrong)
            if answer.status_code != 200 or not await self._is_in(link, name):
                self._fault(f"{name} takes a form that it should refuse")
        for _ in range(2):  # a double click changes nothing
            await self._send(link, name, right)
        names = [phase.name for phase in self._procedure.phases]
        await self._page(link, names[names.index(name) + 1])

    async def _ends(self, name: str, sent: Mapping[str, str], times: int, status: Leaving) -> None:
        """Somebody leaves the study in a phase by sending something."""
        link = await self._arrive()
        for phase in self._procedure.phases:
            await self._client.get(link)  # the time of a phase begins when it is shown
            await asyncio.sleep(self._study.settings.minimum.get(phase.name, 0.0))
            if phase.name == name:
                break
            if isinstance(phase, Played):
                await self._play(link, phase.name)
            await self._send(link, phase.name, _example(phase))
        await self._page(link, name)
        for _ in range(times):
            await self._send(link, name, sent)
        await self._check_end(link, status, f"{name}-{status}")

    async def _withdraws(self) -> None:
        link = await self._arrive()
        await self._photograph("withdrawal", f"{self._url(link)}/withdrawal")
        await self._client.post(f"{link}/withdrawal", data={"data": "delete"})
        await self._check_end(link, "withdrawn")

    async def _check_end(self, link: str, status: Leaving, name: str = "") -> None:
        code = self._recruiter.way_back(status, {}).code
        page = await self._client.get(link)
        person = await self._person(link)
        if person.status != status:
            self._fault(
                f"somebody should be {status.replace('_', ' ')} in {person.phase}, and is {person.status}"
            )
        elif page.status_code != 200 or (code and code not in page.text):
            self._fault(f"the last page of who is {status.replace('_', ' ')} lacks the code {code}")
        await self._photograph(name or status, self._url(link))

    async def _arrive(self, shown: bool = False) -> str:
        """Begin as a new person; the path of that person's pages."""
        self._people += 1
        settings = self._study.settings.recruitment
        own = {**dict.fromkeys(STUDY_IDS, settings.study_id), "turkSubmitTo": next(iter(settings.sites), "")}
        some = f"dryrun{self._people:018d}"
        query = {name: own.get(name) or some for name in self._recruiter.parameters}
        first = await self._client.get("/", params=query)
        if shown:
            self._walked.words["welcome"] = words_of(first.text)
            await self._photograph("welcome", str(first.url))
        answer = await self._client.post("/begin", data=query)
        if first.status_code != 200 or answer.status_code != 303:
            self._fault(f"nobody can begin: the server answers {first.status_code} and {answer.status_code}")
            raise _StuckError
        return answer.headers["location"]

    async def _page(self, link: str, phase: str) -> str:
        """The page of a phase, in which the person has to be."""
        answer = await self._client.get(link)
        person = await self._person(link)
        if answer.status_code != 200:
            self._fault(f"the page of {phase} answers {answer.status_code}")
            raise _StuckError
        if person.phase != phase:
            self._fault(f"{person.phase} does not take {_example(self._phase(person.phase))}, which is right")
            raise _StuckError
        return answer.text

    async def _send(self, link: str, phase: str, form: Mapping[str, str]) -> httpx.Response:
        return await self._client.post(link, data={"phase": phase, **form})

    async def _play(self, link: str, trial: str) -> None:
        """Play a trial for a moment, as a page does."""
        try:
            async with asyncio.timeout(PATIENCE):
                await self._play_in(self._url(link).replace("http", "ws", 1), trial)
        except (TimeoutError, WebSocketException) as error:
            self._fault(f"{trial} cannot be played: {str(error) or 'it did not end in time'}")
            raise _StuckError from error
        await self._client.get(link)

    async def _play_in(self, address: str, trial: str) -> None:
        view = {"type": "view", "width": 640, "height": 480, "codec": "none"}
        begin: dict[str, Any] = {"type": "hello", "tab": "dryrun-0001", "trial": trial, "view": view}
        base: Any = str(self._client.base_url).rstrip("/")
        async with connect(address, origin=base, max_size=None) as socket:
            await socket.send(msgspec.json.encode(begin).decode())
            async for text in socket:
                message = msgspec.json.decode(text) if isinstance(text, str) else {"type": "frame"}
                match message:
                    case {"type": "occupied"}:  # by the page whose picture was taken
                        await socket.send('{"type":"takeover"}')
                    case {"type": "state", "phase": "ready" | "paused"}:
                        await socket.send('{"type":"run"}')
                    case {"type": "state", "phase": "running"} if trial == TRAINING:
                        await socket.send('{"type":"leave"}')
                    case {"type": "saved"}:
                        return
                    case {"type": "error", "message": reason}:
                        raise WebSocketException(reason)
        raise WebSocketException("the connection was closed")

    def _wrong(self, name: str) -> dict[str, str] | None:
        """What a phase has to refuse; None where nothing can be wrong."""
        phase = next((phase for phase in self._procedure.phases if phase.name == name), None)
        if phase is None or not (right := _example(phase)):
            return None
        if not isinstance(phase, Comprehension):
            return {}
        asked = next((item for item in phase.items if item.right is not None), None)
        if asked is None:
            return None
        others = [choice for choice in asked.choices if choice != asked.right]
        return {**right, asked.name: others[0] if others else ""}

    def _phase(self, name: str) -> Phase:
        return next(phase for phase in self._procedure.phases if phase.name == name)

    def _url(self, link: str) -> str:
        return str(self._client.base_url).rstrip("/") + link

    async def _is_in(self, link: str, phase: str) -> bool:
        person = await self._person(link)
        return person.active and person.phase == phase

    async def _person(self, link: str) -> Person:
        person = await self._store.find(token_hash(link.rpartition("/")[2]))
        if person is None:
            self._fault("a person who began is not known")
            raise _StuckError
        return person

    def _fault(self, text: str) -> None:
        if text not in self._walked.faults:
            self._walked.faults.append(text)


def _example(phase: Phase) -> dict[str, str]:
    """A form that the phase takes; of somebody's own phase an empty one, unless it has an `example()`."""
    made: dict[str, str] = getattr(phase, "example", dict)()
    return made
