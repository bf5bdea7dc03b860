"""The states of a session for a client that draws: what it may know, and of that what has changed."""

import logging
from collections.abc import Iterable

import numpy as np

from experiments.web.protocol import Gait, Scene, Snapshot, Speeds
from experiments.web.worker.houses import scene_files
from experiments.web.worker.live_session import LiveSession
from mjsim.errors import AssetError
from mjsim.fidelity import kinematics
from mjsim.model.foresight import Foresight
from mjsim.observation import Observation

LOG = logging.getLogger("mjsim.play")
HORIZON = 0.3  # s of walking and turning that may bring an object into view, from which on it is known
LINGERING = 25  # control steps for which it stays known after it no longer can
METRES, QUATERNIONS = 4, 4  # decimals of positions and orientations


def scene_of(live: LiveSession) -> Scene:
    """Where the files of a session's scene are, and how its person moves."""
    person, options = live.scene.person, live.world.options
    path: str | None
    floor: str | None
    try:
        path, floor = scene_files(live.house)
    except (AssetError, OSError) as error:
        LOG.warning("no browser can draw %s: %s", live.config.house, error)
        path = floor = None
    return Scene(
        path,
        floor if live.config.fidelity == "event" else None,
        Gait(**kinematics.Gait.of(live.scene, options)._asdict()),
        Speeds(person.walking_speed, person.turning_speed, person.looking_speed),
        person.field_of_view,
        options.control_timestep,
    )


class SnapshotStream:
    """Snapshots of a session for a client that has seen none yet; its view has some width over height."""

    def __init__(self, live: LiveSession, aspect: float) -> None:
        self._live, self._aspect = live, aspect
        self._foresight = Foresight(live.scene, HORIZON)
        self._until: dict[str, int] = {}  # control steps before which an object stays known
        self._models = {item.name: item.model for item in live.scene.episode.objects}
        self._sent: dict[str, list[float]] = {}

    def next(self, seen: Observation, step: int) -> Snapshot:
        """The snapshot of the state before a control step."""
        world = self._live.world
        poses, known = _poses(seen), self._known(seen, step)
        entered = [name for name in known if name not in self._sent]
        gone = [name for name in self._sent if name not in known]
        changed = {name: poses[name] for name in known if self._sent.get(name) != poses[name]}
        self._sent = {name: poses[name] for name in known}
        left, right = seen.hands
        return Snapshot(
            step=step,
            input=self._live.input,
            time=round(seen.time, 6),
            busy=seen.busy,
            body=world.body.tolist(),
            eye=_rounded([*seen.eye, seen.heading, seen.pitch]),
            hands=np.round(world.hands, METRES).tolist(),
            held=(left, right),
            objects=changed,
            models={name: self._models[name] for name in entered},
            gone=gone,
        )

    def _known(self, seen: Observation, step: int) -> tuple[str, ...]:
        """Names of the objects that the client may know, in the episode's order."""
        soon = self._foresight.may_see(seen, self._aspect)
        for name, may_see in zip(seen.object_names, soon.tolist(), strict=True):
            if may_see or name in seen.hands:
                self._until[name] = step + LINGERING
        return tuple(name for name in seen.object_names if self._until.get(name, 0) > step)


def _poses(seen: Observation) -> dict[str, list[float]]:
    """Rounded poses of all objects by name."""
    poses = np.hstack(
        (np.round(seen.object_positions, METRES), np.round(seen.object_quaternions, QUATERNIONS))
    )
    return dict(zip(seen.object_names, poses.tolist(), strict=True))


def _rounded(values: Iterable[float]) -> list[float]:
    return [round(float(value), METRES) for value in values]
