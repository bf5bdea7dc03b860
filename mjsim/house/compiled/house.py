"""Compile houses and prepare their object models for scenes.

The walkable floor is computed by another installed package, because navigation meshes belong to the planner,
which `mjsim` must not import. This module defines the protocol and loads the entry point `mjsim.navigable`.
"""

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
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap, object_places, receptacle_geometries
from mjsim.values.errors import AssetError, SamplingError

VISUAL_BODY = "looks"  # name of the body that contains an object's visual geoms
TIMESTEP = 0.004
SLEEP_TOLERANCE = 0.05
MAX_HOUSES = 4  # maximum number of cached houses; each needs about 30 MB
T = TypeVar("T")
GROUP = "mjsim.navigable"  # entry point group of packages that compute walkable floors


class NavigablePoints(Protocol):
    """Protocol of a walkable floor from which points can be sampled. Points are (x, y) in metres."""

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw a random point (2,) from a uniform distribution over the reachable floor."""

    def is_navigable(self, point: ArrayLike) -> bool:
        """Return True if a person can stand at this point (2,)."""

    def snap(self, point: ArrayLike, max_distance: float) -> NDArray[np.float64]:
        """Return the point (2,) of the reachable floor that is nearest to `point` (2,)."""


class NavigableFloor(NavigablePoints, Protocol):
    """Protocol for walkable floors that also provide a map of their regions."""

    @property
    def topdown_map(self) -> NDArray[np.int32]:
        """The region of each cell, shape (rows, columns). The largest region is 0, and obstacles are -1."""


class NavigableBuilder(Protocol):
    """Protocol of a function that computes the walkable floor of a house."""

    def __call__(self, obstacles: Sequence[ArrayLike], bounds: Sequence[float], /) -> NavigableFloor:
        """Compute the floor within (x_min, y_min, x_max, y_max) around convex obstacles (k, 2), in metres."""
        ...


def installed_builder() -> NavigableBuilder:
    """Load the floor builder of an installed package. Raise a SamplingError if no package has one."""
    offers = sorted(entry_points(group=GROUP), key=lambda e: e.name)
    if not offers:
        raise SamplingError(
            f"no installed package offers the entry point {GROUP!r}, without which no house can be sampled; "
            "install the project (pip install -e .), pass navigable=..., or pass episodes=[...] sampled before"
        )
    try:
        builder: NavigableBuilder = offers[0].load()
    except (ImportError, AttributeError) as error:
        raise SamplingError(f"cannot load {offers[0].value!r}, which offers {GROUP!r}: {error}") from error
    return builder


def remove_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Remove visual geoms, materials, textures and unused meshes from a model in place.

    The bodies are kept, so that models with and without visual geoms have the same state layout.
    """
    spec.compiler.discardvisual = True
    spec.compile()
    return spec


