"""Frames in layers: the same picture as in one piece, whatever moves, rests or is seen through."""

from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

from mjsim.render import CameraPose, LayeredRenderer, Renderer
from mjsim.render.renderer import REST

# A floor, a wall, a ball that can move before and behind it, and a pane of glass that can move.
SCENE = """<mujoco><worldbody>
  <light pos="0 0 5" dir="0 0 -1" directional="true"/>
  <geom type="plane" size="4 4 .1" rgba=".6 .6 .5 1"/>
  <geom type="box" size="1.5 .05 .4" pos="0 0 .4" rgba=".3 .4 .8 1"/>
  <body name="ball" mocap="true" pos="-1 -1 .3"><geom size=".3" rgba="1 .2 .1 1"/></body>
  <body name="pane" mocap="true" pos="1 -1 .3"><geom type="box" size=".3 .02 .3" rgba=".2 1 .2 .4"/></body>
</worldbody></mujoco>"""
CAMERA = CameraPose.looking_at((0.0, -4.0, 3.0), (0.0, 0.0, 0.3), 0.9)
SIZE = {"width": 160, "height": 120, "groups": (0,)}


@dataclass
class Dot:
    position: tuple[float, float, float]
    rgba: tuple[float, float, float, float] = (1.0, 0.0, 1.0, 1.0)
    shape: str = "sphere"
    size: tuple[float, float, float] = (0.1, 0.0, 0.0)
    x_ray: bool = False
    role: str = "dot"


@pytest.fixture
def stage():
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    with LayeredRenderer(model, **SIZE) as layered, Renderer(model, **SIZE) as whole:

        def differing(place=None, pane=None, markers=(), camera=CAMERA):
            """Share of the pixels that differ visibly."""
            if place is not None:
                data.mocap_pos[0] = place
            if pane is not None:
                data.mocap_pos[1] = pane
            mujoco.mj_forward(model, data)
            one = layered.rgb(data, camera, markers).astype(int)
            other = whole.rgb(data, camera, markers).astype(int)
            return (np.abs(one - other).max(axis=2) > 40).mean()

        yield differing


def test_something_that_moves_and_comes_to_rest(stage):
    for x in np.linspace(-1.0, 1.0, 12):
        assert stage((x, -1.0, 0.3)) < 0.002
    for _ in range(REST + 3):
        assert stage() < 0.002
    assert stage() == 0.0  # all at rest: one layer


def test_markers_come_and_go(stage):
    stage()
    for x in np.linspace(-1.0, 1.0, 5):
        lines = 0.001  # share of the lines around the hidden dot, which layers lack
        assert stage(markers=[Dot((x, -0.8, 0.5)), Dot((x, 0.6, 0.2), x_ray=True)]) < 0.002 + lines
    assert stage() == 0.0


def test_what_one_can_see_through(stage):
    stage()
    assert stage(markers=[Dot((0.0, -0.8, 0.5), (1.0, 0.0, 1.0, 0.3))]) < 0.002
    assert stage(markers=[Dot((0.0, 0.8, 0.2), (1.0, 0.0, 1.0, 0.3))]) == 0.0  # behind the wall
    stage()
    assert stage(pane=(0.5, -1.0, 0.4)) == 0.0


def test_a_camera_that_moves(stage):
    for x in (0.0, 0.5, 1.0):
        assert stage(camera=CameraPose.looking_at((x, -4.0, 3.0), (0.0, 0.0, 0.3), 0.9)) == 0.0
