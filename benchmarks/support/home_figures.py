"""Measure a generated home: its files, the geometry of its model, and the rooms and doors in its recipe."""

import hashlib
import itertools
import json
import math
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from benchmarks.support.home_interiors import interior
from mjsim.formats.gltf.export import HOUSE, export_scene
from mjsim.formats.gltf.store import SCENE
from mjsim.generator.files import house_files
from mjsim.generator.generated import generate
from mjsim.generator.programme import NEEDS
from mjsim.generator.recipe import RECIPE, read_recipe
from mjsim.generator.values import WALL, Door, HomePlan, Window
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import CATALOGUE, models_root
from mjsim.house.check import check_house_name
from mjsim.house.compiled.footprint import ClearanceField
from mjsim.house.compiled.house import CompiledHouse, compiled_house

DRAWN = 10  # every tenth home is exported for the browser to count its draw calls
CELL = 0.0125  # size of a grid cell in metres
BAND = (0.05, 1.8)  # heights between which furniture is an obstacle for a person, in metres
WAY = 0.70  # required width of the way to furniture, in metres
USUAL, LARGE = (
    0.50,
    0.58,
)  # body widths of default and large people (radii 0.20 and 0.24 m) plus 0.05 m clearance, in metres
POCKET = 0.01  # pockets of the floor up to this area in m2 are ignored
REACH = 0.60  # largest distance at which a person can use furniture, in metres
BEFORE_WINDOW = 0.5  # depth of the zone in front of a window, in metres
HEIGHTS, ACROSS = (0.1, 0.5, 1.0, 1.5, 1.9), (-0.15, -0.05, 0.0, 0.05, 0.15)  # positions of rays in metres
SOLID = np.array([1, 0, 0, 1, 0, 0], np.uint8)  # geom groups that rays can hit
UNUSED = ("radiator", "floor_lamp", "bush", "tree", "snake_plant", "palm", "cactus", "fern_stand")
KITCHENS = ("straight_kitchen", "corner_kitchen")  # kitchens with a sink, a cooker and a fridge
SEATS = {"sofa": 2, "corner_sofa": 4, "bench": 2} | dict.fromkeys(
    ("armchair", "dining_chair", "stool", "bar_stool", "office_chair", "pouf"), 1
)
BEDS = ("double_bed", "single_bed", "bunk_bed")
THINGS: Mapping[str, tuple[str, ...]] = {
    "toilet": ("toilet",),
    "washbasin": ("washbasin",),
    "bath or shower": ("bathtub", "shower"),
    "cooker and sink": (*KITCHENS, "kitchenette"),
    "fridge": (*KITCHENS, "fridge"),
    "table": ("table", "round_table", "bar_table"),
}


def figures(home: tuple[int, int]) -> dict[str, Any]:
    """Return all measurements of the home with the given (rooms, seed), as JSON-ready data."""
    about: dict[str, Any] = {"rooms": home[0], "seed": home[1], "draws": None}
    try:
        files, about["make_s"] = _made(home)
        with tempfile.TemporaryDirectory() as folder:
            for name, content in files.items():
                (Path(folder) / name).parent.mkdir(exist_ok=True)
                (Path(folder) / name).write_bytes(content)
            start = time.process_time()
            report = check_house_name(str(Path(folder) / CATALOGUE))
            about["check_s"] = time.process_time() - start
            catalogue = Catalogue.load(str(Path(folder) / CATALOGUE))
            plan = read_recipe(Path(folder) / RECIPE).plan
            if home[1] % DRAWN == 0:
                scene = json.loads(export_scene(catalogue)[SCENE])
                about["draws"] = scene["sizes"][HOUSE]["draw_calls"]
            house = compiled_house(catalogue)
            measured = _Home(house, plan).figures() | interior(house, plan)
    except Exception as error:  # any error makes the home unusable
        return {**about, "failure": f"{type(error).__name__}: {error}"}
    return {
        **about,
        "digest": _digest(files),
        "errors": [str(f) for f in report.findings if f.severity == "error"],
        "warnings": [str(f) for f in report.findings if f.severity != "error"],
        **measured,
    }


def remade(home: tuple[int, int]) -> str:
    return _digest(_made(home)[0])


def _made(home: tuple[int, int]) -> tuple[Mapping[str, bytes], float]:
    """Return the files of a home, and the CPU time in seconds for its plan and furniture."""
    start = time.process_time()
    recipe, furnishing = generate(home[1], home[0])
    seconds = time.process_time() - start
    return house_files(recipe, furnishing, models_root()), seconds


