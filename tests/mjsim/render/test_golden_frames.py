"""Frames of the apartment as somebody looked at and found right: rooms, conditions, markers, hands.

The episode is a file, so that neither sampling nor physics changes them. After a change that is meant, run this file
with MJSIM_UPDATE_GOLDEN=1 and look at what was stored before committing it.
"""

import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from experiments.house import House
from experiments.session.task_board import TaskBoard
from hud.compose import Compositor
from hud.conditions import condition
from hud.markers import POLE_BANDS, breadcrumbs, flagpole, flagpoles
from hud.messages import message
from hud.projection import CameraView, in_view
from hud.state import FLOORPLAN
from hud.task import KnownPlan, TaskStep
from mjsim.house.scene.scene import compose
from mjsim.render import CameraPose, Renderer, render_house_map, render_pictures
from mjsim.testing import FrameMismatchError, compare_frame, fixtures, psnr
from mjsim.values.episode import Episode
from mjsim.world.world import World

golden_frame = fixtures.golden_frame
GOLDEN = Path(__file__).parents[2] / "golden"
FOVY = 1.2
ROOMS = {  # where one stands and what one looks at, m
    "kitchen": ((4.6, 7.0), (1.2, 9.8)),
    "living_room": ((6.0, 9.6), (11.8, 6.2)),
    "hall": ((7.6, 5.2), (0.2, 5.1)),
    "bedroom": ((0.6, 3.6), (3.4, 0.6)),
    "bathroom": ((6.3, 3.7), (4.9, 0.4)),
    "second_bedroom": ((9.4, 3.7), (7.2, 0.5)),
    "office": ((10.5, 0.6), (12.3, 3.9)),
}


@pytest.fixture(scope="module")
def studio():
    """The fixed episode, its start, and everything that frames are made with."""
    house = House.load("apartment")
    scene = compose(Episode.load(GOLDEN / "episode.json"), house.catalogue)
    world = World(scene)
    seen = world.reset()
    names = list(seen.object_names)
    target = seen.object_positions[names.index("object_09"), :2]
    path = house.geodesics.shortest_path(seen.position, target).points
    ahead = path[1] - path[0]
    heading = math.atan2(ahead[1], ahead[0])
    direction = np.array([math.cos(heading), math.sin(heading), -0.35])
    pose = CameraPose.looking_at(seen.eye, seen.eye + direction, FOVY)
    steps = tuple(TaskStep(kind, n) for n in ("object_09", *names[:3]) for kind in ("pick", "place"))
    goal = tuple(seen.object_positions[names.index("object_09")].tolist())
    view = TaskBoard(house, scene.episode, names[::-1]).view(
        dataclasses.replace(seen, heading=heading),
        ahead=KnownPlan(steps, segment=path, path=path, goal=goal),
        camera=CameraView(pose.position, pose.rotation, pose.fovy, 640, 480),
    )
    view = dataclasses.replace(view, message=message("started", house.texts), clock=83.0)
    pictures = render_pictures(house.catalogue)
    pictures[FLOORPLAN] = render_house_map(house.catalogue, house.bounds)
    with Renderer(scene.model) as large, Renderer(scene.model, width=320, height=240) as small:
        compositor = Compositor(pictures, house.texts)

        def glasses(state):
            """640 x 480, with the HUD."""
            return compositor.compose(large.rgb(world.data, pose, state.markers), state)

        draws = {"large": large, "small": small, "compositor": compositor, "glasses": glasses}
        yield SimpleNamespace(house=house, data=world.data, view=view, pose=pose, **draws)


def eye_at(place, target, down=0.6):
    return CameraPose.looking_at((*place, 1.6), (*target, down), FOVY)


@pytest.mark.parametrize("room", sorted(ROOMS))
def test_each_room(studio, golden_frame, room):
    pose = eye_at(*ROOMS[room])
    assert studio.house.rooms.room_at(pose.position[:2]) == room
    golden_frame(studio.small.rgb(studio.data, pose), f"room_{room}")


@pytest.mark.parametrize("name", ["none", "highlight", "optimal", "guided"])
def test_each_condition(studio, golden_frame, name):
    golden_frame(studio.glasses(condition(name)(studio.view)), f"condition_{name}")


def holding(view, *held):
    objects = tuple(dataclasses.replace(o, status="carried") if o.name in held else o for o in view.objects)
    hands = (held[0] if held else None, held[1] if len(held) > 1 else None)
    done = tuple(TaskStep("pick", name) for name in held)
    return dataclasses.replace(view, objects=objects, hands=hands, steps_done=done, message=None)


@pytest.mark.parametrize("held", [(), ("object_09", "object_03")])
def test_empty_and_full_hands(studio, golden_frame, held):
    state = condition("highlight-minimap")(holding(studio.view, *held))
    frame = studio.compositor.compose(studio.small.rgb(studio.data, studio.pose, state.markers), state)
    golden_frame(frame, f"hands_{'full' if held else 'empty'}")


def marker_pixels(studio, pose, markers):
    """Where markers hide the scene, from depth: shares nothing with colours."""
    bare, with_markers = (studio.small.depth(studio.data, pose, m) for m in ((), markers))
    return np.asarray(with_markers < bare - 1e-3)


def test_walls_hide_breadcrumbs_as_they_hide_things(studio, golden_frame):
    """From the hall, a way through the door into the bedroom: what has passed the door is behind the wall."""
    path = studio.house.geodesics.shortest_path((6.4, 5.15), (0.8, 3.4)).points
    crumbs = breadcrumbs(path, 1.6)
    pose = eye_at((0.8, 5.4), (2.2, 3.8))
    camera = CameraView(pose.position, pose.rotation, pose.fovy, 320, 240)
    behind = tuple(m for m in crumbs if m.position[1] < 4.1 and m.position[0] < 2.4)
    assert len(behind) >= 2 and all(in_view(camera, m.position) for m in behind)
    assert not marker_pixels(studio, pose, behind).any()
    assert marker_pixels(studio, pose, crumbs).sum() > 100
    golden_frame(studio.small.rgb(studio.data, pose, crumbs), "breadcrumbs_and_wall")


