"""Simulated participants, who visit the pages of a study over HTTP and play trials over a WebSocket."""

import asyncio
import functools
import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import httpx
import numpy as np
from websockets.exceptions import WebSocketException

from experiments.house import House
from experiments.record.phases import FLYTHROUGH
from experiments.study.rehearsal.link import Link, LostError, connected
from experiments.study.rehearsal.plan import Planned, moment
from experiments.study.rehearsal.player import SimulatedPlayer
from experiments.visit.phases import phases_of
from experiments.visit.phases.base import FormPhase, Phase
from experiments.visit.plan import COMPREHENSION, VisitPlan
from experiments.visit.texts.items import Item

SHOWN = re.compile(r'name="phase" value="([^"]+)"|data-trial="(\w+)"')
READING = 15.0  # mean time to read a page, in seconds of study time
AWAY = 600.0  # longest absence of a returning participant, in seconds of study time
DELAY = 0.2  # delay of the first inputs on a slow connection, in seconds
CUTS = 3  # number of times that a bad connection is interrupted during a trial
TRIES = 20  # maximum number of attempts to connect to a trial or to submit a form
QUEUE = "queue"  # name of the queue page
REFUSED = "-refused"  # end of the name of a page that refuses a form
QUEUED = 'http-equiv="refresh"'  # text that identifies the queue page
QUEUE_PAUSE = 3.0  # time between two requests for the queue page, in seconds
PAUSE = 0.5  # delay before reconnecting to a trial, in seconds


@dataclass
class Rehearsed:
    """The progress and the outcome of a simulated participant's visit.

    Attributes:
        link: Path of the participant's personal link, or empty before the visit starts.
        outcome: `finished`, `stuck`, or the way in which the participant left. Empty during the visit.
        answers: Accepted forms, by phase.
    """

    number: int
    link: str = ""
    outcome: str = ""
    answers: dict[str, Any] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    refused: int = 0


Watch = Callable[[str, httpx.Response], Awaitable[None]]


async def _ignore(name: str, page: httpx.Response) -> None:
    pass


@dataclass(frozen=True)
class Surroundings:
    """The study, server and time scale of a rehearsal, which all simulated participants share."""

    base: str
    client: httpx.AsyncClient
    plan: VisitPlan
    home: Callable[[str], House]  # loads the house of the participant with a link
    parameters: Mapping[str, str]  # query parameters of the platform's links, with empty ids
    factor: float  # factor by which waiting times are divided
    hasty: bool = False  # True to submit each form too early once, which the server must refuse
    watch: Watch = _ignore  # called with the name of each page and the server's response

    @functools.cached_property
    def phases(self) -> dict[str, Phase]:
        return {phase.name: phase for phase in phases_of(self.plan)}

    def ids(self, number: int) -> dict[str, str]:
        """Return the query parameters in the link of a participant."""
        return {name: value or f"rehearsal{number:06d}" for name, value in self.parameters.items()}


