"""Measure frames per second and core by size and profile, compared with MuJoCo's own renderer.

All settings draw the same views of an apartment in turn, so that the ratios are reliable on a busy machine.
Times are CPU times if OpenGL runs in software, otherwise wall-clock times.
"""

import dataclasses
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import mujoco
import numpy as np

from benchmarks.environments import SETTINGS, steps_per_second
from benchmarks.support.hud_speed import hud_milliseconds, session_states, summary
from benchmarks.support.requirements import outcome
from experiments.house import House
from experiments.session.task_board import TaskBoard
from experiments.trials.trial_config import TrialConfig
from hud.compose import Compositor
from hud.conditions import condition
from hud.state import HudState
from hud.task import KnownPlan, TaskStep
from mjsim.house.scene.scene import Scene, compose
from mjsim.render import PROFILES, CameraPose, Renderer, RenderProfile, gl_info, render_pictures
from mjsim.render.cameras import ViewVolume
from mjsim.render.context import current_context
from mjsim.render.markers import add_markers
from mjsim.render.scene_settings import buffer_settings
from mjsim.world.world import World

SIZES = ((320, 240), (640, 480), (1280, 720))
REPEATS = {"draft": 5, "fast": 7, "quality": 1}
SLOW_VIEWS = 2  # number of views with slow settings
FOVY = 1.2
SESSION = TrialConfig(objects=6, assistance="optimal", seed=0)
# MJCF lets every light cast shadows by default, and so does the comparison with MuJoCo's defaults. In the
# house, only one light casts shadows, for speed.
TARGETS = (
    ("fast 640x480 with HUD over raw mjr_render", "with_hud_ratio", "<=", 1.15),
    ("MuJoCo's default quality over fast 640x480", "default_over_fast", ">=", 20.0),
    ("HUD drawing over a session, mean ms per frame", "hud_mean_ms", "<=", 1.0),
    ("HUD drawing over a session, 99th percentile, ms", "hud_p99_ms", "<=", 3.0),
)


@dataclasses.dataclass(frozen=True, eq=False)
class Subject:
    """A scene to draw, together with camera poses and a HUD state."""

    scene: Scene
    data: Any
    poses: tuple[CameraPose, ...]
    state: HudState
    house: House
    clock: Callable[[], float]


