"""Files of the client: their modules, URLs and caching."""

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
    """Return the sources of a module and all its imports, by path. Their imports name these paths."""
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
    """Return a replacement of relative imports by paths, which appends the paths to `needs`."""

    def named(match: re.Match[str]) -> str:
        target = ((STATIC / path).parent / match[2]).resolve()
        needs.append(target.relative_to(STATIC.resolve()).as_posix())
        return f'{match[1]}"{needs[-1]}"'

    return named


IMMUTABLE = "public, max-age=31536000, immutable"
CHECKED = "no-cache"  # revalidated by ETag


@functools.cache
def _folder() -> str:
    digest = hashlib.sha256()
    for path in sorted(path for path in STATIC.rglob("*") if path.is_file()):
        digest.update(path.relative_to(STATIC).as_posix().encode() + path.read_bytes())
    return f"/static/{digest.hexdigest()[:16]}"


def static_url(name: str) -> str:
    """Return the URL of a file, in a folder named after the hash of all files."""
    return f"{_folder()}/{name}"


def static_routes() -> Sequence[Mount]:
    """Serve the files at their URLs, and also at `/static/NAME`, whose URLs never change."""
    files = GZipMiddleware(StaticFiles(directory=STATIC))
    return [Mount(_folder(), files), Mount("/static", files)]


def static_caching(path: str) -> str | None:
    """Return the `Cache-Control` header of a file's URL, or None for other paths."""
    if path.startswith(f"{_folder()}/"):
        return IMMUTABLE
    return CHECKED if path.startswith("/static/") else None