class SimulatedPerson:
    """A simulated participant who goes through a study as planned in advance."""

    def __init__(self, planned: Planned, around: Surroundings, rehearsed: Rehearsed) -> None:
        self._planned, self._around, self.rehearsed = planned, around, rehearsed
        self._rng = np.random.default_rng(planned.seed)
        self._reloaded = self._returned = False
        number = planned.number
        self._headers = {"Origin": around.base, "X-Forwarded-For": f"10.0.{number // 250}.{number % 250 + 1}"}

    async def begin(self) -> None:
        """Start a visit and store its link. If the participant starts twice, both links must be the same."""
        ids = self._around.ids(self._planned.number)
        await self._around.watch("welcome", await self._get("/", ids))
        for _ in range(2 if ids and self._planned.twice else 1):
            answer = await self._post("/begin", ids)
            if not (link := answer.headers.get("location", "")).startswith("/play/"):
                self._fault(f"no link at the beginning: {answer.status_code}")
            elif self.rehearsed.link not in ("", link):
                self._fault("the same person got two links")
            self.rehearsed.link = link

    async def go(self) -> None:
        """Continue the visit until it ends, and store the outcome."""
        self.rehearsed.outcome = await self._go()

    async def _go(self) -> str:
        planned, tries, before = self._planned, 0, ""
        while tries < TRIES:
            page = await self._get(self.rehearsed.link)
            if QUEUED in page.text:
                await self._around.watch(QUEUE, page)
                await asyncio.sleep(QUEUE_PAUSE)
                continue
            found = SHOWN.search(page.text)
            if found is None:
                return self._ended(page)
            name = found[1] or found[2]
            if self._around.hasty and name != before and not found[2]:
                await self._send_early(self._around.phases[name])
            await self._around.watch(name, page)
            tries, before = (tries + 1 if name == before else 0), name
            leaves = planned.leaves if planned.leaves_in == name else None
            phase = self._around.phases[name]
            if found[2]:
                if not await self._play(name, bool(leaves)):
                    return await self._leave(str(leaves))
                continue
            if planned.returns_in == name and not self._returned:
                self._returned = True
                await self._away()
                continue
            if planned.reloads_in == name and not self._reloaded:
                self._reloaded = True
                continue
            if leaves in ("vanishes", "withdraws", "withdraws and deletes"):
                return await self._leave(leaves)
            await self._fill(phase, leaves, tries)
        self._fault(f"gets no further than {before}")
        return "stuck"

    async def _send_early(self, phase: Phase) -> None:
        if self._around.plan.minimum.get(phase.name, 0.0) > 0.0:
            await self._post(self.rehearsed.link, form_of(phase, self._rng))
            if not _shows(await self._get(self.rehearsed.link), phase):
                self._fault(f"{phase.name} ends before its minimum time")

    def _ended(self, page: httpx.Response) -> str:
        if page.status_code != httpx.codes.OK:
            self._fault(f"the page says {page.status_code}")
            return "stuck"
        how = self._planned.leaves
        # A participant who was to leave during a trial stays to the end of the visit if the trial ends first.
        return how if how in ("refuses", "fails", "gives up") else "finished"

    async def _fill(self, phase: Phase, leaves: str | None, tries: int) -> None:
        rng, link, factor = self._rng, self.rehearsed.link, self._around.factor
        await asyncio.sleep(float(rng.exponential(READING)) / factor)
        form = form_of(phase, rng)
        if phase.name == FLYTHROUGH:
            await self._get(f"{link}/film")
        if isinstance(phase, FormPhase) and phase.items:
            await self._post(f"{link}/answers", form)
        plan, careless = self._around.plan, self._planned.wrong and not tries
        await asyncio.sleep(plan.minimum.get(phase.name, 0.0))
        careless &= phase.name != COMPREHENSION or plan.limits.attempts != 1
        wrong = wrong_form(phase, form)
        if wrong is not None and (leaves == "fails" or careless):
            await self._post(link, wrong)
            shown = await self._get(link)
            if leaves != "fails" and not _shows(shown, phase):
                self._fault(f"{phase.name} accepts a form that it should refuse")
            await self._around.watch(f"{phase.name}{REFUSED}", shown)
            return
        if leaves == "refuses":
            form = {"phase": phase.name, "agree": "no"}
        elif leaves == "gives up":
            form = {**form, "latency_ms": "999999", "give_up": "yes"}
        sent = [self._post(link, form) for _ in range(2 if self._planned.twice else 1)]
        await asyncio.gather(*sent)
        if not _shows(await self._get(link), phase):
            self.rehearsed.answers[phase.name] = form
        elif tries:
            self._fault(f"the form of {phase.name} was not accepted")

    async def _leave(self, how: str) -> str:
        if how != "vanishes":
            link = f"{self.rehearsed.link}/withdrawal"
            await self._around.watch("withdrawal", await self._get(link))
            data = "delete" if how == "withdraws and deletes" else "keep"
            answer = await self._post(link, {"data": data})
            if answer.status_code != httpx.codes.SEE_OTHER:
                self._fault(f"withdrawing was answered with {answer.status_code}")
        return how

    async def _play(self, trial: str, leaves: bool) -> bool:
        planned, rng = self._planned, self._rng
        breaks = [(moment(trial, rng), "cut") for _ in range(CUTS * planned.bad)]
        breaks += [(moment(trial, rng), "second page")] * planned.twice
        breaks += [(moment(trial, rng), "reload")] * (planned.reloads_in == trial and not self._reloaded)
        breaks += [(moment(trial, rng), "return")] * (planned.returns_in == trial and not self._returned)
        breaks += [(moment(trial, rng), "leave")] * leaves
        self._reloaded |= planned.reloads_in == trial
        self._returned |= planned.returns_in == trial
        player, tab, done = await self._player(), f"rehearsal-{rng.integers(10**9)}", 0
        for _ in range(TRIES + len(breaks)):
            player.state = None
            at, what = min(breaks, default=(10**9, ""))
            try:
                async with connected(self._around.base, self.rehearsed.link, trial, tab, player) as link:
                    saved = await link.play(at - done, DELAY * planned.bad)
                    done += link.decisions
                    self.rehearsed.refused += len(link.refused)
                    if saved:
                        return True
                    breaks.remove((at, what))
                    if what == "leave":
                        return False
                    tab = await self._break(link, what, trial, tab)
            except (LostError, OSError, WebSocketException, TimeoutError):
                await asyncio.sleep(PAUSE)
            if what == "return" and (at, what) not in breaks:
                await self._away()
            page = await self._get(self.rehearsed.link)
            found = SHOWN.search(page.text)
            if found is None or found[2] != trial:
                return True
        self._fault(f"the {trial} does not continue")
        return True

    async def _break(self, link: Link, what: str, trial: str, tab: str) -> str:
        if what == "cut":
            link.cut()
            return tab
        if what == "second page":
            idle, page = await self._player(), f"second-{tab}"
            async with connected(self._around.base, self.rehearsed.link, trial, page, idle) as second:
                await second.occupied()
            return tab
        return f"rehearsal-{self._rng.integers(10**9)}"

    async def _player(self) -> SimulatedPlayer:
        return SimulatedPlayer(await asyncio.to_thread(self._around.home, self.rehearsed.link), self._rng)

    async def _away(self) -> None:
        await asyncio.sleep(float(self._rng.uniform(0.0, AWAY)) / self._around.factor)

    async def _get(self, path: str, query: Mapping[str, str] | None = None) -> httpx.Response:
        return await self._answered("GET", path, params=query)

    async def _post(self, path: str, data: Mapping[str, Any]) -> httpx.Response:
        return await self._answered("POST", path, data=data)

    async def _answered(self, method: str, path: str, **more: Any) -> httpx.Response:
        try:
            answer = await self._around.client.request(method, path, headers=self._headers, **more)
        except httpx.TransportError as error:  # try again, like a participant who reloads the page
            self._fault(f"{method} of a page was not answered: {type(error).__name__}")
            answer = await self._around.client.request(method, path, headers=self._headers, **more)
        if answer.is_server_error:
            self._fault(f"{method} of a page was answered with {answer.status_code}")
        return answer

    def _fault(self, what: str) -> None:
        self.rehearsed.faults.append(what)