def _digest(files: Mapping[str, bytes]) -> str:
    digests = (name.encode() + hashlib.sha256(files[name]).digest() for name in sorted(files))
    return hashlib.sha256(b"".join(digests)).hexdigest()


@dataclass(frozen=True, eq=False)
class _Piece:
    """A piece of furniture. Bounding boxes are rows of x0, y0, z0, x1, y1, z1 in metres."""

    room: str
    kind: str
    shown: NDArray[np.float64]  # bounding boxes of all geoms, (n, 6)
    solid: NDArray[np.float64]  # bounding boxes of the geoms that are obstacles for a person, (k, 6)
    form: str  # hash of the shapes, positions and colours of all geoms

    @property
    def stands(self) -> bool:
        return bool(self.solid[:, 2].min(initial=math.inf) < 0.5)

    @property
    def size(self) -> tuple[float, ...]:
        """The size rounded to 0.1 m, with the longer horizontal side first."""
        x, y, z = np.round(self.shown[:, 3:].max(axis=0) - self.shown[:, :3].min(axis=0), 1).tolist()
        return max(x, y), min(x, y), z


class _Home:
    """A compiled home with a grid that contains the distance from each floor cell to the nearest obstacle."""

    def __init__(self, house: CompiledHouse, plan: HomePlan) -> None:
        self._model, self._data, self._plan = house.model, house.data, plan
        self._pieces = list(self._all_pieces())
        self._field = ClearanceField.from_model(self._model, low=BAND[0], high=BAND[1], resolution=CELL)
        self._rooms = {r.key: self._cells(r.floor.x0, r.floor.y0, r.floor.x1, r.floor.y1) for r in plan.rooms}

    def figures(self) -> dict[str, Any]:
        plan, standing = self._plan, [piece for piece in self._pieces if piece.stands]
        kinds = Counter(piece.kind for piece in self._pieces)
        floors = [self._field.distance[cells] for cells in self._rooms.values()]
        doorways = [self._clear(door) for door in plan.doors if not door.is_front]
        return {
            "door_graph": _door_graph(plan),
            "area": plan.area,
            "areas_off": [r.key for r in plan.rooms if not _within(r.floor.area, NEEDS[r.key].area)],
            "share": sum(int((floor <= 0).sum()) for floor in floors) / sum(floor.size for floor in floors),
            "empty": sorted(set(self._rooms) - {piece.room for piece in standing}),
            "doorway": min(doorways, default=None),
            "way": self._way(),
            "pockets": self._pockets(),
            "unusable": list(self._unusable(standing)),
            "windows_behind": [
                f"{p.room}: {p.kind}" for w in plan.windows for p in standing if self._hides(p, w)
            ],
            "lacking": list(_lacking(plan, kinds)),
            "kinds": kinds,
            "specimens": sorted(f"{piece.kind} {piece.size}" for piece in self._pieces if len(piece.shown)),
            "armchairs": [piece.form for piece in self._pieces if piece.kind == "armchair"],
            "palette": self._palette(),
        }

    def _all_pieces(self) -> Iterator[_Piece]:
        """Yield all furniture and decoration, whose bodies are named `room/kind_number`."""
        model, data = self._model, self._data
        for body in range(1, model.nbody):
            room, _, name = model.body(body).name.partition("/")
            kind, _, number = name.rpartition("_")
            geoms = np.flatnonzero(model.geom_bodyid == body)
            if not number.isdigit() or not len(geoms):
                continue
            looks = (model.geom_type, model.geom_pos, model.geom_size, model.mat_rgba[model.geom_matid])
            form = np.round(np.column_stack([of[geoms] for of in looks]), 3)
            geoms = geoms[model.geom_type[geoms] != mujoco.mjtGeom.mjGEOM_PLANE]  # drawn shadows do not count
            turns, boxes = data.geom_xmat[geoms].reshape(-1, 3, 3), model.geom_aabb[geoms]
            middles = data.geom_xpos[geoms] + np.einsum("gij,gj->gi", turns, boxes[:, :3])
            halves = np.einsum("gij,gj->gi", np.abs(turns), boxes[:, 3:])
            shown = np.hstack([middles - halves, middles + halves])
            hit = (model.geom_contype[geoms] > 0) & (shown[:, 5] > BAND[0]) & (shown[:, 2] < BAND[1])
            yield _Piece(room, kind, shown, shown[hit], hashlib.sha256(form.tobytes()).hexdigest()[:12])

    def _cells(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        i, u = (round((x - self._field.origin_x) / CELL) for x in (x0, x1))
        j, v = (round((y - self._field.origin_y) / CELL) for y in (y0, y1))
        return slice(max(i, 0), u + 1), slice(max(j, 0), v + 1)

    def _free(self, width: float) -> NDArray[np.bool_]:
        """Return the cells from which a disc of diameter `width` can reach all rooms."""
        islands, _ = label(self._field.distance >= width / 2)
        seen = [set(np.unique(islands[cells]).tolist()) for cells in self._rooms.values()]
        return np.isin(islands, list(set.intersection(*seen) - {0}))

    def _way(self) -> float:
        """Return the diameter in metres of the widest disc that can reach all rooms, up to 1.2 m."""
        low, high = 0, round(1.2 / CELL)
        while low < high:
            middle = (low + high + 1) // 2
            low, high = (middle, high) if self._free(middle * CELL).any() else (low, middle - 1)
        return low * CELL

    def _pockets(self) -> int:
        """Count the areas of the floor that default people can reach but large people cannot."""
        usual, _ = label(self._free(USUAL))
        islands, _ = label((self._field.distance >= LARGE / 2) & (usual > 0))
        return int((np.bincount(islands[islands > 0]) * CELL**2 > POCKET).sum()) - 1

    def _unusable(self, pieces: list[_Piece]) -> Iterator[str]:
        """Yield furniture that is not reachable on a way of width `WAY`, except plants and lamps."""
        free = self._free(WAY - CELL)
        for room, cells in self._rooms.items():
            away = np.full(free.shape, math.inf)
            away[cells] = distance_transform_edt(~free[cells]) * CELL if free[cells].any() else math.inf
            for piece in pieces:
                near = [away[self._cells(x0, y0, x1, y1)].min() for x0, y0, _, x1, y1, _ in piece.solid]
                if piece.room == room and piece.kind not in UNUSED and min(near) > REACH:
                    yield f"{room}: {piece.kind}"

    def _clear(self, door: Door) -> float:
        """Return the clear width of a doorway in metres, measured with rays from its middle to both sides."""
        floor = self._plan.room(door.rooms[0]).floor
        middle = floor.along(door.side, door.center, door.center, -WALL / 2, -WALL / 2).center
        along, across = np.eye(3)[[0, 1] if door.side in ("south", "north") else [1, 0]]
        geom, widths = np.zeros(1, np.int32), []
        for height, beside in itertools.product(HEIGHTS, ACROSS):
            start = np.array([*middle, height]) + beside * across
            rays = [
                mujoco.mj_ray(self._model, self._data, start, s * along, SOLID, 1, -1, geom) for s in (-1, 1)
            ]
            widths.append(sum(ray if ray >= 0 else math.inf for ray in rays))
        return float(min(widths))

    def _hides(self, piece: _Piece, window: Window) -> bool:
        low, high = window.center - window.width / 2, window.center + window.width / 2
        zone = self._plan.room(window.room).floor.along(window.side, low, high, 0.0, BEFORE_WINDOW)
        x0, y0, _, x1, y1, top = piece.shown.T
        inside = (x0 < zone.x1) & (x1 > zone.x0) & (y0 < zone.y1) & (y1 > zone.y0)
        return bool((inside & (top > window.sill + 0.01)).any())

    def _palette(self) -> list[float]:
        names = {self._model.material(i).name: i for i in range(self._model.nmat)}
        found = [names[name] for name in ("wood_a", "wood_b", "front_a", "cloth_a") if name in names]
        return [round(float(v) * 5) / 5 for v in self._model.mat_rgba[found, :3].ravel()]


def _door_graph(plan: HomePlan) -> str:
    """Describe which rooms have doors between them, independently of the numbering of bedrooms."""
    uses = {room.key: room.use for room in plan.rooms} | {"outside": "outside"}
    bedrooms = [key for key, use in uses.items() if use == "bedroom"]
    forms = []
    for order in itertools.permutations(range(len(bedrooms))):
        names = uses | {key: f"bedroom {i}" for key, i in zip(bedrooms, order, strict=True)}
        ways = [sorted(names[room] for room in (*door.rooms, "outside")[:2]) for door in plan.doors]
        forms.append(sorted("-".join(way) for way in ways))
    return ", ".join(min(forms))


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] - 0.01 <= value <= bounds[1] + 0.01


def _lacking(plan: HomePlan, kinds: Counter[str]) -> Iterator[str]:
    bedrooms = sum(room.use in ("bedroom", "studio") for room in plan.rooms)
    if sum(kinds[kind] for kind in BEDS) < bedrooms:
        yield "beds"
    if sum(seats * kinds[kind] for kind, seats in SEATS.items()) < bedrooms + 1:
        yield "seats"
    yield from (thing for thing, of in THINGS.items() if not any(kinds[kind] for kind in of))
