"""Run a short rehearsal with one simulated participant for each way in which a visit can end."""

import asyncio
import datetime
import re
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import AbstractContextManager, asynccontextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlencode

import httpx
import msgspec
import numpy as np
import uvicorn

from experiments.analysis.study.table import ANALYSIS
from experiments.record.phases import TASK
from experiments.study.data.analyses import analysis_faults
from experiments.study.data.collect import collect, write_collected
from experiments.study.file import Cell, Study
from experiments.study.plan import plan_of
from experiments.study.rehearsal.person import QUEUE, REFUSED, Rehearsed, SimulatedPerson, Surroundings
from experiments.study.rehearsal.pictures import HELP
from experiments.study.rehearsal.plan import Leaving, Planned, link_parameters, rehearsed
from experiments.study.rehearsal.player import homes_in
from experiments.study.rehearsal.report import STATUS, TABLE
from experiments.visit.folders import VISITS, VisitFolders
from experiments.visit.phases.base import FormPhase
from experiments.visit.plan import COMPREHENSION, CONSENT, DEVICE
from experiments.visit.procedure import Procedure
from experiments.visit.recruiter import Recruiter
from experiments.visit.server.app import ServerOptions, VisitServer
from experiments.visit.store import Store, StudyState, utc_now
from experiments.visit.tokens import token_hash
from experiments.web.server.limit import SessionLimit
from experiments.web.server.pool import WorkerPool

MINIMUM_S = 1.0  # minimum durations of phases are at most this long in a dry run, in seconds
TASK_S = 1.0
PLACES = 10  # factor by which the trials of a cell are repeated so that no participant is turned away
FACTOR = 1e6  # factor by which reading times are divided
MARKERS = 900  # number of the first participant for a picture of the markers
LATE = 999  # number of a participant who times out
TIMEOUT_S = 400.0  # HTTP timeout in seconds, long enough for the compilation during the first request
_UNREAD = re.compile(r"<(head|script|noscript)\b.*?</\1>|<[^>]*>", re.DOTALL)  # parts without visible words

# A function that is given the name and URL of a page, and its content if the URL alone does not show it
Photograph = Callable[[str, str, str], Awaitable[None]]
OTHER = "another visit"  # name under which the slot of the first trial is held, so that the queue is shown


@dataclass
class Walked:
    """The faults that were found in a dry run, and the number of words on each page."""

    faults: list[str] = field(default_factory=list)
    words: dict[str, int] = field(default_factory=dict)


async def dry_run(
    study: Study, platform: Recruiter, folder: Path, pool: WorkerPool, photograph: Photograph
) -> Walked:
    """Send simulated participants through a study. One of them finishes it, and the others leave early.

    Every phase must refuse incorrect and early forms, and must accept a correct form only once. Minimum
    durations and the task are limited to one second.
    """
    study = rehearsed(_shortened(study), 1.0)
    store = await Store.open(f"sqlite:///{folder / 'study.db'}", study.settings.name, study.sha256)
    folders, rng = VisitFolders(folder / VISITS), np.random.default_rng(0)
    procedure = Procedure(plan_of(study, platform=platform), store, folders, rng)
    server = VisitServer(procedure, pool, ServerOptions(b"dry run", workers=1))
    server.sessions.limit.hold(OTHER)
    async with (
        _serving(server.app("127.0.0.1")) as base,
        httpx.AsyncClient(base_url=base, timeout=TIMEOUT_S) as client,
    ):
        around = Surroundings(
            base,
            client,
            procedure.plan,
            homes_in(folders),
            link_parameters(study, platform),
            FACTOR,
            hasty=True,
        )
        walk = _Walk(procedure, around, photograph, server.sessions.limit)
        for planned in _ways(procedure):
            await walk.send(planned)
        if study.settings.explain_markers:
            await walk.show_markers([cell.trials[0].assistance for cell in study.cells])
        await walk.show_refusals()
        found = await collect(study, store, folder)
        walk.walked.faults += [
            f"the run that was recorded cannot be used: {why}" for why in found.unusable.values()
        ]
        if found.rows:
            write_collected(found, folder / TABLE)
            walk.walked.faults += analysis_faults(study, folder / TABLE, folder / ANALYSIS, shortened=True)
        return walk.walked


def _shortened(study: Study) -> Study:
    settings = study.settings
    cells = [
        Cell([msgspec.structs.replace(trial, time_limit=TASK_S) for trial in c.trials] * PLACES)
        for c in study.cells
    ]
    minimum = {name: min(seconds, MINIMUM_S) for name, seconds in settings.minimum.items()}
    return replace(study, cells=cells, settings=msgspec.structs.replace(settings, minimum=minimum))


def _ways(procedure: Procedure) -> Iterator[Planned]:
    ways: list[tuple[Leaving | None, str]] = [(None, "")]
    ways += [("refuses", CONSENT), ("gives up", DEVICE)]
    check = next((phase for phase in procedure.phases if phase.name == COMPREHENSION), None)
    if isinstance(check, FormPhase) and any(item.right is not None for item in check.items):
        ways.append(("fails", COMPREHENSION))
    ways.append(("withdraws and deletes", procedure.names[0]))
    for number, (leaves, phase) in enumerate(ways):
        if not phase or phase in procedure.names:
            careless = leaves is None
            yield Planned(number, number, 0.0, leaves, phase, None, None, False, careless, careless)


