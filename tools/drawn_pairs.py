"""Draw pairs of pictures of the same moment with mjsim and with the browser client, and compare them.

`python -m tools.drawn_pairs docs/pictures/browser.webp` draws 21 pairs and combines them into a contact
sheet.
"""

import argparse
import base64
import functools
import http.server
import itertools
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from hud.markers import breadcrumbs, flagpole, pin, rims
from hud.state import Marker
from mjsim.formats.gltf.export import export_scene
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compiled_house, navigable_floor
from mjsim.house.scene.avatar import BODY, EYE, HANDS, PREFIX
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.scene.scene import Scene, compose
from mjsim.render import Renderer

Image = NDArray[np.uint8]

SIZE = (640, 480)  # width and height of each picture in pixels
POSES_PER_ROOM = 3
FREE = 1.0  # required free distance in front of the person in metres, to avoid pictures of bare walls
PITCHES = (-0.5, 0.1)  # range of the head's pitch in radians
SITE = Path(__file__).parents[1] / "experiments" / "web" / "client" / "static"
CHROMIUM = "/usr/bin/chromium"
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # use WebGL without a graphics card
PAGE = """<!doctype html><title>World</title><link rel="icon" href="data:,">
<style>body { margin: 0 } canvas { display: block; width: 100vw; height: 100vh }</style>
<canvas></canvas><script type="module" src="/page.js"></script>"""
PAGE_SCRIPT = """import { World3D } from "/static/drawing/world.js";
const canvas = document.querySelector("canvas");
const world = new World3D(canvas);
world.resize();
await world.load((name) => "/scene/" + name);
const start = (angle, things) => { world.setFieldOfView(angle); return world.setObjects(things); };
const picture = (person, eye, markers) => {
  world.setPerson(person);
  world.camera.setEye(eye);
  world.setMarkers(markers);
  const times = [];
  let url = "";
  for (let i = 0; i < 5; i++) {
    world.draw();
    url = canvas.toDataURL("image/png");
    times.push(world.info().milliseconds);
  }
  return [url, { ...world.info(), milliseconds: Math.min(...times) }];
};
Object.assign(window, { world, start, picture, ready: true });
"""
TYPES = {"": "text/html", ".js": "text/javascript", ".json": "application/json", ".webp": "image/webp"}
CELL = (240, 180)  # size of a picture on the contact sheet in pixels


@dataclass(frozen=True)
class View:
    """A person's pose in a house, with the visible markers."""

    room: str  # name of the room
    x: float  # position in metres
    y: float
    heading: float  # angle from +x towards +y in radians
    pitch: float  # pitch of the head in radians, positive upwards
    markers: tuple[Marker, ...] = ()


@dataclass(frozen=True, eq=False)
class Pair:
    """Two drawings of the same view."""

    view: View
    mjsim: Image  # picture by mjsim, (h, w, 3)
    browser: Image  # picture by the browser, (h, w, 3)
    calls: int
    triangles: int
    milliseconds: float  # shortest of five drawing times on the main thread

    @functools.cached_property
    def similarity(self) -> float:
        return ssim(self.mjsim, self.browser)


def ssim(a: Image, b: Image) -> float:
    """Return the mean structural similarity of two pictures in grey (Wang et al., IEEE TIP 13, 2004)."""
    x, y = (cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.float64) for image in (a, b))
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(cv2.GaussianBlur(values, (11, 11), 1.5))[5:-5, 5:-5]

    mx, my = mean(x), mean(y)
    vx, vy, vxy = mean(x * x) - mx * mx, mean(y * y) - my * my, mean(x * y) - mx * my
    quality = (2 * mx * my + c1) * (2 * vxy + c2) / ((mx**2 + my**2 + c1) * (vx + vy + c2))
    return float(np.mean(quality))


def sampled_scene() -> Scene:
    """Return the scene of an episode in the apartment, including visual geoms."""
    catalogue = Catalogue.load("apartment")
    return compose(sample_episode(catalogue, objects=24, seed=0), catalogue)


def views(scene: Scene) -> tuple[View, ...]:
    """Choose three walkable poses in each room. One of them has markers."""
    rng = np.random.default_rng(0)
    floor = navigable_floor(scene.catalogue)
    rooms = compiled_house(scene.catalogue).rooms
    chosen: dict[str, list[View]] = {key: [] for key in rooms.labels}
    while any(len(found) < POSES_PER_ROOM for found in chosen.values()):
        x, y = floor.sample(rng)
        heading, pitch = float(rng.uniform(-np.pi, np.pi)), float(rng.uniform(*PITCHES))
        ahead = np.array([x, y]) + FREE * np.array([np.cos(heading), np.sin(heading)])
        found = chosen[rooms.room_at((x, y))]
        if len(found) < POSES_PER_ROOM and floor.is_navigable(ahead):
            markers = _markers(scene, (x, y), heading) if len(found) == 1 else ()
            found.append(
                View(rooms.label(rooms.room_at((x, y))), float(x), float(y), heading, pitch, markers)
            )
    return tuple(view for found in chosen.values() for view in found)


