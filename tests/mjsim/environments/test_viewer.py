"""The window, driven step by step, with stand-ins for dm_control's parts so that no display is needed."""

import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from small_worlds import scene_of, world_of

from mjsim.environments import viewer
from mjsim.values.errors import ViewerError


class Parts:
    """dm_control's modules as far as the window uses them; notes what happens."""

    def __init__(self):
        self.notes: list[str] = []
        self.frames: list[Any] = []
        self.shown: Any = None

    def load(self):
        note = self.notes.append

        def initialize(physics, *_, **__):
            self.shown = physics
            note("initialize")

        window = SimpleNamespace(
            mouse=None,
            keyboard=None,
            shape=(320, 240),
            update=lambda draw: self.frames.append(draw()),
            close=lambda: note("close window"),
        )
        drawing = SimpleNamespace(
            initialize=initialize,
            zoom_to_scene=lambda: None,
            render=lambda: None,
            deinitialize=lambda: note("deinitialize"),
        )
        offscreen = SimpleNamespace(
            pixels=np.zeros((240, 320, 3), np.uint8), release=lambda: note("release renderer")
        )
        return (
            SimpleNamespace(RenderWindow=lambda *_: window),
            SimpleNamespace(Renderer=lambda **_: None),
            SimpleNamespace(Viewer=lambda *_: drawing),
            SimpleNamespace(
                Viewport=lambda *_: SimpleNamespace(set_size=lambda *_: None),
                OffScreenRenderer=lambda *_: offscreen,
            ),
        )


@pytest.fixture
def parts(monkeypatch):
    made = Parts()
    monkeypatch.setattr(viewer, "_load", made.load)
    return made


@pytest.fixture(scope="module")
def worlds(small_catalogue):
    scene = scene_of(small_catalogue, (1.0, 3.2, 0.3), ("cube", 1.6, 3.1))
    return world_of(scene), world_of(scene)


def test_a_world_is_loaded_once_and_drawn_every_time(parts, worlds):
    window = viewer.InteractiveViewer(realtime=False)
    first, second = worlds
    window.show(first)
    window.show(first)
    assert parts.notes == ["initialize"]
    assert np.shares_memory(parts.shown.data.qpos, first.data.qpos)
    window.show(second)
    assert parts.notes[1:] == ["deinitialize", "release renderer", "initialize"]
    assert len(parts.frames) == 3
    window.close()
    window.close()
    assert parts.notes[4:] == ["deinitialize", "release renderer", "close window"]
    with pytest.raises(ViewerError, match="closed"):
        window.show(first)


def test_the_window_keeps_pace_with_the_simulation(parts, worlds, monkeypatch):
    """It waits for what is left of a control step after the work, and never after a reset."""
    clock, waits = [100.0], []

    def sleep(seconds):
        waits.append(seconds)
        clock[0] += seconds

    monkeypatch.setattr(viewer, "time", SimpleNamespace(monotonic=lambda: clock[0], sleep=sleep))
    window, world = viewer.InteractiveViewer(), worlds[0]
    world.reset()
    window.show(world)
    world.data.time, clock[0] = 0.04, clock[0] + 0.01
    window.show(world)
    world.data.time, clock[0] = 0.08, clock[0] + 0.09
    window.show(world)
    world.reset()
    window.show(world)
    assert waits == pytest.approx([0.03, 0.0])
    assert len(parts.frames) == 4


def test_a_window_that_cannot_be_made_is_named(parts, monkeypatch):
    def refuse(*_):
        raise RuntimeError("Failed to create window")

    modules = parts.load()
    modules[0].RenderWindow = refuse
    monkeypatch.setattr(viewer, "_load", lambda: modules)
    with pytest.raises(ViewerError, match="Failed to create window"):
        viewer.InteractiveViewer()


WITHOUT_LABMAZE = """
import sys
sys.modules["labmaze"] = None  # cannot be imported, as on Python 3.13 and newer
from dm_control import mujoco
from dm_control.viewer import gui, renderer, viewer
ball = "<body><freejoint/><geom size='1'/></body>"
physics = mujoco.Physics.from_xml_string(f"<mujoco><worldbody>{ball}</worldbody></mujoco>")
physics.step()
print(physics.data.time)
"""


def test_the_viewer_and_the_adapter_need_no_labmaze():
    """dm-control is installed without it where it has no wheels."""
    done = subprocess.run([sys.executable, "-c", WITHOUT_LABMAZE], capture_output=True, text=True)
    assert done.stdout == "0.002\n", done.stderr


def test_without_dm_control_an_error_says_how_to_install_it(monkeypatch, worlds):
    monkeypatch.setitem(sys.modules, "dm_control", None)
    monkeypatch.setattr(viewer, "_check_display", lambda: None)
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    for attempt in (lambda: viewer.dm_control_physics(worlds[0]), viewer.InteractiveViewer):
        with pytest.raises(ViewerError, match="pip install --no-deps dm-control"):
            attempt()
