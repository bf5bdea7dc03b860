"""A house compiled once per process and content, and object models made ready for its scenes."""

import functools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.model_files import read_model
from mjsim.house.compiled.footprint import Footprint, footprint
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap, receptacle_geometries
from mjsim.values.errors import AssetError, SamplingError

VISUAL_BODY = "looks"  # body of an object's visual geoms
TIMESTEP = 0.004
SLEEP_TOLERANCE = 0.05
MAX_HOUSES = 4  # kept in memory, some 30 MB each
T = TypeVar("T")
GROUP = "mjsim.navigable"


class NavigablePoints(Protocol):
    """What sampling needs to know of the floor; points are (x, y) in m."""

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """A point (2,) drawn uniformly from the part of the floor that a person can walk over."""

    def is_navigable(self, point: ArrayLike) -> bool:
        """Whether a person can stand at a point (2,)."""

    def snap(self, point: ArrayLike, max_distance: float) -> NDArray[np.float64]:
        """The nearest point (2,) that `sample` could draw: the point itself if it is one."""


class NavigableFloor(NavigablePoints, Protocol):
    """The navigable floor of a house, with a map for users."""

    @property
    def topdown_map(self) -> NDArray[np.int32]:
        """The floor from above, shape (rows, columns): 0 where one can walk, -1 where not, else an island's number."""


class NavigableBuilder(Protocol):
    """Makes the navigable floor of a house."""

    def __call__(self, obstacles: Sequence[ArrayLike], bounds: Sequence[float], /) -> NavigableFloor:
        """Compute where one can walk among convex polygons (vertices, 2), m, within (x_min, y_min, x_max, y_max), m."""
        ...


def installed_builder(group: str = GROUP) -> NavigableBuilder:
    """The builder that an installed package registers, of several the first by name; `SamplingError` without one."""
    offers = sorted(entry_points(group=group), key=lambda e: e.name)
    if not offers:
        raise SamplingError(
            f"no installed package offers the entry point {group!r}, without which no house can be sampled; "
            "install the project (pip install -e .), pass navigable=..., or pass episodes=[...] sampled before"
        )
    try:
        builder: NavigableBuilder = offers[0].load()
    except (ImportError, AttributeError) as error:
        raise SamplingError(f"cannot load {offers[0].value!r}, which offers {group!r}: {error}") from error
    return builder


def remove_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Remove what has no effect on motion, in place: geoms that meet nothing, materials, textures, unused meshes.

    Bodies stay, so that a state fits the models with and without visuals.
    """
    spec.compiler.discardvisual = True
    spec.compile()
    return spec


def separate_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Give the visual geoms of an object a body of their own, fixed to the object's, in place.

    In every step the broad phase visits all geoms of every body that can collide, asleep or not. Geoms in nested
    frames stay where they are.
    """
    body = spec.body("object")
    groups: list[tuple[Any, list[Any]]] = []
    for geom in body.geoms:
        if not _is_visual(geom) or (geom.frame and geom.frame.frame):
            continue
        group = next((members for frame, members in groups if frame == geom.frame), None)
        if group is None:
            groups.append((geom.frame, group := []))
        group.append(geom)
    if body.bodies or not groups:
        return spec
    spec.copy_during_attach = True
    apart = body.add_body(name=VISUAL_BODY)
    apart.fuse = 0
    for frame, geoms in groups:
        _move(spec, geoms, _like(body, frame), apart)
    return spec


def _like(body: Any, frame: Any) -> Any:
    """A new frame of a body, placed as another one; None is none at all."""
    new = body.add_frame()
    if frame is not None:
        new.pos, new.quat = frame.pos, frame.quat
        for name in ("axisangle", "xyaxes", "zaxis", "euler", "type"):
            setattr(new.alt, name, getattr(frame.alt, name))
    return new


def _move(spec: mujoco.MjSpec, geoms: list[Any], frame: Any, body: Any) -> None:
    """Move geoms into a frame of their body, and that frame into another body."""
    names = [geom.name for geom in geoms]
    before = len(body.geoms)
    for geom in geoms:
        geom.name = ""  # while there are two of it
        geom.set_frame(frame)
    body.attach_frame(frame, "", "")
    spec.delete(frame)
    for geom, name in zip(body.geoms[before:], names, strict=True):
        geom.name = name


def _is_visual(geom: Any) -> bool:
    return not geom.contype and not geom.conaffinity and geom.mass == 0.0


