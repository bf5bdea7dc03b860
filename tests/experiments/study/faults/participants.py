"""People who answer, play and leave while things go wrong; each knows what was acknowledged."""

import asyncio
import json
import time
from contextlib import suppress

import numpy as np
from websockets.exceptions import WebSocketException

from benchmarks.support.play_browser import SimulatedBrowser
from benchmarks.support.play_server import PATIENCE
from experiments.record.journal import JournalEntry, read_entries
from experiments.record.phases import TASK
from experiments.visit.tokens import token_hash
from tests.experiments.study.faults.site import NAMES, QUESTIONS, RIGHT

PAUSE = 0.1  # s between two tries of a form that is not taken
PLAYING_S = 120.0  # for a connection and some inputs, which a loaded machine can delay
MAX_ROWS = 100
CUT = 0.1  # share of answers whose connection is cut
LOST = (OSError, EOFError, WebSocketException)  # what a connection ends with
RIGHT_ANSWERS = dict.fromkeys(QUESTIONS, RIGHT)


class Person:
    """Somebody who takes part, perhaps sending all forms twice at the same moment, to both hosts.

    Attributes:
        link: Path of the person's pages.
        left: Whether it was acknowledged that the person left.
    """

    def __init__(self, site, number, seed, *, twice=False):
        self.site, self.number, self.rng = site, number, np.random.default_rng([seed, number])
        self._ids = site.platform.add(number)
        self._twice = twice
        self.link, self.left = "", False

    @property
    def name(self):
        """Of the visit."""
        return token_hash(self.link.rsplit("/", 1)[1])

    async def begin(self):
        """Come, and consent."""
        links = {answer.headers["location"] for answer in await self._until_taken("/begin", self._ids)}
        assert len(links) == 1, "one person has two links"
        self.link = links.pop()
        await self._until_taken(self.link, {"phase": "consent", "agree": "yes"})

    async def understand(self):
        """Send the right answers."""
        await self._until_taken(self.link, {"phase": "comprehension", **RIGHT_ANSWERS})

    async def leave(self):
        """Withdraw from the task, for which a share is paid."""
        await self._until_taken(f"{self.link}/withdrawal", {"data": "keep"}, once=True)
        self.left = True

    async def go_through(self):
        """All of it."""
        await self.begin()
        await self.understand()
        await self.leave()

    async def ask(self, path="", form=None, host=None):
        """The answer to a request, and the host that answered."""
        return await self.site.ask(self.link + path, form, self.number, self.rng, host)

    async def _until_taken(self, path, form, *, once=False):
        """Send a form until it is taken; `once` is for one that has no page any more then."""
        hosts = NAMES if self._twice else (None,)
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            asked = (self.site.ask(path, form, self.number, self.rng, host) for host in hosts)
            answers = await asyncio.gather(*asked, return_exceptions=True)
            for error in answers:
                if isinstance(error, BaseException) and not isinstance(error, OSError):
                    raise error
            taken = [one[0] for one in answers if isinstance(one, tuple) and one[0].status == 303]
            if taken or (once and await self._has_left()):
                return taken
            await asyncio.sleep(PAUSE)
        raise AssertionError(f"{path} was never taken: {answers}")

    async def _has_left(self):
        with suppress(OSError):
            answer, host = await self.ask()
            return host is not None and answer.status == 200 and "data-trial" not in answer.body
        return False


