"""Episodes of the small house of conftest.py, actions carried out to their end, and objects on a bare floor."""

import math

import mujoco
import numpy as np

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.scene.avatar import START_PITCH
from mjsim.house.scene.scene import compose
from mjsim.values.actions import WAIT, Move
from mjsim.values.episode import Episode, PlacedObject, StartPose
from mjsim.values.options import WorldOptions
from mjsim.world.body.rig import BODY_SIZE, HEADING, LOOK, PITCH, SERVO, X, Y
from mjsim.world.world import World

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
FLOOR = """<mujoco><option timestep="0.004" integrator="implicitfast" cone="elliptic" impratio="10"/>
<worldbody><geom name="ground" type="plane" size="5 5 1"/></worldbody></mujoco>"""


def episode_of(catalogue, start, *placed, names="o{i}", height=0.0, seed=0):
    """Objects (model, x, y) or (model, x, y, quaternion) at a height over the floor, each for its own receptacle."""
    objects, targets = [], {}
    for i, (model, x, y, *turn) in enumerate(placed):
        name, category = names.format(i=i, model=model), catalogue.objects[model].category
        pose = (x, y, height), turn[0] if turn else UPRIGHT
        objects.append(PlacedObject(name, category, model, (x, y), *pose))
        targets[name] = catalogue.categories[category].receptacle
    keys = tuple(catalogue.receptacles)
    return Episode(catalogue.name, seed, StartPose(*start), tuple(objects), keys, targets)


def scene_of(catalogue, start, *placed, names="o{i}", height=0.0, **options):
    return compose(episode_of(catalogue, start, *placed, names=names, height=height), catalogue, **options)


def world_of(scene, fidelity="full", **options):
    return World(scene, WorldOptions(fidelity=fidelity, **options))


def edited(catalogue, name, old, new):
    """The house of a catalogue (a path) after one text in one of its files was replaced."""
    path = catalogue.with_name(name)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return Catalogue.load(str(catalogue))


def do(world, action):
    """Events of a pick or a place from its start to its end."""
    answer = world.answer(action)
    assert answer.applied, answer
    step = world.step(action)
    assert step.result == answer
    return [*step.events, *finish(world)]


def finish(world):
    """Wait until the motion under way has ended."""
    events = []
    for _ in range(100):
        if not world.busy:
            return events
        events += world.step(WAIT).events
    raise AssertionError("the motion does not end")


def walk_to(world, x, y, *, heading=None, within=0.03):
    """Events of a walk straight to a point, turning into the way, then to a heading."""
    events = []
    for _ in range(500):
        o = world.observation()
        offset = np.array([x, y]) - o.position
        distance = float(np.hypot(*offset))
        wanted = math.atan2(offset[1], offset[0]) if distance > 0.3 else heading
        error = 0.0 if wanted is None else math.remainder(wanted - o.heading, math.tau)
        if distance < within and abs(error) < 0.05:
            return events
        speed = min(1.4, 2.0 * distance) / max(distance, 1e-9)
        c, s = math.cos(o.heading), math.sin(o.heading)
        forward, left = c * offset[0] + s * offset[1], c * offset[1] - s * offset[0]
        events += world.step(Move(forward * speed, left * speed, 4.0 * error)).events
    raise AssertionError(f"did not arrive at {x}, {y}: {world.observation().position}")


def loose(spec, path, name, height=0.0):
    """Attach the object of a file with a free joint, the way a scene does."""
    child = mujoco.MjSpec.from_file(str(path))
    body = spec.worldbody.add_frame(pos=[0, 0, height]).attach_body(child.body("object"), f"{name}/", "")
    body.add_freejoint(name=f"{name}/free")


def dropped(path, height):
    """State of the object of a file, `it`, 3 s after it was dropped onto a floor."""
    spec = mujoco.MjSpec.from_string(FLOOR)
    loose(spec, path, "it", height)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 750)
    return data


def standing(x, y, heading, pitch=START_PITCH):
    """A body state at rest, with commands that keep it there."""
    body = np.zeros(BODY_SIZE)
    body[[X, Y, HEADING, PITCH]] = x, y, heading, pitch
    body[LOOK] = body[SERVO + 3] = pitch
    return body