class _Walk:
    def __init__(
        self, procedure: Procedure, around: Surroundings, photograph: Photograph, limit: SessionLimit
    ) -> None:
        self._procedure, self._around, self._photograph, self._limit = procedure, around, photograph, limit
        self.walked = Walked()

    async def send(self, planned: Planned) -> None:
        shown: list[str] = []

        async def watch(name: str, page: httpx.Response) -> None:
            if planned.leaves is None and name not in shown:
                shown.append(name)
                words = _UNREAD.sub(" ", page.text).split()
                self.walked.words[name] = len(words) if "data-trial" not in page.text else 0
                await self._photograph(name, str(page.url), page.text if name.endswith(REFUSED) else "")
                if name == TASK:
                    await self._photograph(HELP, str(page.url), "")
                if name == QUEUE:
                    self._limit.release(OTHER)
            elif name == "withdrawal":
                await self._photograph(name, str(page.url), "")

        gone = Rehearsed(planned.number)
        person = SimulatedPerson(planned, replace(self._around, watch=watch), gone)
        try:
            await person.begin()
            await person.go()
            await self._check_end(planned, gone)
        except (httpx.HTTPError, OSError) as error:
            gone.faults.append(f"the server did not answer ({type(error).__name__}: {error})")
        self.walked.faults += [fault for fault in gone.faults if fault not in self.walked.faults]

    async def _check_end(self, planned: Planned, gone: Rehearsed) -> None:
        person = await self._procedure.store.find(token_hash(gone.link.rpartition("/")[2]))
        if person is None:
            gone.faults.append("a participant who began is not in the database")
            return
        wanted = STATUS[planned.leaves or "finished"]
        if person.status != wanted:
            gone.faults.append(
                f"a participant should be {wanted.replace('_', ' ')} in {person.phase}, but is {person.status}"
            )
            return
        page = await self._around.client.get(gone.link)
        code = self._procedure.plan.recruiter.way_back(wanted, {}).code
        if page.status_code != httpx.codes.OK or (code and code not in page.text):
            gone.faults.append(f"the last page of a participant who is {wanted} lacks the code {code}")
        in_a_phase = planned.leaves_in and wanted != "withdrawn"
        await self._photograph(f"{planned.leaves_in}-{wanted}" if in_a_phase else wanted, str(page.url), "")

    async def show_markers(self, conditions: Sequence[str]) -> None:
        """Take a picture of the task's instructions in each condition. `conditions` has the condition of each cell."""
        store, plan, around = self._procedure.store, self._procedure.plan, self._around
        for number, name in enumerate(dict.fromkeys(conditions), MARKERS):
            one = Rehearsed(number)
            planned = replace(next(_ways(self._procedure)), number=number)
            await SimulatedPerson(planned, around, one).begin()
            person = await store.find(token_hash(one.link.rpartition("/")[2]))
            if person is None:
                self.walked.faults.append("a participant who began is not in the database")
                continue
            quotas = zip(plan.cells, conditions, strict=True)
            cells = [replace(quota, wanted=PLACES * (condition == name)) for quota, condition in quotas]
            await store.assign(person.id, cells, plan.assignment, np.random.default_rng(0))
            await store.finish_phase(person.id, person.phase, TASK, {})
            await self._photograph(f"{TASK}-{name}", f"{around.base}{one.link}", "")
            origin = {"Origin": around.base}
            await around.client.post(f"{one.link}/withdrawal", data={"data": "delete"}, headers=origin)

    async def show_refusals(self) -> None:
        """Take pictures of the pages for participants who return elsewhere, time out, or are not admitted."""
        store, recruiter = self._procedure.store, self._procedure.plan.recruiter
        around, person = self._around, Rehearsed(LATE)
        ids = around.ids(LATE)
        await SimulatedPerson(replace(next(_ways(self._procedure)), number=LATE), around, person).begin()
        changed = [ids, *({**ids, name: "elsewhere"} for name in ids)]
        key, *others = (getattr(recruiter.arrive(one), "key", None) for one in changed)
        if key is not None and key in others:  # the same participant with another submission
            query = urlencode(changed[others.index(key) + 1])
            await self._photograph("returning", f"{around.base}/?{query}", "")
        await store.time_out(utc_now() + datetime.timedelta(days=1))
        await self._photograph("timed_out", f"{around.base}{person.link}", "")
        ids = around.ids(LATE + 1)
        for name, state in (("paused", "paused"), ("full", "closed")):
            await store.set_state(cast(StudyState, state), "check")
            await self._photograph(name, f"{around.base}/?{urlencode(ids)}", "")


class _Server(uvicorn.Server):
    """A Uvicorn server that does not handle signals, because the command does."""

    def capture_signals(self) -> AbstractContextManager[None]:  # type: ignore[override]
        return nullcontext()


@asynccontextmanager
async def _serving(app: Any) -> AsyncIterator[str]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        config = uvicorn.Config(
            app, log_config=None, access_log=False, log_level="error", ws="websockets-sansio",
            timeout_graceful_shutdown=3,
        )  # fmt: skip
        server = _Server(config)
        task = asyncio.create_task(server.serve(sockets=[listener]))
        try:
            while not server.started and not task.done():
                await asyncio.sleep(0.01)
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            await task
