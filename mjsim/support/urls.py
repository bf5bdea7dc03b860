"""Parse URLs, and hide the passwords in them."""

import re
from urllib.parse import SplitResult, urlsplit

# A password extends to the last @. It may contain spaces or slashes, but not both. Advice names it PASSWORD.
_PASSWORD = re.compile(r"(://[^\s:/@]*):(?!PASSWORD@)(?:\S*|[^\n/,;]*)@")
_PARAMETER = re.compile(r"([?&][^\s=&]*(?:password|passwd|secret|token|key)[^\s=&]*=)[^\s&]+", re.IGNORECASE)


def redacted(text: str) -> str:
    """Return a text in which `***` replaces the passwords of all URLs."""
    return _PARAMETER.sub(r"\1***", _PASSWORD.sub(r"\1:***@", text))


def parse_url(text: str) -> SplitResult:
    """Parse the URL of a web server. Raise a ValueError if the host or the port is missing or not valid."""
    url = urlsplit(text)
    if url.scheme not in ("http", "https") or not url.hostname or url.port == 0:
        raise ValueError("not the URL of a web server")
    return url
