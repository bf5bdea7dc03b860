"""What a client that draws is told: everything a little before it comes into view, and nothing that cannot."""

import dataclasses
import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest

from experiments.trials.trial_config import TrialConfig
from experiments.web.controls import Input
from experiments.web.protocol import View
from experiments.web.worker.live_session import LiveSession, open_journal
from experiments.web.worker.snapshots import LINGERING, SnapshotStream
from mjsim.house.scene.avatar import EYE
from mjsim.render import Renderer
from mjsim.render.cameras import CameraPose, camera_pose

AHEAD = 10  # control steps before an object is seen at which it is known: a round trip of 0.4 s
FEW = 3  # px
EVERY = 5  # control steps between two pictures
WIDE, TALL = (320, 180), (144, 256)  # px


def restless(live, rng):
    """Inputs of a person who hurries from place to place, and looks round."""
    navmesh, geodesics, number = live.house.navmesh, live.house.geodesics, 0
    while True:
        goal, start = navmesh.sample(rng), live.world.observation().position
        for point in geodesics.shortest_path(start, goal).points[1:]:
            while math.dist(position := live.world.observation().position, point) > 0.15:
                seen, number = live.world.observation(), number + 1
                angle = math.atan2(*(point - position)[::-1]) - seen.heading
                angle = (angle + math.pi) % (2.0 * math.pi) - math.pi
                yield Input(number=number, forward=float(abs(angle) < 0.5), yaw=angle, turn=0.0)
        for _ in range(int(rng.integers(5, 40))):
            number += 1
            yield Input(
                number=number, turn=float(rng.choice([-1.0, 1.0])), look=float(rng.choice([-1.0, 0.0, 1.0]))
            )


@dataclass(frozen=True)
class Told:
    """A state of the walk: names that a client knows, and those in each picture with their pixels."""

    known: frozenset[str]
    seen: dict[str, int]


def walk(live, size, angle, steps, rng):
    """What a client is told in each control step of a walk, and what it shows in a view of some width, rad."""
    width, height = size
    stream, told, known = SnapshotStream(live, View(width, height, "none", angle)), [], set()
    aspect = width / height
    owner, names = live.scene.index.geom_owner, live.scene.index.names
    with Renderer(live.scene.model, width=width, height=height, profile="draft") as renderer:
        inputs = restless(live, rng)
        for step in range(steps):
            snapshot = stream.next(live.world.observation(), step)
            known = (known | set(snapshot.models)) - set(snapshot.gone)
            assert set(snapshot.objects) <= known
            seen = {}
            if step % EVERY == 0:
                pose = camera_pose(live.world.model, live.world.data, EYE, aspect)
                fovy = 2.0 * math.atan(math.tan(angle / 2.0) / aspect)
                ids = renderer.segmentation(live.world.data, CameraPose(pose.position, pose.rotation, fovy))
                owners = owner[ids[ids >= 0]]
                seen = dict(Counter(names[i] for i in owners[owners >= 0].tolist()))
            told.append(Told(frozenset(known), seen))
            live.step([next(inputs)])
    return told


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "size", "angle"), [(3, WIDE, None), (4, WIDE, 2.2), (5, TALL, None)])
def test_nothing_pops_up(house, tmp_path, seed, size, angle):
    limits = None if angle is None else f"1.0,{angle}"
    config = TrialConfig(
        objects=16,
        assistance="none",
        seed=seed,
        user="human",
        live=True,
        fidelity="event",
        field_of_view_range=limits,
    )
    live = LiveSession(open_journal(tmp_path), house, config)
    angle = angle or live.scene.person.field_of_view
    told = walk(live, size, angle, 600, np.random.default_rng(seed))
    live.close()
    pops = [
        (step, name, pixels)
        for step, now in enumerate(told)
        for name, pixels in now.seen.items()
        if pixels >= FEW and name not in told[max(0, step - AHEAD)].known
    ]
    assert not pops
    shares = [len(now.known) / 16 for now in told]
    assert sum(len(now.seen) for now in told) > 80 and np.mean(shares) < 0.6


@pytest.fixture
def one_object(house, tmp_path):
    """A session with one object, and a function that puts the person somewhere and tells whether a client knows it."""
    config = TrialConfig(objects=1, assistance="none", seed=3, user="human", live=True, fidelity="event")
    live = LiveSession(open_journal(tmp_path), house, config)
    start = live.world.observation()
    (name,), (place,) = start.object_names, start.object_positions

    def told(stream, step, position, heading):
        seen = dataclasses.replace(
            live.world.observation(),
            position=np.array(position),
            eye=np.array([*position, 1.6]),
            heading=heading,
        )
        return stream.next(seen, step)

    yield live, name, place, told
    live.close()


def test_an_object_that_cannot_come_into_view_any_more_is_gone_after_a_while(one_object):
    live, name, place, told = one_object
    stream, stand = SnapshotStream(live, View(*WIDE, "none")), place[:2] + np.array([1.5, 0.0])
    assert told(stream, 0, stand, math.pi).models.keys() == {name}
    snapshots = [told(stream, step, stand, 0.0) for step in range(1, LINGERING + 3)]
    assert [snapshot.gone for snapshot in snapshots].index([name]) + 1 == LINGERING
    again = told(stream, 100, stand, math.pi)
    assert again.models.keys() == again.objects.keys() == {name}
