"""Compile an episode into a MuJoCo model with the house, its receptacles, the objects and the person."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar, cast

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compile_errors, compiled_house
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap
from mjsim.house.scene.avatar import attach_avatar
from mjsim.house.scene.episode_rules import check_fit, check_overlaps, check_poses
from mjsim.house.validation.findings import Finding, errors, one_line
from mjsim.house.validation.validate import require_usable
from mjsim.values.episode import Episode, PlacedObject
from mjsim.values.errors import AssetError, EpisodeError
from mjsim.values.person_parameters import PersonParameters

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class SceneIndex:
    """The positions of an episode's objects in the arrays of `MjModel` and `MjData`."""

    names: tuple[str, ...]  # names of the objects, in the order of the episode
    bodies: NDArray[np.int32]  # body id of each object, shape (n,)
    qpos: NDArray[np.int32]  # start of each object's position and quaternion in `qpos`, shape (n,)
    dofs: NDArray[np.int32]  # start of each object's linear and angular velocity in `qvel`, shape (n,)
    trees: NDArray[np.int32]  # kinematic tree id of each object, to check if it sleeps, shape (n,)
    geom_owner: NDArray[np.int32]  # index of the object to which each geom belongs, or -1, shape (ngeom,)
    _rows: NDArray[np.intp] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_rows", self.qpos[:, None].astype(np.intp) + np.arange(7))

    @classmethod
    def from_model(cls, model: mujoco.MjModel, names: tuple[str, ...]) -> "SceneIndex":
        """Create the index of a compiled model. Raise an AssetError if an object is missing."""
        bodies = np.array([find_id(model, mujoco.mjtObj.mjOBJ_BODY, f"{n}/object") for n in names], np.int32)
        joints = np.array([find_id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{n}/free") for n in names], np.int32)
        owner_of_body = np.full(model.nbody, -1, np.int32)
        for position, body in enumerate(bodies):
            owner_of_body[model.body_rootid == body] = position
        return cls(
            names=names,
            bodies=bodies,
            qpos=model.jnt_qposadr[joints].astype(np.int32),
            dofs=model.jnt_dofadr[joints].astype(np.int32),
            trees=model.body_treeid[bodies].astype(np.int32),
            geom_owner=owner_of_body[model.geom_bodyid],
        )

    def position_of(self, name: str) -> int:
        """Return the index of the object with this name. Raise an EpisodeError if the name is unknown."""
        try:
            return self.names.index(name)
        except ValueError:
            raise EpisodeError(f"no object {name!r} in the scene; it has {list(self.names)}") from None

    def body(self, name: str) -> int:
        """Return the body id of the object with this name. Raise an EpisodeError if the name is unknown."""
        return int(self.bodies[self.position_of(name)])

    def geoms(self, name: str) -> NDArray[np.intp]:
        """Return the geom ids of the object with this name. Raise an EpisodeError if the name is unknown."""
        return np.flatnonzero(self.geom_owner == self.position_of(name))

    def poses(self, qpos: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return copies of all object positions (n, 3), in metres, and wxyz quaternions (n, 4) in `qpos`."""
        rows = qpos[self._rows]
        return rows[:, :3], rows[:, 3:]


@dataclass(frozen=True, eq=False)
class Scene:
    """The compiled MuJoCo model of an episode, with the data from which it was built.

    Attributes:
        model: The compiled model. Its `qpos0` contains the poses of the episode.
        index: Positions of the objects in the arrays of the model.
        spec: Editable version of the model, for export.
        visuals: True if the model contains geoms that are only drawn.
    """

    model: mujoco.MjModel
    episode: Episode
    catalogue: Catalogue
    index: SceneIndex
    rooms: RoomMap
    receptacles: Mapping[str, ReceptacleGeometry]
    spec: mujoco.MjSpec
    person: PersonParameters
    visuals: bool
    _derived: dict[str, object] = field(init=False, repr=False, default_factory=dict)

    def cached(self, key: str, make: Callable[[], T]) -> T:
        """Return the value cached under `key`. Compute it with `make` on the first call."""
        if key not in self._derived:
            self._derived[key] = make()
        return cast(T, self._derived[key])

    def counterpart(self, *, visuals: bool) -> "Scene":
        """Return the scene of this episode with or without visual geoms. Both have the same state layout."""
        if visuals == self.visuals:
            return self
        return self.cached(
            "counterpart", lambda: assemble(self.episode, self.catalogue, person=self.person, visuals=visuals)
        )


def compose(
    episode: Episode,
    catalogue: Catalogue,
    *,
    person: PersonParameters | None = None,
    avatar: bool = True,
    visuals: bool = True,
) -> Scene:
    """Check an episode and compile its scene with the house, the receptacles, the objects and the person.

    Args:
        episode: Episode to compile.
        catalogue: Catalogue of the episode's house.
        person: Parameters of the person. By default, a person with default parameters.
        avatar: False to leave out the person's body.
        visuals: False to leave out geoms that are only drawn. The scene then has the same physics, and
            compiles and steps faster, but it cannot be rendered.

    Raises:
        AssetError: The house violates a convention of docs/models.md, or a model does not compile.
        EpisodeError: The episode does not match the catalogue, or it starts with an object or the person
            outside the house or overlapping something else.
    """
    _require(check_fit(episode, catalogue), episode)
    if avatar:  # Scenes without a person are for dropping objects, whose poses are not final.
        _require(check_poses(episode, compiled_house(catalogue).rooms), episode)
    scene = assemble(episode, catalogue, person=person, avatar=avatar, visuals=visuals)
    if avatar:
        _require(check_overlaps(episode, scene.model, scene.index.geom_owner), episode)
    return scene


def assemble(
    episode: Episode,
    catalogue: Catalogue,
    *,
    person: PersonParameters | None = None,
    avatar: bool = True,
    visuals: bool = True,
) -> Scene:
    """Compile the scene of an episode without checking the episode. See `compose` for the arguments."""
    person = person or PersonParameters()
    house = compiled_house(catalogue)
    require_usable(house)
    spec = house.spec(visuals=visuals)
    spec.copy_during_attach = True
    names = tuple(o.name for o in episode.objects)
    with compile_errors(f"episode {episode.seed} of house {catalogue.house_path}"):
        for placed in episode.objects:
            model = house.object_spec(catalogue.objects[placed.model].path, visuals=visuals)
            _attach_object(spec, model, placed)
        if avatar:
            start = episode.start
            attach_avatar(spec, names, start=(start.x, start.y, start.heading), person=person)
        spec.dedup_assets()  # merge the assets, which were copied for every attached object
        model = spec.compile()
    return Scene(
        model=model,
        episode=episode,
        catalogue=catalogue,
        index=SceneIndex.from_model(model, names),
        rooms=house.rooms,
        receptacles=house.receptacles,
        spec=spec,
        person=person,
        visuals=visuals,
    )


def _require(findings: Iterable[Finding], episode: Episode) -> None:
    if found := errors(findings):
        raise EpisodeError(one_line(found, f"episode {episode.seed} of {episode.house}"))


def _attach_object(spec: mujoco.MjSpec, model: mujoco.MjSpec, placed: PlacedObject) -> None:
    spec.attach(model, prefix=f"{placed.name}/", frame=spec.worldbody.add_frame())
    body = spec.body(f"{placed.name}/object")
    body.pos = placed.position
    body.quat = placed.quaternion
    body.add_freejoint(name=f"{placed.name}/free")


def find_id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """Return the id of a named part of a scene. Raise an AssetError if the model has no such part."""
    found = int(mujoco.mj_name2id(model, kind, name))
    if found < 0:
        raise AssetError(
            f"the model has no {kind.name} {name!r}; compose it from an episode, with avatar=True"
        )
    return found
