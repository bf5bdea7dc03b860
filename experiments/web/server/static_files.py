"""Files of the client, at addresses that change with them: a browser that has them never asks again."""

import functools
import hashlib
from collections.abc import Sequence

from starlette.middleware.gzip import GZipMiddleware
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

from experiments.web.modules import STATIC

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
