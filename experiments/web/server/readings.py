"""How long people read the story, and how often they answered its questions. Their forms carry only when it was opened.

The value in a form is signed with a key of this server: a form that was changed, or made by hand, counts as no reading.
"""

import hmac
import secrets
import time
from collections import OrderedDict

from experiments.record.phases import STORY
from experiments.web.server.visits import Ended

MAX_READING = 24 * 3600.0  # s; a page may stay open over night
MAX_TRIED = 10_000  # pages with wrong answers that are remembered


class Readings:
    """The pages of the story that were opened."""

    def __init__(self) -> None:
        self._key = secrets.token_bytes(32)
        self._tries: OrderedDict[str, int] = OrderedDict()  # wrong answers, by page

    def open(self) -> str:
        """A page is opened now; the value that its form sends back."""
        return self._signed(f"{round(1000.0 * time.monotonic())}.{secrets.token_hex(8)}")

    def reading(self, page: str) -> Ended | None:
        """The phase of reading, up to now, by what a form sent; None where this server did not sign it."""
        text = page.rpartition(".")[0]
        if not hmac.compare_digest(page.encode(), self._signed(text).encode()):
            return None
        seconds = time.monotonic() - int(text.partition(".")[0]) / 1000.0
        duration = round(min(max(0.0, seconds), MAX_READING), 3)
        return Ended(STORY, duration, attempts=1 + self._tries.get(page, 0))

    def fail(self, page: str) -> None:
        """The answers that were sent with a page are wrong."""
        self._tries[page] = self._tries.pop(page, 0) + 1
        if len(self._tries) > MAX_TRIED:
            self._tries.popitem(last=False)

    def _signed(self, text: str) -> str:
        return f"{text}.{hmac.new(self._key, text.encode(), 'sha256').hexdigest()}"