def _markers(scene: Scene, position: tuple[float, float], heading: float) -> tuple[Marker, ...]:
    """Return markers for a path ahead and for all objects. A third of them are visible through walls."""
    ahead = np.array([np.cos(heading), np.sin(heading)])
    path = np.array([np.array(position) + k * ahead for k in (0.0, 3.0)])
    crumbs = breadcrumbs(path, scene.person.eye_height, 0.6)
    poles = [
        part
        for i, placed in enumerate(scene.episode.objects)
        for part in flagpole(placed.position, object=placed.name, low=i % 2 == 1, x_ray=i % 3 == 0)
    ]
    return (*crumbs, *rims(crumbs), *poles, *pin((float(path[1, 0]), float(path[1, 1]), 0.0)))


class Moments:
    """A scene whose person can be moved to different views."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.data = mujoco.MjData(scene.model)

    def place(self, view: View) -> None:
        for joint, value in (("x", view.x), ("y", view.y), ("yaw", view.heading), ("pitch", view.pitch)):
            self.data.joint(PREFIX + joint).qpos[0] = value
        mujoco.mj_forward(self.scene.model, self.data)

    def things(self) -> dict[str, Any]:
        found = {}
        for placed in self.scene.episode.objects:
            body = self.data.body(f"{placed.name}/object")
            pose = [*body.xpos.tolist(), *body.xquat.tolist()]
            found[placed.name] = {"model": placed.model, "pose": pose}
        return found

    def person(self, view: View) -> dict[str, Any]:
        body = self.data.body(BODY)
        turn = body.xmat.reshape(3, 3)
        hands = [turn.T @ (self.data.body(f"{PREFIX}{hand}_hand").xpos - body.xpos) for hand in HANDS]
        return {"x": view.x, "y": view.y, "heading": view.heading, "hands": [h.tolist() for h in hands]}

    def eye(self, view: View) -> dict[str, Any]:
        position = self.data.cam_xpos[self.scene.model.camera(EYE).id].tolist()
        return {"position": position, "heading": view.heading, "pitch": view.pitch}


def draw_pairs(browser: Any, scene: Scene, chosen: Sequence[View]) -> list[Pair]:
    """Draw views with mjsim and with a Playwright browser that loads an exported scene."""
    moments = Moments(scene)
    files = export_scene(scene.catalogue)
    width, height = SIZE
    with (
        served({f"/scene/{name}": data for name, data in files.items()}) as address,
        Renderer(scene.model, width=width, height=height) as renderer,
    ):
        page = browser.new_page(viewport={"width": width, "height": height})
        page.goto(address)
        page.wait_for_function("window.ready")
        moments.place(chosen[0])
        page.evaluate("([a, t]) => start(a, t)", [scene.person.field_of_view, moments.things()])
        pairs = []
        for view in chosen:
            moments.place(view)
            mine = renderer.rgb(moments.data, markers=view.markers)
            shown = [moments.person(view), moments.eye(view), [asdict(marker) for marker in view.markers]]
            url, info = page.evaluate("([p, e, m]) => picture(p, e, m)", shown)
            theirs = decoded(base64.b64decode(url.partition(",")[2]))
            pairs.append(Pair(view, mine, theirs, info["calls"], info["triangles"], info["milliseconds"]))
        page.close()
    return pairs


def decoded(png: bytes) -> Image:
    pixels = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB), dtype=np.uint8)


@contextmanager
def served(files: Mapping[str, bytes]) -> Iterator[str]:
    """Serve a page with a `World3D` and the given files by path. Yield the URL of the page."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def do_GET(self) -> None:
            path = self.path.partition("?")[0]
            content = {"/": PAGE.encode(), "/page.js": PAGE_SCRIPT.encode(), **files}.get(path)
            if content is None and path.startswith("/static/"):
                content = (SITE / path.removeprefix("/static/")).read_bytes()
            self.send_response(404 if content is None else 200)
            self.send_header("Content-Type", TYPES.get(Path(path).suffix, "application/octet-stream"))
            self.end_headers()
            self.wfile.write(content or b"")

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()


def contact_sheet(pairs: Sequence[Pair]) -> Image:
    """Arrange pairs with one row per room: mjsim, browser, and their difference, amplified fourfold."""
    rows = []
    for room, grouped in itertools.groupby(pairs, lambda pair: pair.view.room):
        group = list(grouped)
        cells = [cell for pair in group for cell in _cells(pair)]
        row = np.hstack([cv2.resize(cell, CELL, interpolation=cv2.INTER_AREA) for cell in cells])
        bar = np.full((24, row.shape[1], 3), 255, np.uint8)
        figures = ", ".join(f"SSIM {pair.similarity:.3f} in {pair.calls} draws" for pair in group)
        title = f"{room}: mjsim, browser, difference x 4; {figures}"
        cv2.putText(bar, title, (6, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1, cv2.LINE_AA)
        rows += [bar, row]
    return np.vstack(rows)


def _cells(pair: Pair) -> tuple[Image, Image, Image]:
    difference = pair.browser.astype(np.int16) - pair.mjsim
    return pair.mjsim, pair.browser, np.clip(128 + 4 * difference, 0, 255).astype(np.uint8)


def main() -> None:
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="picture to write: PNG, JPEG or WebP")
    out: Path = parser.parse_args().out
    scene = sampled_scene()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", *SOFTWARE])
        pairs = draw_pairs(browser, scene, views(scene))
        browser.close()
    cv2.imwrite(
        str(out), cv2.cvtColor(contact_sheet(pairs), cv2.COLOR_RGB2BGR), [cv2.IMWRITE_WEBP_QUALITY, 88]
    )


if __name__ == "__main__":
    main()
