"""State hashes, checkpoints and software versions, which make runs reproducible.

MuJoCo's state vector does not record which bodies are asleep. A state is therefore restored exactly only
after `mj_resetData`. For this reason, a run that takes a checkpoint also resets itself and restores its own
state. From then on, it is bit-identical to a run that starts from the checkpoint. No checkpoint is taken
during a pick or place, because a motion is a Python generator, which cannot be stored.
"""

import functools
import hashlib
import json
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.support.files import digest_of
from mjsim.values.errors import StateError
from mjsim.values.observation import ObjectStatus
from mjsim.world.body.carrying import CarryingState
from mjsim.world.body.grips import GripState
from mjsim.world.body.rig import RigState
from mjsim.world.health.monitor import HealthState

CHECKPOINT_PERIOD = 10.0  # minimum simulated time between checkpoints, in seconds

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_HASHED = int(
    mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_EQ_ACTIVE
)
# Prefixes of model attributes that affect only the appearance, such as textures and colours.
_LOOKS = (
    "tex_", "mat_", "light_", "cam_", "skin_", "mesh_normal", "mesh_texcoord", "mesh_facenormal", "name_",
)  # fmt: skip
_LOOKS_ANYWHERE = ("rgba", "matid", "facetexcoord", "texcoord", "path", "names_map", "signature")
_NO_PHYSICS = ("render", "environments")  # subpackages of mjsim whose code does not affect the physics


@dataclass(frozen=True, eq=False)
class PersonState:
    """The part of a person's state in full physics that MuJoCo does not store."""

    rig: RigState  # commands to the person's servos
    grips: GripState  # object and grip in each hand
    carrying: CarryingState  # compliance of each hand and duration of its strain
    hand_velocities: NDArray[np.float64]  # velocity of each hand's target in m/s, shape (2, 3)


@dataclass(frozen=True, eq=False)
class StateDetails:
    """The part of a world's state that MuJoCo does not store."""

    hands: tuple[str | None, str | None]  # names of the objects in the left and the right hand, or None
    status: tuple[ObjectStatus, ...]  # status of each object
    health: HealthState
    person: PersonState | None  # None for fidelity `event`


@dataclass(frozen=True, eq=False)
class WorldState:
    """The complete state of a world between two motions."""

    physics: NDArray[np.float64]  # MuJoCo's integration state, or the state of a kinematic world, shape (n,)
    details: StateDetails

    @property
    def hash(self) -> int:
        return checkpoint_hash(self.physics, self.details_json())

    def details_json(self) -> str:
        return json.dumps(msgspec.to_builtins(self.details, enc_hook=np.ndarray.tolist))

    @classmethod
    def from_json(cls, physics: NDArray[np.float64], details: str) -> "WorldState":
        """Create a state from `physics` (n,) and the result of `details_json`, or raise a StateError."""
        try:
            values = json.loads(details)
            return cls(physics, msgspec.convert(values, StateDetails, dec_hook=lambda _, a: np.array(a)))
        except (ValueError, TypeError) as error:  # raised by json, msgspec or NumPy
            raise StateError(f"the state's details do not fit this version's worlds: {error}") from error


def checkpoint_hash(physics: NDArray[np.float64], details: str) -> int:
    return hash64(physics.tobytes() + details.encode())


class StateHash:
    """A hash function for the state of a physics simulation, including its commands and active welds."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._buffer = np.zeros(mujoco.mj_stateSize(model, _HASHED))

    def of(self, data: mujoco.MjData) -> int:
        """Return a 64-bit hash of the simulation's state."""
        mujoco.mj_getState(self._model, data, self._buffer, _HASHED)
        return hash64(self._buffer.data)


def hash64(content: Any) -> int:
    """Return the first 64 bits of the SHA-1 hash of `content`, for use as a checksum."""
    return int.from_bytes(hashlib.sha1(content, usedforsecurity=False).digest()[:8], "little")


def take_physics(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the integration state of a MuJoCo simulation, shape (n,)."""
    physics = np.zeros(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, physics, _STATE)
    return physics


def set_physics(model: mujoco.MjModel, data: mujoco.MjData, physics: NDArray[np.float64]) -> None:
    """Reset `data` and set it to a state (n,) that `take_physics` returned.

    Raises:
        StateError: The state belongs to another model, or is not finite.
    """
    size = mujoco.mj_stateSize(model, _STATE)
    if physics.shape != (size,) or not np.isfinite(physics).all():
        raise StateError(
            f"a state of {physics.size} numbers, {np.count_nonzero(~np.isfinite(physics))} of them not finite, does "
            f"not fit this model, whose states have {size}; take it from a world of the same house and objects"
        )
    mujoco.mj_resetData(model, data)
    mujoco.mj_setState(model, data, physics, _STATE)
    warmstart = data.qacc_warmstart.copy()
    mujoco.mj_forward(model, data)
    data.qacc_warmstart[:] = warmstart


def model_fingerprint(model: mujoco.MjModel) -> str:
    """Return a digest (16 hexadecimal digits) of all values in a compiled model that affect the physics."""
    digest = hashlib.sha256()
    for part in (model, model.opt):
        for name in sorted(n for n in dir(part) if not n.startswith("_") and not _is_visual(n)):
            value = getattr(part, name)
            if isinstance(value, np.ndarray):
                digest.update(f"{name}{value.dtype}{value.shape}".encode())
                digest.update(np.ascontiguousarray(value).data)
            elif isinstance(value, bool | int | float):
                digest.update(f"{name}{value!r}".encode())
    return digest.hexdigest()[:16]


def engine_versions() -> dict[str, str]:
    """Return the processor architecture and the versions of all software that affects the physics."""
    return {
        "mjsim": _installed_version(),
        "physics_code": _code_fingerprint(),
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "machine": platform.machine(),
    }


def _is_visual(name: str) -> bool:
    counts_visuals = name.startswith(("ntex", "nmat", "nlight", "ncam", "nskin", "nname", "npath", "nbuffer"))
    return counts_visuals or name.startswith(_LOOKS) or any(part in name for part in _LOOKS_ANYWHERE)


def _installed_version() -> str:
    try:
        return version("mjsim")
    except PackageNotFoundError:
        return "unknown"


@functools.cache
def _code_fingerprint() -> str:
    """Return a digest of mjsim's source code, which may change without a new version number."""
    root = Path(__file__).parents[1]
    return digest_of(*(place for place in sorted(root.iterdir()) if place.name not in _NO_PHYSICS))