class Answering(Person):
    """Keeps changing answers; the answers to a question are numbered.

    Attributes:
        kept: Number of the last answer that was acknowledged, by question.
        noted: How many answers were acknowledged.
    """

    def __init__(self, *words):
        super().__init__(*words)
        self._sent, self.kept, self.noted = dict.fromkeys(QUESTIONS, 0), dict.fromkeys(QUESTIONS, 0), 0
        self._cut = set()  # may still be taken, however late

    async def go_on(self):
        while True:
            item = str(self.rng.choice(QUESTIONS))
            self._sent[item] += 1
            given = self._sent[item]
            form = {"phase": "comprehension", item: str(given)}
            sending = asyncio.create_task(self.ask("/answers", form))
            if self.rng.random() < CUT:
                await asyncio.sleep(float(self.rng.uniform(0.0, 0.02)))
                sending.cancel()
                self._cut.add((item, given))
            await asyncio.wait({sending})
            if not sending.cancelled() and sending.exception() is None and sending.result()[0].status == 204:
                self.kept[item], self.noted = given, self.noted + 1
                continue
            if not sending.cancelled() and isinstance(sending.exception(), TimeoutError):
                self._cut.add((item, given))
            await asyncio.sleep(PAUSE)

    def check(self, found):
        """Each answer that the database has is the last one that was acknowledged, or one that was sent after it."""
        for item, kept in self.kept.items():
            may = {
                *range(kept, self._sent[item] + 1),
                *(number for name, number in self._cut if name == item),
            }
            if kept:
                assert int(found[self.name, item]) in may, f"an answer {kept} of person {self.number} is lost"


class Playing(Person):
    """Scrolls, each time by another number of rows, by which inputs are recognised in the journal."""

    def __init__(self, *words):
        super().__init__(*words)
        self._pressed, self._order = 0, {}  # by numbers of inputs: which of all it was
        self._browser = None

    async def begin(self):
        await super().begin()
        await self.understand()
        self._browser = SimulatedBrowser(self.link)

    @property
    def noted(self):
        """Number of the last input that was acknowledged."""
        return self._browser.acknowledged

    async def go_on(self):
        try:
            while True:
                try:
                    async with asyncio.timeout(PLAYING_S):
                        await self._play()
                except LOST:
                    await self._cut()
                    await asyncio.sleep(PAUSE)
        finally:
            await self._cut()

    async def _play(self):
        browser = self._browser
        if not browser.last or "closed" in browser.last or browser.phase == "failed":
            await self._connect()
        if browser.phase != "running":
            await browser.until(lambda: browser.phase in ("ready", "paused", "failed", "running"))
            if browser.phase == "failed":
                self._reload()
                raise ConnectionError
            number = await browser.run()
            assert number >= browser.acknowledged, f"person {self.number} lost an input"
        for _ in range(int(self.rng.integers(1, 5))):
            self._pressed += 1
            rows = 1 + self._pressed % MAX_ROWS
            values = {"forward": float(self.rng.choice([-1.0, 0.0, 1.0])), "scroll": rows}
            self._order[browser.press(**values)] = self._pressed
        await asyncio.sleep(float(self.rng.exponential(0.05)))

    async def _connect(self):
        """Connect to the host that has the person."""
        answer, host = await self.ask()
        if answer.status != 200 or host is None:
            raise ConnectionError
        await self._cut()
        if self.rng.random() < 0.3:
            self._reload()
        self._browser.address = host.server.url.rstrip("/") + self.link
        await self._browser.open(TASK)

    def _reload(self):
        """Forget what was not acknowledged; it may count or not."""
        self._browser.reload()
        self._order = {number: order for number, order in self._order.items() if number <= self.noted}

    def lose(self, *, amid_a_message):
        """Lose the connection, which is then made again."""
        with suppress(*LOST):
            self._browser.lose(amid_a_message=amid_a_message)

    async def _cut(self):
        with suppress(*LOST):
            await self._browser.cut()
        self._browser.last.clear()

    def journal(self):
        """The only journal there is."""
        found = [path for host in self.site.hosts.values() if (path := host.journal(self.name)).is_file()]
        assert len(found) == 1, found
        return found[0]

    def check(self):
        """Each acknowledged input is in the journal, once, and none that was not sent."""
        entries = [entry for entry in read_entries(self.journal()) if isinstance(entry, JournalEntry)]
        events = [json.loads(line) for entry in entries for line in entry.events]
        counted = [0]
        for event in events:
            if event["event"] == "scroll":
                counted.append(counted[-1] + 1 + (event["rows"] - 2 - counted[-1]) % MAX_ROWS)
        assert counted[-1] <= self._pressed, (
            f"an input of person {self.number} is doubled or in another place"
        )
        acknowledged = {order for number, order in self._order.items() if number <= self.noted}
        lost = sorted(acknowledged.difference(counted))
        assert not lost, f"person {self.number} lost {lost}, of {self.noted} acknowledged; {counted[-30:]}"
