"""The route of scene files, `/scene/HASH/NAME`. The files never change and are stored compressed."""

import gzip
import re
from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route

from mjsim.formats.gltf.store import GZIP

HEADERS = {"Cache-Control": "public, max-age=31536000, immutable", "Vary": "Accept-Encoding"}
_MEDIA_TYPES = {".glb": "model/gltf-binary", ".json": "application/json", ".webp": "image/webp"}
_HASH, _NAME = re.compile(r"[0-9a-f]{16,64}"), re.compile(r"(objects/)?[A-Za-z0-9_-][A-Za-z0-9_.-]*")


def scene_route(folder: Path) -> Route:
    """Serve the scenes in a folder written by `mjsim.formats.gltf.cache`. No token is needed."""

    def serve(request: Request) -> Response:
        scene, name = request.path_params["hash"], request.path_params["name"]
        path = folder / scene / name
        kind = _MEDIA_TYPES.get(path.suffix)
        if kind is None or not _HASH.fullmatch(scene) or not _NAME.fullmatch(name):
            return PlainTextResponse("not found\n", 404)
        compressed = path.with_name(f"{path.name}{GZIP}")
        if compressed.is_file():
            if _accepts_gzip(request):
                headers = {**HEADERS, "Content-Encoding": "gzip"}
                return FileResponse(compressed, headers=headers, media_type=kind)
            return Response(gzip.decompress(compressed.read_bytes()), headers=HEADERS, media_type=kind)
        if path.is_file():
            return FileResponse(path, headers=HEADERS, media_type=kind)
        return PlainTextResponse("not found\n", 404)

    return Route("/scene/{hash}/{name:path}", serve)


def _accepts_gzip(request: Request) -> bool:
    """Return True if the Accept-Encoding header allows gzip."""
    for coding in request.headers.get("accept-encoding", "").lower().split(","):
        name, _, quality = coding.partition(";")
        if name.strip() in ("gzip", "*"):
            return not re.fullmatch(r"\s*q=0(\.0*)?\s*", quality)
    return False