def separate_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Move an object's visual geoms to a separate body that is fixed to the object, in place.

    This makes physics steps faster, because the broad phase visits every geom of a body that can collide,
    even while the body sleeps. Geoms in nested frames are not moved.
    """
    body = spec.body("object")
    groups: list[tuple[Any, list[Any]]] = []
    for geom in body.geoms:
        is_visual = not geom.contype and not geom.conaffinity and geom.mass == 0.0
        if not is_visual or (geom.frame and geom.frame.frame):
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
        _move(spec, geoms, _add_frame_like(body, frame), apart)
    return spec


def _add_frame_like(body: Any, frame: Any) -> Any:
    new = body.add_frame()
    if frame is not None:
        new.pos, new.quat = frame.pos, frame.quat
        for name in ("axisangle", "xyaxes", "zaxis", "euler", "type"):
            setattr(new.alt, name, getattr(frame.alt, name))
    return new


def _move(spec: mujoco.MjSpec, geoms: list[Any], frame: Any, body: Any) -> None:
    names = [geom.name for geom in geoms]
    before = len(body.geoms)
    for geom in geoms:
        geom.name = (
            ""  # Attaching a frame copies its geoms, and the copies must not have names that are in use.
        )
        geom.set_frame(frame)
    body.attach_frame(frame, "", "")
    spec.delete(frame)
    for geom, name in zip(body.geoms[before:], names, strict=True):
        geom.name = name


class CompiledHouse:
    """A compiled house with its receptacles, but without objects or a person.

    Instances from `compiled_house` are shared and must not be changed.
    """

    def __init__(self, catalogue: Catalogue) -> None:
        self.catalogue = catalogue
        self._derived: dict[Any, Any] = {}

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled model. Raises an AssetError if a file is malformed or a receptacle has no mount."""
        with compile_errors(f"house {self.catalogue.house_path}"):
            return self._spec.copy().compile()

    @cached_property
    def data(self) -> mujoco.MjData:
        data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, data)
        return data

    @cached_property
    def rooms(self) -> RoomMap:
        return RoomMap.from_model(self.model, self.catalogue.rooms)

    @cached_property
    def receptacles(self) -> dict[str, ReceptacleGeometry]:
        return receptacle_geometries(self.model, self.catalogue.receptacles)

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """The places on furniture where objects can lie, in metres, shape (k, 3). Most houses have none."""
        return object_places(self.model, self.data)

    @cached_property
    def floor(self) -> Footprint:
        return footprint(self.model)

    @cached_property
    def navigable(self) -> NavigableFloor:
        """The walkable floor. Raises a SamplingError if no floor builder is installed."""
        return installed_builder()(self.floor.obstacles, self.floor.bounds)

    def spec(self, *, visuals: bool = True) -> mujoco.MjSpec:
        """Return an editable copy with merged static bodies, and with visual geoms if `visuals` is True."""
        return (self._fused if visuals else self._collision).copy()

    def object_spec(self, path: Path, *, visuals: bool = True) -> mujoco.MjSpec:
        if visuals:
            return self.cached((path, True), lambda: separate_visuals(read_model(path, body="object")))
        whole = self.object_spec(path)
        return self.cached((path, False), lambda: remove_visuals(whole.copy()))

    def cached(self, key: Any, compute: Callable[[], T]) -> T:
        """Return the value cached under `key`. Call `compute` on the first use."""
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
            for number, geom in enumerate(child.geoms):
                geom.name = geom.name or f"#{number}"  # the prefix of the name identifies the receptacle
            with compile_errors(f"house {path} with the receptacle {receptacle.path}"):
                spec.attach(child, prefix=f"{key}/", site=mount)
        _set_options(spec)
        spec.dedup_assets()
        return spec

    @cached_property
    def _fused(self) -> mujoco.MjSpec:
        spec = self._spec.copy()
        # The broad phase visits every body of the house in every step. If all static bodies are merged into
        # one, a step takes a quarter of the time. Compiling merges the bodies of the spec too, and thus those
        # of scenes that are made from it.
        spec.compiler.fusestatic = True
        with compile_errors(f"house {self.catalogue.house_path}"):
            spec.compile()
        return spec

    @cached_property
    def _collision(self) -> mujoco.MjSpec:
        return remove_visuals(self._fused.copy())


@functools.lru_cache(maxsize=MAX_HOUSES)
def compiled_house(catalogue: Catalogue) -> CompiledHouse:
    """Return the compiled house of a catalogue. Catalogues with equal contents share a compiled house.

    Models are read and compiled on first use.
    """
    return CompiledHouse(catalogue)


def navigable_floor(catalogue: Catalogue) -> NavigableFloor:
    """Return the walkable floor of a house, which is computed on first use.

    Raises:
        SamplingError: No builder is installed, or it cannot be loaded.
        AssetError: The house cannot be compiled.
    """
    return compiled_house(catalogue).navigable


@contextmanager
def compile_errors(what: str) -> Iterator[None]:
    """Convert MuJoCo's compile errors into an AssetError about `what`."""
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
    # Disable the automatic reset, which would hide a diverged simulation. `World` raises an error instead.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