DEUTERANOPIA = (  # on linear RGB (Machado, Oliveira and Fernandes, 2009)
    (0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)
)  # fmt: skip


@pytest.mark.parametrize("vision", [np.eye(3), np.array(DEUTERANOPIA)])
def test_breadcrumbs_stand_out_from_parquet(studio, vision):
    """3 : 1 between the edge of the breadcrumbs and the floor around them, in a frame as it is rendered."""

    def luminance(frame):
        linear = ((frame / 255.0 + 0.055) / 1.055) ** 2.4
        return np.clip(linear @ vision.T, 0.0, 1.0) @ (0.2126, 0.7152, 0.0722)

    crumbs = breadcrumbs(np.array([(6.8, 8.0), (8.2, 7.0)]), 0.1)  # near the floor of the living room
    pose = eye_at((6.0, 9.6), (8.0, 7.0), 0.2)
    bare, drawn = (studio.large.rgb(studio.data, pose, m) for m in ((), crumbs))
    changed = np.any(bare != drawn, axis=2).astype(np.uint8)
    kernel = np.ones((3, 3), np.uint8)
    edge = cv2.erode(changed, kernel) - cv2.erode(changed, kernel, iterations=2)
    around = cv2.dilate(changed, kernel, iterations=3) - cv2.dilate(changed, kernel)
    dark, light = (np.median(luminance(drawn)[mask > 0]) for mask in (edge, around))
    assert changed.sum() > 500 and (light + 0.05) / (dark + 0.05) >= 3.0


def test_x_ray_flagpoles_show_faintly_through_walls(studio, golden_frame):
    pose = eye_at((6.4, 5.15), (2.2, 4.2))
    plain, x_ray = (flagpole((1.2, 2.6, 0.0), x_ray=through) for through in (False, True))
    bare = studio.small.rgb(studio.data, pose)
    assert np.array_equal(studio.small.rgb(studio.data, pose, plain), bare)
    seen = studio.small.rgb(studio.data, pose, x_ray)
    changed = np.abs(seen.astype(int) - bare).max(axis=2) > 0
    assert 20 < changed.sum() < 0.05 * changed.size
    golden_frame(seen, "flagpole_x_ray")


@pytest.mark.slow
def test_highlight_shows_every_flagpole_that_a_participant_is_told_of(studio):
    """From a corner of the bedroom across the house: poles behind walls are dimmed, and none is missing."""
    state = condition("highlight")(dataclasses.replace(studio.view, position=(0.8, 0.8)))
    pose = eye_at((0.8, 0.8), (9.0, 7.0))
    camera = CameraView(pose.position, pose.rotation, pose.fovy, 640, 480)
    complete = studio.large.rgb(studio.data, pose, state.markers)
    hidden = 0
    for name in flagpoles(state):
        pole = tuple(m for m in state.markers if m.object == name)
        if in_view(camera, pole[POLE_BANDS - 1].position, margin=0.02):
            others = tuple(m for m in state.markers if m.object != name)
            assert not np.array_equal(studio.large.rgb(studio.data, pose, others), complete), name
            hidden += not marker_pixels(studio, pose, pole).any()
    assert hidden >= 5, "most of them stand behind walls"


def moved(state, index, metres):
    markers = list(state.markers)
    x, y, z = markers[index].position
    markers[index] = dataclasses.replace(markers[index], position=(x + metres * 0.6, y + metres * 0.8, z))
    return dataclasses.replace(state, markers=tuple(markers))


def relabelled(state):
    first, *rest = state.checklist
    return dataclasses.replace(
        state, checklist=(dataclasses.replace(first, text=first.text[:-1] + "m"), *rest)
    )


MUTATIONS = {
    "a breadcrumb moves by 5 cm": (lambda s: moved(s, 5, 0.05), "a driver that nobody has"),
    "a letter of a label changes": (relabelled, "a driver that nobody has"),
    "a breadcrumb moves by a millimetre": (lambda s: moved(s, 3, 0.001), "mine"),  # the first in view
}


@pytest.mark.slow
@pytest.mark.parametrize("what", MUTATIONS)
def test_a_mutation_fails(studio, tmp_path, what):
    """On the known driver by its hash, on any other by the bound on PSNR."""
    (mutate, key), golden = MUTATIONS[what], tmp_path / "golden.png"
    state = condition("optimal")(studio.view)
    compare_frame(studio.glasses(state), golden, key="mine", update=True)
    assert compare_frame(studio.glasses(state), golden, key=key, update=False)
    with pytest.raises(FrameMismatchError) as caught:
        compare_frame(studio.glasses(mutate(state)), golden, key=key, update=False, output=tmp_path)
    for kind in ("actual", "expected", "difference"):
        assert str(tmp_path / f"golden.{kind}.png") in str(caught.value)
        assert (tmp_path / f"golden.{kind}.png").is_file()
    golden.with_suffix(".json").unlink()
    assert compare_frame(studio.glasses(state), golden, key=key, update=False).exact  # by the picture alone


def test_golden_frames_stay_small():
    assert sum(path.stat().st_size for path in GOLDEN.iterdir()) < 3_000_000


def test_psnr_by_hand():
    black = np.zeros((2, 2, 3), np.uint8)
    assert psnr(black, black) == math.inf
    assert psnr(black, black + np.uint8(255)) == 0.0
    assert psnr(black, black + np.uint8(1)) == pytest.approx(20 * math.log10(255))