def measure() -> dict[str, Any]:
    gl = gl_info()
    subject = make_subject(time.process_time if gl.software else time.perf_counter)
    rows = [
        measure_profile(subject, profile, size)
        for size in SIZES
        for profile in PROFILES.values()
        if profile.name != "quality" or not gl.software or size == (640, 480)
    ]
    hud = measure_hud(subject)
    default = measure_default(subject, shadows_of_all_lights=True)
    authored = measure_default(subject, shadows_of_all_lights=False)
    fast = next(r for r in rows if (r["profile"], r["width"]) == ("fast", 640))
    headline = {
        "with_hud_ratio": (fast["ms"] + hud["mean_ms"]) / fast["raw_ms"],
        "default_over_fast": default["ms"] / default["fast_ms"],
        "authored_over_fast": authored["ms"] / authored["fast_ms"],
        "hud_mean_ms": hud["mean_ms"],
        "hud_p99_ms": hud["p99_ms"],
    }
    return {
        "benchmark": "render",
        "renderer": gl.renderer,
        "gl": gl.version,
        "clock": "CPU time" if gl.software else "wall time",
        "cores": os.cpu_count(),
        "geoms": int(subject.scene.model.ngeom),
        "views": len(subject.poses),
        "frames": rows,
        "default_quality": default,
        "default_quality_authored_lights": authored,
        "hud": hud,
        "environment": measure_environment(),
        **headline,
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    yield f"{result['renderer']}, {result['gl']}; {result['clock']}, {result['views']} views, {result['geoms']} geoms"
    yield f"{'profile':10}{'size':>12}{'ms':>9}{'fps/core':>10}{'raw ms':>9}{'to raw':>8}"
    for row in result["frames"]:
        size = f"{row['width']}x{row['height']}"
        yield (
            f"{row['profile']:10}{size:>12}{row['ms']:9.2f}{1e3 / row['ms']:10.1f}"
            f"{row['raw_ms']:9.2f}{row['ratio']:8.2f}"
        )
    yield "mujoco.Renderer, 4x multisampling, shadow maps of 4096, 640x480:"
    default, authored = result["default_quality"], result["default_quality_authored_lights"]
    ratio = result["default_over_fast"]
    yield f"  every light casts shadows, MuJoCo's default: {default['ms']:.0f} ms, {ratio:.1f} x fast"
    yield f"  only those of the house that do: {authored['ms']:.0f} ms, {result['authored_over_fast']:.1f} x fast"
    hud = result["hud"]
    yield (
        f"HUD over the {hud['frames']} frames of a trial (optimal, six objects), ms: mean {hud['mean_ms']:.2f}, "
        f"median {hud['median_ms']:.2f}, 99th percentile {hud['p99_ms']:.2f}, most {hud['max_ms']:.1f}, "
        f"first {hud['first_ms']:.1f}"
    )
    yield "Gymnasium environment, random actions, steps per core-second:"
    for name, rate in result["environment"].items():
        yield f"  {name}: {rate:.0f}"
    for label, key, relation, bound in TARGETS:
        yield f"{label}: {result[key]:.2f} ({relation} {bound:g}: {outcome(result[key], relation, bound)})"


def make_subject(clock: Callable[[], float]) -> Subject:
    """Prepare an apartment with twelve objects, seen from the start and from the middle of every room."""
    house = House.load("apartment")
    scene = compose(house.sample_episode(objects=12, seed=7), house.catalogue)
    world = World(scene)
    seen = world.reset()
    path = house.geodesics.shortest_path(seen.position, seen.object_positions[0, :2]).points
    x, y, z = seen.object_positions[0].tolist()
    goal = (x, y, z)
    view = TaskBoard(house, scene.episode, seen.object_names).view(
        seen, ahead=KnownPlan((TaskStep("pick", seen.object_names[0]),), path=path, goal=goal)
    )
    places = [seen.position, *house.rooms.centers]
    turns = [seen.heading, *np.random.default_rng(0).uniform(0.0, math.tau, len(house.rooms.centers))]
    poses = []
    for place, turn in zip(places, turns, strict=True):
        eye = np.array([place[0], place[1], 1.6])
        gaze = np.array([math.cos(turn), math.sin(turn), -0.3])
        poses.append(CameraPose.looking_at(eye, eye + gaze, FOVY))
    return Subject(scene, world.data, tuple(poses), condition("optimal")(view), house, clock)


def measure_profile(subject: Subject, profile: RenderProfile, size: tuple[int, int]) -> dict[str, Any]:
    """Measure the time in ms of a frame with markers, and of raw `mjr_render` with the same settings."""
    width, height = size
    poses = subject.poses if profile.name != "quality" else subject.poses[:SLOW_VIEWS]
    own: list[float] = []
    raw: list[float] = []
    with (
        Renderer(subject.scene.model, width=width, height=height, profile=profile) as renderer,
        raw_renderer(subject, profile, size) as draw_raw,
    ):
        for pose in poses:
            pairs = [
                (
                    timed(subject.clock, lambda: renderer.rgb(subject.data, pose, subject.state.markers)),  # noqa: B023
                    timed(subject.clock, lambda: draw_raw(pose)),  # noqa: B023
                )
                for _ in range(REPEATS[profile.name] + 1)
            ][1:]
            medians = np.median(pairs, axis=0)
            own.append(float(medians[0]))
            raw.append(float(medians[1]))
    ms, raw_ms = 1e3 * float(np.mean(own)), 1e3 * float(np.mean(raw))
    return {
        "profile": profile.name,
        "width": width,
        "height": height,
        "ms": ms,
        "fps_per_core": 1e3 / ms,
        "raw_ms": raw_ms,
        "ratio": ms / raw_ms,
    }


@contextmanager
def raw_renderer(
    subject: Subject, profile: RenderProfile, size: tuple[int, int]
) -> Iterator[Callable[[CameraPose], None]]:
    """Yield a function that draws the scene with `mjr_render`, without updates, readback or downsampling."""
    model = subject.scene.model
    drawn = round(size[0] * profile.supersampling), round(size[1] * profile.supersampling)
    scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 1000)
    option = mujoco.MjvOption()
    option.geomgroup[:] = [1, 1, 1, 0, 0, 0]
    option.flags[mujoco.mjtVisFlag.mjVIS_TEXTURE] = profile.textures
    camera, category = mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, subject.data, option, None, camera, category, scene)
    scene.flags[:] = 0
    for flag, on in (
        (mujoco.mjtRndFlag.mjRND_CULL_FACE, True),
        (mujoco.mjtRndFlag.mjRND_SHADOW, profile.shadow_size > 0),
        (mujoco.mjtRndFlag.mjRND_REFLECTION, profile.reflections),
        (mujoco.mjtRndFlag.mjRND_SKYBOX, profile.skybox),
    ):
        scene.flags[flag] = on
    add_markers(scene, subject.state.markers)
    with current_context(), buffer_settings(model, drawn, profile.samples, profile.shadow_size):
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
    rectangle = mujoco.MjrRect(0, 0, *drawn)

    def draw(pose: CameraPose) -> None:
        ViewVolume.of(pose).aim(scene)
        with current_context():
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
            mujoco.mjr_render(rectangle, scene, context)
            mujoco.mjr_finish()

    yield draw
    with current_context():
        context.free()


