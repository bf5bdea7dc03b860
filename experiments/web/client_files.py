"""Files of the client: modules with their imports, and the addresses under which they are served."""

import functools
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from starlette.middleware.gzip import GZipMiddleware
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

STATIC = Path(__file__).parent / "client" / "static"
_IMPORT = re.compile(r"(\bfrom\s*|\bimport\s*)\"(\.{1,2}/[^\"]+)\"")


def modules_of(entry: str) -> Mapping[str, str]:
    """Sources of the module `entry` and of all that it imports, by their paths; imports name those paths."""
    found: dict[str, str] = {}
    waiting = [entry]
    while waiting:
        path = waiting.pop()
        if path not in found:
            needs: list[str] = []
            found[path] = _IMPORT.sub(_named_from(path, needs), (STATIC / path).read_text("utf-8"))
            waiting += needs
    return found


def _named_from(path: str, needs: list[str]) -> Callable[[re.Match[str]], str]:
    """Replaces relative imports of the module at `path` by paths, and appends these to `needs`."""

    def named(match: re.Match[str]) -> str:
        target = ((STATIC / path).parent / match[2]).resolve()
        needs.append(target.relative_to(STATIC.resolve()).as_posix())
        return f'{match[1]}"{needs[-1]}"'

    return named


IMMUTABLE = "public, max-age=31536000, immutable"
CHECKED = "no-cache"  # used again while their ETag is the same


@functools.cache
def _folder() -> str:
    digest = hashlib.sha256()
    for path in sorted(path for path in STATIC.rglob("*") if path.is_file()):
        digest.update(path.relative_to(STATIC).as_posix().encode() + path.read_bytes())
    return f"/static/{digest.hexdigest()[:16]}"


def static_url(name: str) -> str:
    """Address of a file of the client; imports of modules lead to others in the same folder."""
    return f"{_folder()}/{name}"


def static_routes() -> Sequence[Mount]:
    """Serve the files there, and at `/static/NAME` for those who do not know the address of today."""
    files = GZipMiddleware(StaticFiles(directory=STATIC))
    return [Mount(_folder(), files), Mount("/static", files)]


def static_caching(path: str) -> str | None:
    """`Cache-Control` for a path, or None where it is not one of a file."""
    if path.startswith(f"{_folder()}/"):
        return IMMUTABLE
    return CHECKED if path.startswith("/static/") else None