MARK = "Rehearsal: drawn at random"


def form_of(phase: Phase, rng: np.random.Generator) -> dict[str, Any]:
    """Return random answers that the phase accepts, or an empty form if the phase has no items."""
    example: dict[str, Any] = getattr(phase, "example", dict)()
    items = phase.items if isinstance(phase, FormPhase) else ()
    points = len(phase.texts.scale) if isinstance(phase, FormPhase) else 0
    drawn = {item.name: _drawn(item, points, rng) for item in items if item.required or rng.random() < 0.5}
    return {"phase": phase.name, **example, **drawn}


def wrong_form(phase: Phase, form: dict[str, Any]) -> dict[str, Any] | None:
    """Return a form that the phase must refuse, or None if every form is valid.

    If a question has a right answer, the form contains a wrong answer. Otherwise, all answers are missing.
    """
    example: dict[str, Any] = getattr(phase, "example", dict)()
    for item in phase.items if isinstance(phase, FormPhase) else ():
        if item.right is not None and (others := [c for c in item.choices if c != item.right]):
            return {**form, item.name: others[0]}
    return {"phase": phase.name} if example else None


def _drawn(item: Item, points: int, rng: np.random.Generator) -> Any:
    if item.right is not None:
        return str(item.right)
    match item.kind:
        case "scale":
            return str(rng.integers(1, points + 1))
        case "choice":
            return str(rng.choice(item.choices))
        case "several":
            return [choice for choice in item.choices if rng.random() < 0.5] or [item.choices[0]]
        case "number":
            return str(rng.integers(item.low, min(item.high, item.low + 60) + 1))
    return f"{MARK} ({rng.integers(10**6)})"


def _shows(page: httpx.Response, phase: Phase) -> bool:
    found = SHOWN.search(page.text)
    return found is not None and phase.name in found.groups()
