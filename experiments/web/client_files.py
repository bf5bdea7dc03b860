"""Serve the files that browsers need: the client's modules, scenes and rendered templates."""

import functools
import gzip
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.templating import Jinja2Templates

from experiments.trials.design import counted
from hud.texts import filled
from mjsim.formats.gltf.store import GZIP

CLIENT = Path(__file__).parent / "client"
STATIC = CLIENT / "static"
_IMPORT = re.compile(r"(\bfrom\s*|\bimport\s*)\"(\.{1,2}/[^\"]+)\"")
IMMUTABLE = "public, max-age=31536000, immutable"
CHECKED = "no-cache"  # browsers may cache the file, but must revalidate it before each use
SCENE_HEADERS = {"Cache-Control": IMMUTABLE, "Vary": "Accept-Encoding"}
MEDIA_TYPES = {
    ".glb": "model/gltf-binary",
    ".js": "text/javascript",
    ".json": "application/json",
    ".webp": "image/webp",
}
_HASH, _NAME = re.compile(r"[0-9a-f]{16,64}"), re.compile(r"(objects/)?[A-Za-z0-9_-][A-Za-z0-9_.-]*")


def modules_of(entry: str) -> Mapping[str, str]:
    """Return the sources of a module and its dependencies by path. Import statements use these paths."""
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
    def named(match: re.Match[str]) -> str:
        target = ((STATIC / path).parent / match[2]).resolve()
        needs.append(target.relative_to(STATIC.resolve()).as_posix())
        return f'{match[1]}"{needs[-1]}"'

    return named


@functools.cache
def _folder() -> str:
    digest = hashlib.sha256()
    for path in sorted(path for path in STATIC.rglob("*") if path.is_file()):
        digest.update(path.relative_to(STATIC).as_posix().encode() + path.read_bytes())
    return f"/static/{digest.hexdigest()[:16]}"


def static_url(name: str) -> str:
    """Return the URL of a static file. The URL contains a hash of all static files."""
    return f"{_folder()}/{name}"


def static_routes() -> Sequence[Mount]:
    """Return routes for static files, both at URLs with a hash and at the fixed URLs `/static/NAME`."""
    files = GZipMiddleware(StaticFiles(directory=STATIC))
    return [Mount(_folder(), files), Mount("/static", files)]


def static_caching(path: str) -> str | None:
    """Return the `Cache-Control` header for the URL of a static file, or None for other URLs."""
    if path.startswith(f"{_folder()}/"):
        return IMMUTABLE
    return CHECKED if path.startswith("/static/") else None


def scene_route(folder: Path) -> Route:
    """Return a route for scenes in a folder written by `mjsim.formats.gltf.cache`. It requires no token."""

    def serve(request: Request) -> Response:
        scene, name = request.path_params["hash"], request.path_params["name"]
        path = folder / scene / name
        kind = MEDIA_TYPES.get(path.suffix)
        if kind is None or not _HASH.fullmatch(scene) or not _NAME.fullmatch(name):
            return PlainTextResponse("not found\n", 404)
        compressed = path.with_name(f"{path.name}{GZIP}")
        if compressed.is_file():
            if _accepts_gzip(request):
                headers = {**SCENE_HEADERS, "Content-Encoding": "gzip"}
                return FileResponse(compressed, headers=headers, media_type=kind)
            return Response(gzip.decompress(compressed.read_bytes()), headers=SCENE_HEADERS, media_type=kind)
        if path.is_file():
            return FileResponse(path, headers=SCENE_HEADERS, media_type=kind)
        return PlainTextResponse("not found\n", 404)

    return Route("/scene/{hash}/{name:path}", serve)


def _accepts_gzip(request: Request) -> bool:
    for coding in request.headers.get("accept-encoding", "").lower().split(","):
        name, _, quality = coding.partition(";")
        if name.strip() in ("gzip", "*"):
            return not re.fullmatch(r"\s*q=0(\.0*)?\s*", quality)
    return False


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


_templates = Jinja2Templates(CLIENT / "templates")
_templates.env.filters.update(counted=counted, duration=_duration, filled=filled)
_templates.env.globals.update(modules=functools.cache(modules_of), static=static_url)
_templates.env.trim_blocks = True
_templates.env.auto_reload = False  # template files are not checked for changes on each request


def page(request: Request, name: str, status: int = 200, **values: Any) -> Response:
    return _templates.TemplateResponse(request, f"{name}.html", values, status)


def rendered(name: str, **values: Any) -> str:
    """Return a page without the request that a template for a server needs."""
    return _templates.get_template(f"{name}.html").render(values)


def trial_texts(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return the texts of the trial page, by name. `sections` contains all texts of a language."""
    return {name: text for section in ("common", "hud", "trial") for name, text in sections[section].items()}
