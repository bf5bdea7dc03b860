"""Counting the words on a page."""

from html.parser import HTMLParser
from typing import Any


def words_of(page: str) -> int:
    """Count the visible words of an HTML page."""
    text = _Text()
    text.feed(page)
    return text.words


class _Text(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.words, self._hidden = 0, 0

    def handle_starttag(self, tag: str, attrs: Any) -> None:  # noqa: ARG002 - of the base
        self._hidden += tag in ("head", "script", "noscript")

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in ("head", "script", "noscript")

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.words += len(data.split())
