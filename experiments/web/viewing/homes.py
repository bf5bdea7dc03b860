"""Create the pictures, the description and the tour page of a home in a gallery."""

import functools
import hashlib
import re
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np

from experiments.errors import ConfigError
from experiments.house import House
from experiments.record.files import replacing_folder
from experiments.session.camera_path import camera_path
from experiments.session.house_pictures import WEBP, floor_plan, largest_rooms, room_views
from experiments.web.viewing.page import run_page
from hud.state import HudState, InventorySlot
from mjsim.formats.gltf.export import export_scene
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.catalogue.generated_names import parse_name
from mjsim.house.catalogue.house_ref import parse_house
from mjsim.house.compiled.house import compiled_house
from mjsim.render import Renderer
from mjsim.support.files import source_digest
from mjsim.values.person_parameters import PersonParameters

PLAN, VIEW = (480, 400), (300, 200)  # width and height of the floor plan and of a view, in pixels
PAGE, ABOUT = "index.html", "home.json"
INTERVAL = 0.2  # interval between poses of the tour, in seconds; the page interpolates between them
NEAR = 0.05  # distance at which a viewpoint counts as reached, in metres
INSIDE = (0.0, 0.0, 0.8) * 2  # positions of both hands inside the body, where they are hidden, in metres
_HUD = HudState("", (), (), (None, InventorySlot()))


class GalleryHome(msgspec.Struct, frozen=True):
    """The description of a home in a gallery.

    Attributes:
        name: Full name of a generated house, otherwise the given name or path.
        area: Floor area in square metres.
        pictures: File names of the floor plan and of views at eye height.
        digest: Hash of all inputs that determine the files.
    """

    name: str
    label: str
    rooms: int
    area: float
    pictures: tuple[str, ...]
    digest: str

    @property
    def size(self) -> str:
        return f"{self.rooms} {'room' if self.rooms == 1 else 'rooms'}, {self.area:.0f} m²"

    @property
    def origin(self) -> str:
        """The seed and version of a generated home, or the name of any other home."""
        found = re.fullmatch(r"generated:(\d+)\?rooms=\d+&version=(\d+)", self.name)
        return f"seed {found[1]}, version {found[2]}" if found else self.name


def home_key(name: str) -> str:
    """Return the name of a home's folder in a gallery.

    Raises:
        AssetError: The catalogue of a house that is not generated cannot be read.
        ConfigError: The name of the house cannot be turned into a folder name.
        HouseError: The name of a generated house is not valid.
    """
    named = parse_house(name)
    if named.kind == "generated":
        home = parse_name(named.name)
        return f"generated_{home.seed}_{home.rooms}"
    load_catalogue(name)
    path = Path(name).absolute()
    key = re.sub(r"[^A-Za-z0-9-]+", "_", path.parent.name if path.is_file() else path.name).strip("_")
    if not key:
        raise ConfigError(f"{name} has no letter or digit in its name; rename the folder")
    return key


def draw_home(name: str, folder: Path) -> GalleryHome:
    """Write the pictures and the page of a home to `folder` atomically, unless they are up to date.

    Raises:
        AssetError: The house cannot be read or used.
        HouseError: The house cannot be generated.
        RenderError: This machine cannot render.
        OSError: The folder cannot be written.
    """
    catalogue = load_catalogue(name)
    digest = hashlib.sha256(f"{name}\n{catalogue.content}\n{_code()}".encode()).hexdigest()[:20]
    if (kept := _kept(folder)) and kept.digest == digest:
        return kept
    house = House.of(catalogue)
    shown = catalogue.name if catalogue.ref.kind == "generated" else name
    count, area = len(house.rooms.labels), round(house.rooms.area, 1)
    with replacing_folder(folder) as work:
        home = GalleryHome(shown, catalogue.label, count, area, _draw(house, work), digest)
        scene = {
            file: content
            for file, content in export_scene(catalogue).items()
            if not file.startswith("objects/")
        }
        page = run_page(house.catalogue.label, _tour(house), scene, tour=f"{home.size}, {home.origin}")
        (work / PAGE).write_text(page, "utf-8")
        (work / ABOUT).write_bytes(msgspec.json.encode(home))
    return home


def _draw(house: House, folder: Path) -> tuple[str, ...]:
    compiled = compiled_house(house.catalogue)
    views = list(room_views(house, largest_rooms(house, 2)).values())
    cameras = views[0][:2] if len(views) == 1 else [views[0][0], views[1][0]]
    pictures = {"plan.webp": floor_plan(house, PLAN)}
    with Renderer(compiled.model, width=2 * VIEW[0], height=2 * VIEW[1], profile="quality") as renderer:
        for number, camera in enumerate(cameras, 1):
            pictures[f"view_{number}.webp"] = renderer.rgb(compiled.data, camera)
    for name, picture in pictures.items():
        cv2.imwrite(str(folder / name), np.ascontiguousarray(picture[..., ::-1]), WEBP)
    return tuple(pictures)


def _kept(folder: Path) -> GalleryHome | None:
    try:
        return msgspec.json.decode((folder / ABOUT).read_bytes(), type=GalleryHome)
    except (OSError, msgspec.DecodeError):
        return None


@functools.cache
def _code() -> str:
    """Return a hash of the source files that determine the contents of a gallery."""
    page = run_page("", {}, {}, tour="")
    return source_digest("mjsim", "experiments") + hashlib.sha256(page.encode()).hexdigest()


def _tour(house: House) -> dict[str, Any]:
    """Return the data of the tour in the `Run` format of view/run.js."""
    path, person = camera_path(house), PersonParameters()
    times = np.arange(0.0, path.duration, INTERVAL)
    rows = path.at(times)
    body = np.column_stack([rows.positions[:, :2], rows.headings, rows.pitches])
    moments = []
    for key, places in house.viewpoints.items():
        gaps = np.linalg.norm(rows.positions[:, :2] - places[0], axis=1)
        reached = times[np.flatnonzero(gaps < gaps.min() + NEAR)[0]]
        moments.append({"t": round(float(reached), 1), "kind": "room", "text": house.rooms.label(key)})
    return {
        "person": {
            "eye_height": person.eye_height,
            "eye_forward": 0.0,
            "body_radius": person.body_radius,
            "field_of_view": person.field_of_view,
        },
        "bounds": house.bounds,
        "models": {},
        "time": times.round(1).tolist(),
        "body": body.round(3).ravel().tolist(),
        "hands": INSIDE * len(times),
        "objects": {},
        "hud": [(0, _HUD)],
        "markers": [],
        "shown": [(0, [])],
        "moments": sorted(moments, key=lambda moment: moment["t"]),
        "plans": [],
        "pictures": {},
    }
