"""Episodes of the small house of conftest.py, and actions that are carried out to their end."""

from mjsim.actions import WAIT
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.model.catalogue import Catalogue
from mjsim.model.scene import compose
from mjsim.options import WorldOptions
from mjsim.world import World

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


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
    step = world.step(action)
    assert step.result is not None
    assert step.result.applied, step.result
    return [*step.events, *finish(world)]


def finish(world):
    """Wait until the motion under way has ended."""
    events = []
    for _ in range(100):
        if not world.busy:
            return events
        events += world.step(WAIT).events
    raise AssertionError("the motion does not end")