class CompiledHouse:
    """A house and its receptacles, compiled, without misplaced objects and without a person.

    Obtain it from `compiled_house`. All users share what it holds; do not change it.
    """

    def __init__(self, catalogue: Catalogue) -> None:
        self.catalogue = catalogue
        self._derived: dict[Any, Any] = {}

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled house; `AssetError` where a model is malformed or a mount is missing."""
        with compile_errors(f"house {self.catalogue.house_path}"):
            return self._spec.copy().compile()

    @cached_property
    def data(self) -> mujoco.MjData:
        """Its state, in which nothing moves."""
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        return data

    @cached_property
    def rooms(self) -> RoomMap:
        """Which room a point lies in."""
        return RoomMap.from_model(self.model, self.catalogue.rooms)

    @cached_property
    def receptacles(self) -> dict[str, ReceptacleGeometry]:
        """Receptacle key -> its geometry."""
        return receptacle_geometries(self.model, self.catalogue.receptacles)

    @cached_property
    def floor(self) -> Footprint:
        """Obstacles and bounds of the floor."""
        return footprint(self.model)

    @cached_property
    def navigable(self) -> NavigableFloor:
        """Where one can walk, by the installed builder; `SamplingError` where there is none."""
        return installed_builder()(self.floor.obstacles, self.floor.bounds)

    def spec(self, *, visuals: bool = True) -> mujoco.MjSpec:
        """An editable copy, with all static bodies fused into one; `visuals` are geoms that meet nothing."""
        return (self._fused if visuals else self._collision).copy()

    def object_spec(self, path: Path, *, visuals: bool = True) -> mujoco.MjSpec:
        """An object model from its MJCF file, for attaching, with or without what is only drawn."""
        if visuals:
            return self.once((path, True), lambda: separate_visuals(read_model(path, body="object")))
        whole = self.object_spec(path)
        return self.once((path, False), lambda: remove_visuals(whole.copy()))

    def once(self, key: Any, compute: Callable[[], T]) -> T:
        """What `compute` returned at the first call with `key`."""
        if key not in self._derived:
            self._derived[key] = compute()
        return cast(T, self._derived[key])

    @cached_property
    def _spec(self) -> mujoco.MjSpec:
        path = self.catalogue.house_path
        spec = read_model(path)
        spec.copy_during_attach = True
        for key, receptacle in self.catalogue.receptacles.items():
            mount = spec.site(f"mount:{key}")
            if mount is None:
                raise AssetError(f"{path} has no site 'mount:{key}'; add one")
            child = read_model(receptacle.path, body="receptacle")
            with compile_errors(f"house {path} with the receptacle {receptacle.path}"):
                spec.attach(child, prefix=f"{key}/", site=mount)
        _set_options(spec)
        spec.dedup_assets()
        return spec

    @cached_property
    def _fused(self) -> mujoco.MjSpec:
        spec = self._spec.copy()
        # The broad phase visits every body of the house in every step; as one body it steps four times as fast.
        # Compiling fuses the bodies of the spec itself, so a scene made from it need not do it again.
        spec.compiler.fusestatic = True
        with compile_errors(f"house {self.catalogue.house_path}"):
            spec.compile()
        return spec

    @cached_property
    def _collision(self) -> mujoco.MjSpec:
        return remove_visuals(self._fused.copy())


@functools.lru_cache(maxsize=MAX_HOUSES)
def compiled_house(catalogue: Catalogue) -> CompiledHouse:
    """The compiled house of a catalogue: one per process for all catalogues of the same content.

    A file that changes on disk changes the content of the next catalogue that is loaded, and so gives a new model.

    Nothing is read or compiled before it is used.
    """
    return CompiledHouse(catalogue)


def navigable_floor(catalogue: Catalogue) -> NavigableFloor:
    """Where one can walk in a house, computed once per process by the installed builder.

    Raises:
        SamplingError: No builder is installed, or it cannot be loaded.
        AssetError: The house does not compile.
    """
    return compiled_house(catalogue).navigable


@contextmanager
def compile_errors(what: str) -> Iterator[None]:
    """Turn MuJoCo's errors into an `AssetError` that names `what` does not compile and says what to do."""
    try:
        yield
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise AssetError(
            f"{what} does not compile: {reason}; correct that element in the MJCF file "
            "(python -m mujoco.viewer --mjcf=FILE shows a file on its own)"
        ) from error


def _set_options(spec: mujoco.MjSpec) -> None:
    option = spec.option
    option.timestep = TIMESTEP
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0
    option.sleep_tolerance = SLEEP_TOLERANCE
    option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    # A silent reset would hide a blow-up; the world turns the warning into an error.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
