"""Scene files over HTTP: kept for good by browsers, compressed, and nothing else is served."""

import gzip
import json

import pytest
from play_site import playing
from scripted_workers import ScriptedPool
from starlette.applications import Starlette
from starlette.testclient import TestClient

from experiments.web.client_files import scene_route
from mjsim.formats.gltf.store import GZIP, scenes_folder

HASH = "0123456789abcdef0123"
SCENE = b'{"house":"house.glb"}' * 50


@pytest.fixture
def folder(tmp_path):
    """A scene as the cache leaves it, and something beside it."""
    scene = tmp_path / "scenes" / HASH
    (scene / "objects").mkdir(parents=True)
    for name in ("scene.json", "house.glb", "objects/mug.glb", "floor-0.2.json"):
        (scene / f"{name}{GZIP}").write_bytes(gzip.compress(SCENE))
    (scene / "sky.webp").write_bytes(b"picture")
    (tmp_path / "scenes" / "secret.json").write_bytes(b"secret")
    (tmp_path / "secret.json").write_bytes(b"secret")
    return tmp_path / "scenes"


@pytest.fixture
def client(folder):
    with TestClient(Starlette(routes=[scene_route(folder)])) as client:
        yield client


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("scene.json", "application/json"),
        ("floor-0.2.json", "application/json"),
        ("house.glb", "model/gltf-binary"),
        ("objects/mug.glb", "model/gltf-binary"),
    ],
)
def test_files_come_compressed_and_are_kept_for_good(client, name, kind):
    answer = client.get(f"/scene/{HASH}/{name}", headers={"Accept-Encoding": "gzip, deflate, br"})
    assert answer.status_code == 200 and answer.content == SCENE
    headers = answer.headers
    assert headers["content-type"] == kind
    assert headers["cache-control"] == "public, max-age=31536000, immutable"
    assert headers["content-encoding"] == "gzip" and int(headers["content-length"]) < len(SCENE)
    assert headers["vary"] == "Accept-Encoding"
    assert "set-cookie" not in headers


@pytest.mark.parametrize("accepted", ["", "identity", "gzip;q=0", "br, gzip; q=0.0"])
def test_who_takes_no_gzip_gets_the_plain_file(client, accepted):
    answer = client.get(f"/scene/{HASH}/scene.json", headers={"Accept-Encoding": accepted})
    assert answer.content == SCENE
    assert "content-encoding" not in answer.headers
    assert answer.headers["vary"] == "Accept-Encoding"


def test_pictures_are_compressed_already(client):
    answer = client.get(f"/scene/{HASH}/sky.webp")
    assert answer.content == b"picture"
    assert answer.headers["content-type"] == "image/webp" and "content-encoding" not in answer.headers
    assert "immutable" in answer.headers["cache-control"]


@pytest.mark.parametrize(
    "path",
    [
        "/scene/ffffffffffffffff/scene.json",  # another hash
        f"/scene/{HASH}/other.glb",
        f"/scene/{HASH}/scene.json.gz",
        f"/scene/{HASH}/objects/%2e%2e/scene.json",
        f"/scene/{HASH}/%2e%2e/secret.json",
        f"/scene/{HASH}/..%2fsecret.json",
        f"/scene/{HASH}/%2fetc%2fpasswd",
        f"/scene/{HASH}/objects",
        f"/scene/{HASH}/",
        f"/scene/{HASH}",
        "/scene/secret.json/",
        "/scene/../secret.json",
        "/scene/%2e%2e/secret.json",
        f"/scene/{HASH}/scene.json%00",
    ],
)
def test_nothing_else_is_served(client, path):
    answer = client.get(path, follow_redirects=False)
    assert answer.status_code in (404, 307)
    assert b"secret" not in answer.content and "immutable" not in answer.headers.get("cache-control", "")


def test_the_server_of_play_serves_scenes_without_a_token(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert scenes_folder() == folder

    with playing(tmp_path / "out", ScriptedPool()) as client:
        answer = client.get(f"/scene/{HASH}/scene.json")
        assert json.loads(answer.content[:21]) == {"house": "house.glb"}
        assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert client.get("/scene/ffffffffffffffff/scene.json").status_code == 404
