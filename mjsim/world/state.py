"""What makes a run repeatable: state hashes, checkpoints, and the versions that determine the physics.

With sleep on, MuJoCo's state vector does not say which bodies sleep, so setting it on live data is not exact. Setting
it after `mj_resetData` is. A run therefore passes through a checkpoint itself: it takes the state, resets, and sets
it again. From then on it and a run that starts at the checkpoint are the same, bit for bit. Between checkpoints the
physics is left alone. A pick or place under way is a generator, which no value can hold, so checkpoints are taken
only while the world is not busy.
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

CHECKPOINT_PERIOD = 10.0  # s at least from one checkpoint to the next

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_HASHED = int(
    mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_EQ_ACTIVE
)
# Looks only: textures, colours, the renderer's share of meshes and cameras. Names and paths do not matter either.
_LOOKS = (
    "tex_", "mat_", "light_", "cam_", "skin_", "mesh_normal", "mesh_texcoord", "mesh_facenormal", "name_",
)  # fmt: skip
_LOOKS_ANYWHERE = ("rgba", "matid", "facetexcoord", "texcoord", "path", "names_map", "signature")
_NO_PHYSICS = ("render", "environments")  # folders of mjsim that no state depends on


@dataclass(frozen=True, eq=False)
class PersonState:
    """Commands, grips and compliance of the person where physics moves it."""

    rig: RigState  # commands of the servos
    grips: GripState  # object and grip in each hand
    carrying: CarryingState  # compliance offsets and strain of the hands
    hand_velocities: NDArray[np.float64]  # of the hands' targets, m/s, (2, 3)


@dataclass(frozen=True, eq=False)
class StateDetails:
    """The part of a world's state that is not physics."""

    hands: tuple[str | None, str | None]  # object in the left and the right hand
    status: tuple[ObjectStatus, ...]  # status per object
    health: HealthState  # what the health monitor has accumulated
    person: PersonState | None  # the person's commands; None in a state without physics


@dataclass(frozen=True, eq=False)
class WorldState:
    """The complete state of a world between two motions."""

    physics: NDArray[np.float64]  # MuJoCo's integration state, or that of a world without physics, (n,)
    details: StateDetails  # everything else

    @property
    def hash(self) -> int:
        """64 bits that differ whenever two states do (up to chance)."""
        return checkpoint_hash(self.physics, self.details_json())

    def details_json(self) -> str:
        """The details as JSON, in which numbers keep their full precision."""
        return json.dumps(msgspec.to_builtins(self.details, enc_hook=np.ndarray.tolist))

    @classmethod
    def from_json(cls, physics: NDArray[np.float64], details: str) -> "WorldState":
        """The state of `physics`, shape (n,), and of what `details_json` gave; `StateError` for anything else."""
        try:
            values = json.loads(details)
            return cls(physics, msgspec.convert(values, StateDetails, dec_hook=lambda _, a: np.array(a)))
        except (ValueError, TypeError) as error:  # of JSON, of msgspec and of arrays
            raise StateError(f"the state's details do not fit this version's worlds: {error}") from error


def checkpoint_hash(physics: NDArray[np.float64], details: str) -> int:
    """Hash of a state of `physics`, shape (n,), and `WorldState.details_json`."""
    return hash64(physics.tobytes() + details.encode())


class StateHash:
    """Hashes the state of one simulation: time, positions, velocities, activations, commands, active welds."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._buffer = np.zeros(mujoco.mj_stateSize(model, _HASHED))

    def of(self, data: mujoco.MjData) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        mujoco.mj_getState(self._model, data, self._buffer, _HASHED)
        return hash64(self._buffer.data)


def hash64(content: Any) -> int:
    """The first 64 bits of the SHA-1 of some bytes: a checksum against accidents, not against forgery."""
    return int.from_bytes(hashlib.sha1(content, usedforsecurity=False).digest()[:8], "little")


def take_physics(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """MuJoCo's integration state, shape (n,)."""
    physics = np.zeros(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, physics, _STATE)
    return physics


def set_physics(model: mujoco.MjModel, data: mujoco.MjData, physics: NDArray[np.float64]) -> None:
    """Reset the data and set it to a state of `take_physics`, shape (n,), whatever it was before.

    `StateError` where the state is of another model, or not finite.
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
    """16 hex digits over everything in a compiled model that affects the physics; looks are left out."""
    digest = hashlib.sha256()
    for part in (model, model.opt):
        for name in sorted(n for n in dir(part) if not n.startswith("_") and not _is_looks(n)):
            value = getattr(part, name)
            if isinstance(value, np.ndarray):
                digest.update(f"{name}{value.dtype}{value.shape}".encode())
                digest.update(np.ascontiguousarray(value).data)
            elif isinstance(value, bool | int | float):
                digest.update(f"{name}{value!r}".encode())
    return digest.hexdigest()[:16]


def engine_versions() -> dict[str, str]:
    """Versions of everything that determines how a state follows from the one before."""
    return {
        "mjsim": _own_version(),
        "physics_code": _code_fingerprint(),
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "machine": platform.machine(),
    }


def _is_looks(name: str) -> bool:
    counts_looks = name.startswith(("ntex", "nmat", "nlight", "ncam", "nskin", "nname", "npath", "nbuffer"))
    return counts_looks or name.startswith(_LOOKS) or any(part in name for part in _LOOKS_ANYWHERE)


def _own_version() -> str:
    try:
        return version("mjsim")
    except PackageNotFoundError:
        return "unknown"


@functools.cache
def _code_fingerprint() -> str:
    """16 hex digits over the source of this package, since a version may span many changes."""
    root = Path(__file__).parents[1]
    return digest_of(*(place for place in sorted(root.iterdir()) if place.name not in _NO_PHYSICS))
