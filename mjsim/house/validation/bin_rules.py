"""Rules that check whether a person can reach, see and fill the receptacles of a house."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mjsim.house.compiled.rays import first_hit, receptacle_in_sight
from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.house.validation.checked_model import Compiled
from mjsim.house.validation.findings import Finding
from mjsim.house.validation.floor import WalkableFloor
from mjsim.values.person_parameters import PersonParameters

DEFAULT = PersonParameters()
SNAP = 1.0  # maximum distance from the site `approach` to walkable floor, in metres
MAX_TOP = 1.4  # maximum height of the top of a receptacle's volume, in metres
ABOVE = 0.3  # free height that is required above a receptacle, in metres
INSIDE_GAP = 0.006  # maximum depth to which the house may reach into a receptacle's volume, in metres
SUPPORT_GAP = 0.05  # maximum gap between a receptacle and the surface below it, in metres
_WITHIN = ((0.0, 0.0), (0.6, 0.6), (0.6, -0.6), (-0.6, 0.6), (-0.6, -0.6))
_LIFT = np.array([0.0, 0.0, 0.01])
_DOWN = np.array([0.0, 0.0, -1.0])


def check_bins(floor: WalkableFloor) -> Iterator[Finding]:
    for receptacle in floor.receptacles.values():
        subject = replace(floor.compiled, subject=f"receptacle {receptacle.key}")
        yield from _bin_height(floor, receptacle, subject)
        yield from _bin_surroundings(receptacle, subject)
        yield from _bin_use(floor, receptacle, subject)


def _bin_height(floor: WalkableFloor, receptacle: ReceptacleGeometry, subject: Compiled) -> Iterator[Finding]:
    bottom, top = receptacle.center[2] + receptacle.half_size[2] * np.array([-1.0, 1.0])
    if top > MAX_TOP:
        yield subject.error(
            "reach",
            f"its top is {top:.2f} m above the floor",
            f"lower the site 'mount:{receptacle.key}' by {top - MAX_TOP:.2f} m: hands reach to {MAX_TOP} m",
            receptacle.center,
        )
    if bottom < 0:
        yield subject.error(
            "reach",
            f"its volume begins {-bottom:.2f} m below the floor",
            f"raise the site 'mount:{receptacle.key}'",
            receptacle.center,
        )
    room = floor.rooms.room_at(receptacle.center[:2])
    expected = floor.rooms_of[receptacle.key]
    if not floor.rooms.contains(receptacle.center[:2], margin=0.01):
        yield subject.error(
            "rooms", "is in no room", f"move the site 'mount:{receptacle.key}'", receptacle.center
        )
    elif room != expected:
        yield subject.error(
            "rooms",
            f"is in room {room!r}, but the catalogue says {expected!r}",
            f"correct its room in the catalogue, or move the site 'mount:{receptacle.key}'",
            receptacle.center,
        )


def _bin_surroundings(receptacle: ReceptacleGeometry, subject: Compiled) -> Iterator[Finding]:
    model, data = subject.model, subject.data
    own = model.body(f"{receptacle.key}/receptacle").id
    half = receptacle.half_size
    for x, y in _WITHIN:
        start = receptacle.center + receptacle.rotation @ (half * [x, y, 1.0]) + [0.0, 0.0, ABOVE]
        distance, geom = first_hit(model, data, start, _DOWN, without=own)
        height = start[2] - distance
        if height > receptacle.center[2] - half[2] + INSIDE_GAP:
            yield subject.error(
                "reach",
                f"geom {subject.geom_name(geom)} of the house is over it or in it, at z = {height:.2f} m",
                f"leave {ABOVE} m free above it, so that a hand can lower an object",
                (*start[:2], height),
            )
            return
    mount = data.site_xpos[subject.site(f"mount:{receptacle.key}")]
    gap, _ = first_hit(model, data, mount + _LIFT, _DOWN, without=own)
    if gap > SUPPORT_GAP:
        yield subject.warning(
            "reach",
            f"hangs {gap - _LIFT[2]:.2f} m above what is below it",
            f"put the site 'mount:{receptacle.key}' onto the floor or a piece of furniture",
            mount,
        )


def _bin_use(floor: WalkableFloor, receptacle: ReceptacleGeometry, subject: Compiled) -> Iterator[Finding]:
    stand = floor.navigable.snap(receptacle.approach, math.inf)
    away, gap = float(np.hypot(*(stand - receptacle.approach))), receptacle.distance(stand)
    if away > SNAP or gap > DEFAULT.reach:
        yield subject.error(
            "reach",
            f"the nearest place to stand, ({stand[0]:.2f}, {stand[1]:.2f}), is {away:.2f} m from its site "
            f"'approach' and {gap:.2f} m from its volume",
            f"leave free floor in front of it: at most {SNAP} m from the site, {DEFAULT.reach} m from the volume",
            (*receptacle.approach, 0.0),
        )
    elif not receptacle_in_sight(
        subject.model, subject.data, np.array([*stand, DEFAULT.eye_height]), receptacle
    ):
        yield subject.error(
            "reach",
            f"cannot be seen from ({stand[0]:.2f}, {stand[1]:.2f}), where a person stands to use it",
            "remove what is in between, or turn its mount so that local -y faces free floor",
            (*stand, 0.0),
        )
    elif floor.standing.needs_doorway(receptacle, stand):
        yield subject.warning(
            "reach",
            "cannot be reached in a straight line, except perhaps from a doorway",
            "leave free floor next to it, away from doorways",
            receptacle.center,
        )
