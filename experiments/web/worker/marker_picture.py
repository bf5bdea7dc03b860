"""Draw an example of the markers that an assistance condition shows, for the instructions of the task."""

import math
from dataclasses import replace
from operator import itemgetter

import cv2
import msgspec
import numpy as np

from experiments.house import House
from experiments.record.records import EventLog
from experiments.session.house_pictures import largest_rooms, room_views
from experiments.trials.fingerprint import fingerprint, trial_inputs
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from experiments.web.worker.encoders import data_url
from mjsim.formats.gltf.cache import cached_scene
from mjsim.formats.gltf.store import scenes_folder
from mjsim.house.scene.scene import compose
from mjsim.render import Renderer
from mjsim.support.files import write_text_atomically
from mjsim.values.episode import Episode, PlacedObject, StartPose

OBJECTS = 14  # largest number of sampled objects
SEED = 2**31 - 1  # of the objects; no study uses this seed by chance
AHEAD = 2.5  # preferred length of the path to the object in the picture, in metres
SIZE = (640, 400)  # size of the picture in pixels


class MarkerPicture(msgspec.Struct, frozen=True):
    """A picture as a data URL, and the roles of the markers in the house. Both are empty if there are no markers."""

    picture: str = ""
    roles: tuple[str, ...] = ()


def marker_picture(house: House, trial: TrialConfig) -> MarkerPicture:
    """Return a picture of example markers in the condition of a trial.

    It is drawn once per condition and house, and then read from the cache.

    The picture shows the start of a task with an object of its own, from a corner of the largest room. Drawing requires
    OpenGL.
    """
    places = len(house.sample_points(seed=SEED, points=trial.points))
    config = TrialConfig(
        objects=min(OBJECTS, places),
        assistance=trial.assistance,
        points=trial.points,
        seed=SEED,
        fidelity="event",
        regret=False,
    )
    key = fingerprint(config, trial_inputs(config, house.catalogue))
    # Exported pages omit files whose names begin with `view`.
    path = cached_scene(house.catalogue, scenes_folder()) / f"view-{key}.json"
    if path.is_file():
        return msgspec.json.decode(path.read_bytes(), type=MarkerPicture)
    drawn = _draw(house, config)
    write_text_atomically(path, msgspec.json.encode(drawn).decode())
    return drawn


def _scripted(house: House, episode: Episode) -> Episode:
    """Return an episode with one object. The person stands in a corner of the largest room and sees the object."""
    (room,) = largest_rooms(house, 1)
    found: list[tuple[float, StartPose, PlacedObject]] = []
    for view in room_views(house, [room])[room]:
        (x, y, _), (ahead_x, ahead_y, _) = view.position, -view.rotation[:, 2]
        start = StartPose(float(x), float(y), math.atan2(ahead_y, ahead_x))
        for one in episode.objects:
            turn = math.atan2(one.point[1] - y, one.point[0] - x) - start.heading
            place = house.place_of(np.array(one.point))
            path = house.geodesics.shortest_path((start.x, start.y), place)
            unfit = abs(math.remainder(turn, math.tau)) + abs(path.geodesic_distance - AHEAD)
            found.append((unfit, start, one))
    _, start, one = min(found, key=itemgetter(0))
    targets = {one.name: episode.targets[one.name]}
    return replace(episode, start=start, objects=(one,), targets=targets)


def _draw(house: House, config: TrialConfig) -> MarkerPicture:
    scene = compose(_scripted(house, trial_episode(config, house)), house.catalogue)
    session, world = prepare_session(config, house, scene, EventLog())
    observation = world.reset()
    session.assistant.begin(observation)
    markers = session.assistant.hud_state(observation).markers
    if not markers:
        return MarkerPicture()
    with Renderer(scene.model, width=SIZE[0], height=SIZE[1], profile="quality") as renderer:
        picture = renderer.rgb(world.data, markers=markers)
    roles = tuple(dict.fromkeys(marker.role for marker in markers))
    return MarkerPicture(data_url(cv2.cvtColor(picture, cv2.COLOR_RGB2RGBA)), roles)