def measure_default(subject: Subject, *, shadows_of_all_lights: bool) -> dict[str, Any]:
    """Measure the time of a 640 x 480 frame with `mujoco.Renderer` and with the profile `fast`."""
    model = subject.scene.model
    authored = model.light_castshadow.copy()
    if shadows_of_all_lights:
        model.light_castshadow[:] = 1
    with buffer_settings(model, (640, 480), samples=4, shadow_size=4096), off_screen():
        default = mujoco.Renderer(model, 480, 640)
    option = mujoco.MjvOption()
    defaults: list[float] = []
    fasts: list[float] = []
    with Renderer(model) as fast:
        for pose in subject.poses[:SLOW_VIEWS]:
            default.update_scene(subject.data, scene_option=option)
            ViewVolume.of(pose).aim(default.scene)
            default.render()
            fast.rgb(subject.data, pose)
            defaults.append(timed(subject.clock, default.render))
            fasts.append(min(timed(subject.clock, lambda: fast.rgb(subject.data, pose)) for _ in range(5)))  # noqa: B023
    default.close()
    model.light_castshadow[:] = authored
    return {"ms": 1e3 * float(np.mean(defaults)), "fast_ms": 1e3 * float(np.mean(fasts))}


def measure_hud(subject: Subject, trial: TrialConfig = SESSION) -> dict[str, Any]:
    """Measure the time in ms for drawing the HUD over each 640 x 480 frame of a trial."""
    states = session_states(subject.house, trial)
    times = hud_milliseconds(
        Compositor(render_pictures(subject.house.catalogue), subject.house.texts), states, clock=subject.clock
    )
    return summary(times)


def measure_environment(seconds: float = 2.0) -> dict[str, float]:
    """Measure the steps per core-second of the Gymnasium environment, with and without images."""
    return {name: steps_per_second(SETTINGS[name], seconds)[0] for name in ("state", "state, rgb 128 x 96")}


@contextmanager
def off_screen() -> Iterator[None]:
    """Make `mujoco.Renderer` create EGL contexts, even if MuJoCo was imported with another MUJOCO_GL."""
    from mujoco import egl  # imported late, after the driver has been tested

    backend = sys.modules[mujoco.Renderer.__module__].gl_context
    # The attribute does not exist if MuJoCo was imported without rendering.
    with mock.patch.object(backend, "GLContext", egl.GLContext, create=True):
        yield


def timed(clock: Callable[[], float], work: Callable[[], Any]) -> float:
    start = clock()
    work()
    return clock() - start
