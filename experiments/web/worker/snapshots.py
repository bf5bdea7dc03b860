"""Snapshots of a session for clients that draw the view. They contain objects that may come into view."""

import logging

import numpy as np

from experiments.web.protocol import View
from experiments.web.state import GaitParameters, SceneMessage, Snapshot, Speeds
from experiments.web.worker.houses import scene_files
from experiments.web.worker.live_session import LiveSession
from mjsim.house.sight.potential_visibility import PotentialVisibility
from mjsim.values.errors import AssetError
from mjsim.values.observation import Observation
from mjsim.world.fidelity import kinematics

LOG = logging.getLogger("mjsim.play")
HORIZON = 0.3  # objects are sent this long before they may come into view, in seconds
LINGERING = 25  # number of control steps for which objects are still sent after they leave the view
LOOK_EVERY = 3  # number of control steps between updates of the set of objects to send
DECIMALS = 4  # number of decimal places of positions in metres and of quaternions


def field_of_view(live: LiveSession, view: View) -> float:
    """Return the field of view in radians. It is the participant's choice if the study allows one."""
    own, limits = live.scene.person.field_of_view, live.config.view_limits
    if limits is None or view.codec != "none":
        return own
    low, high = limits
    return min(high, max(low, view.field_of_view or own))


def scene_of(live: LiveSession, view: View) -> SceneMessage:
    person, options = live.scene.person, live.world.options
    path: str | None
    floor: str | None
    try:
        path, floor = scene_files(live.house)
    except (AssetError, OSError) as error:
        LOG.warning("no browser can draw %s: %s", live.config.house, error)
        path = floor = None
    return SceneMessage(
        path,
        floor if live.config.fidelity == "event" else None,
        GaitParameters(**kinematics.Gait.of(live.scene, options)._asdict()),
        Speeds(person.walking_speed, person.turning_speed, person.looking_speed),
        field_of_view(live, view),
        live.config.view_limits,
        options.control_timestep,
    )


class SnapshotStream:
    """A stream of snapshots of a session for a new client."""

    def __init__(self, live: LiveSession, view: View) -> None:
        self._live, self._aspect = live, view.width / view.height
        self._potential_visibility = PotentialVisibility(live.scene, HORIZON, field_of_view(live, view))
        self._until: dict[str, int] = {}  # control step until which each object is sent
        self._models = {item.name: item.model for item in live.scene.episode.objects}
        self._looked = -LOOK_EVERY  # control step of the last update of the objects to send
        self._hands: tuple[str | None, str | None] = (None, None)  # held objects at the last update
        self._poses = np.full((len(self._models), 7), np.nan)
        self._sent: dict[str, list[float]] = {}

    def next(self, seen: Observation, step: int) -> Snapshot:
        world, names = self._live.world, seen.object_names
        if step >= self._looked + LOOK_EVERY or seen.hands != self._hands:
            self._look(seen, step)
        poses = np.hstack((seen.object_positions, seen.object_quaternions))
        moved = np.flatnonzero((poses != self._poses).any(axis=1)).tolist()
        self._poses = poses
        gone = [name for name in self._sent if self._until[name] <= step]
        for name in gone:
            del self._sent[name]
        entered = [name for name, until in self._until.items() if until > step and name not in self._sent]
        changed = {}
        for i in {*moved, *map(names.index, entered)}:
            name, pose = names[i], np.round(poses[i], DECIMALS).tolist()
            if (name in self._sent or name in entered) and self._sent.get(name) != pose:
                changed[name] = self._sent[name] = pose
        return Snapshot(
            step=step,
            input=self._live.input,
            time=round(seen.time, 6),
            busy=seen.busy,
            body=world.body.tolist(),
            eye=[round(value, DECIMALS) for value in (*seen.eye.tolist(), seen.heading, seen.pitch)],
            hands=np.round(world.hands, DECIMALS).tolist(),
            held=seen.hands,
            objects=changed,
            models={name: self._models[name] for name in entered},
            gone=gone,
        )

    def _look(self, seen: Observation, step: int) -> None:
        self._looked, self._hands = step, seen.hands
        soon = self._potential_visibility.may_see(seen, self._aspect)
        for i in np.flatnonzero(soon).tolist():
            self._until[seen.object_names[i]] = step + LINGERING
        for name in seen.carried:
            self._until[name] = step + LINGERING
