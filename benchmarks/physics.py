"""Measure the simulated seconds per core-second at each fidelity, and the overhead over raw MuJoCo.

The workload consists of all calls to the world in recorded trials of the follower under optimal assistance.
Raw MuJoCo takes the same steps with the same controls. Both are timed in chunks of a hundred calls. The
smallest CPU time of each chunk over several repetitions counts, so that the ratios are reliable on a busy
machine.
"""

import ctypes
import ctypes.util
import gc
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.support.recorded_trial import RecordedTrial, play, record_trial
from experiments.house import House
from mjsim.house.scene.scene import Scene, compose
from mjsim.values.actions import Move
from mjsim.values.options import FIDELITIES
from mjsim.world.state import set_physics, take_physics
from mjsim.world.world import World

OBJECTS = (6, 12, 18, 24, 48)
DEFAULT_OBJECTS = 24
CHUNK = 100  # number of calls that are timed together
REPEATS = 3
PROFILED_S = 60.0  # simulated time of the profiling run, in seconds
TARGETS = (("full", 120.0), ("event", 3000.0))  # required simulated seconds per core-second
MAX_OVERHEAD = 1.3  # largest permitted ratio of the step time to that of the raw engine


def measure(*, quick: bool = False) -> dict[str, Any]:
    house = House.load("apartment")
    repeats = 2 if quick else REPEATS
    seeds = (3,) if quick else (3, 4, 5)
    tiers = [measure_tier(house, fidelity, seeds, repeats) for fidelity in FIDELITIES]
    walked = record_trial(house, DEFAULT_OBJECTS, seeds[0], "full")
    levels = (DEFAULT_OBJECTS,) if quick else OBJECTS
    return {
        "benchmark": "physics",
        "objects": DEFAULT_OBJECTS,
        "tiers": tiers,
        "overhead": [measure_overhead(record_trial(house, n, seeds[0], "full"), repeats) for n in levels],
        "memory": measure_memory(walked.scene),
        "set_up": measure_set_up(house, 2 if quick else 5),
        "profile": measure_profile(walked),
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    yield f"{result['objects']} objects; simulated seconds per core-second, Python included"
    targets = dict(TARGETS)
    full = next(row for row in result["tiers"] if row["fidelity"] == "full")
    for row in result["tiers"]:
        speed, target = row["speed"], targets[row["fidelity"]]
        ratio = speed / full["speed"]
        yield f"  {row['fidelity']:9}{speed:9.0f}{ratio:7.1f} x full  (>= {target:g}: {outcome(speed >= target)})"
    yield "tier full, us per control step:"
    yield f"{'objects':>9}{'World.step':>12}{'mj_step':>9}{'ratio':>8}{'awake':>7}{'contacts':>10}"
    for row in result["overhead"]:
        yield (
            f"{row['objects']:9}{row['step_us']:12.0f}{row['raw_us']:9.0f}{row['ratio']:8.2f}{row['awake']:7.1f}"
            f"{row['contacts']:10.1f}"
        )
    ratio = next(row["ratio"] for row in result["overhead"] if row["objects"] == result["objects"])
    yield f"World.step over mj_step: {ratio:.2f} (<= {MAX_OVERHEAD:g}: {outcome(ratio <= MAX_OVERHEAD)})"
    memory = result["memory"]
    yield f"memory: {memory['world_mb']:.2f} MB per world, {memory['model_mb']:.1f} MB per scene"
    set_up = result["set_up"]
    yield (
        f"a new episode: {set_up['sample_ms']:.0f} ms to sample, {set_up['compose_ms']:.0f} to compose, "
        f"{set_up['world_ms']:.0f} for the world"
    )
    yield "where the time of a step goes:"
    for name, share in result["profile"].items():
        yield f"  {name:28}{100 * share:5.1f} %"


def outcome(met: bool) -> str:
    return "pass" if met else "FAIL"


def measure_tier(house: House, fidelity: str, seeds: Sequence[int], repeats: int) -> dict[str, Any]:
    """Measure the simulated seconds per core-second at a fidelity, over several trials."""
    simulated = spent = 0.0
    for seed in seeds:
        trial = record_trial(house, DEFAULT_OBJECTS, seed, fidelity)
        world = trial.world()
        chunks = [trial.calls[i : i + CHUNK] for i in range(0, len(trial.calls), CHUNK)]
        best = np.full(len(chunks), np.inf)
        for _ in range(repeats):
            world.reset()
            best = np.minimum(best, [play(world, chunk) for chunk in chunks])
        simulated += world.observation().time
        spent += float(best.sum())
    return {"fidelity": fidelity, "seeds": list(seeds), "simulated_s": simulated, "speed": simulated / spent}


@dataclass(frozen=True, eq=False)
class EngineInput:
    """Inputs of the engine in one control step, or a physics state to restore."""

    act: Any = None
    ctrl: Any = None
    active: Any = None
    asleep: Any = None
    physics: Any = None


def engine_inputs(trial: RecordedTrial) -> tuple[list[EngineInput], float, float]:
    """Return the inputs of all control steps of a trial, and its mean numbers of awake trees and contacts."""
    world, found, awake, contacts = trial.world(), [], 0, 0
    advance = mujoco.mj_step

    def record(model: Any, data: Any, nstep: int = 1) -> None:
        nonlocal awake, contacts
        inputs = (data.act, data.ctrl, data.eq_active, data.tree_asleep)
        found.append(EngineInput(*(array.copy() for array in inputs)))
        advance(model, data, nstep)
        awake, contacts = awake + data.ntree_awake, contacts + data.ncon

    mujoco.mj_step = record
    try:
        for name, argument in trial.single_steps:
            if name == "step":
                world.step(*argument)
            elif name == "restore":
                world.restore(world.state())
                found.append(EngineInput(physics=take_physics(world.model, world.data)))
    finally:
        mujoco.mj_step = advance
    count = max(1, sum(step.physics is None for step in found))
    return found, awake / count, contacts / count


def step_raw(model: Any, data: Any, chunk: Sequence[EngineInput], substeps: int) -> float:
    """Return the CPU time in seconds that raw MuJoCo takes for some control steps."""
    act, ctrl, active, asleep = data.act, data.ctrl, data.eq_active, data.tree_asleep
    advance, clock, lost = mujoco.mj_step, time.process_time, 0.0
    start = clock()
    for step in chunk:
        if step.physics is not None:
            began = clock()
            set_physics(model, data, step.physics)
            lost += clock() - began
            continue
        act[:], ctrl[:], active[:], asleep[:] = step.act, step.ctrl, step.active, step.asleep
        advance(model, data, substeps)
    return clock() - start - lost


def measure_overhead(trial: RecordedTrial, repeats: int) -> dict[str, Any]:
    """Measure the CPU time per control step of `World.step` and of raw MuJoCo, in alternating chunks."""
    calls = trial.single_steps
    found, awake, contacts = engine_inputs(trial)
    world, model = trial.world(), trial.scene.model
    data = mujoco.MjData(model)
    substeps = round(world.control_timestep / model.opt.timestep)
    starts = range(0, len(calls), CHUNK)
    mine, raw = (np.full(len(starts), np.inf) for _ in range(2))
    for _ in range(repeats):
        world.reset()
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        for chunk, i in enumerate(starts):
            mine[chunk] = min(mine[chunk], play(world, calls[i : i + CHUNK]))
            raw[chunk] = min(raw[chunk], step_raw(model, data, found[i : i + CHUNK], substeps))
        if not np.array_equal(world.data.qpos, data.qpos):
            raise RuntimeError("the raw engine and the world reached different states from the same inputs")
    steps = sum(name == "step" for name, _ in calls)
    return {
        "objects": len(trial.scene.index.names),
        "step_us": 1e6 * float(mine.sum()) / steps,
        "raw_us": 1e6 * float(raw.sum()) / steps,
        "ratio": float(mine.sum() / raw.sum()),
        "awake": awake,
        "contacts": contacts,
    }


def measure_memory(scene: Scene, count: int = 20) -> dict[str, Any]:
    """Measure the memory of an additional world of the same scene, and the size of its model, in MB."""
    keep = [World(scene)]
    gc.collect()
    before = _resident()
    for _ in range(count):
        world = World(scene)
        for _ in range(25):
            world.step(Move(1.0))
        keep.append(world)
    return {
        "world_mb": (_resident() - before) / count / 1e6,
        "model_mb": scene.model.nbuffer / 1e6,
        "worlds": count,
    }


def _resident() -> int:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def measure_set_up(house: House, count: int) -> dict[str, float]:
    """Measure the CPU time in ms that preparing a new episode takes. Return the fastest of several runs."""
    clock, rows = time.process_time, []
    for seed in range(count):
        times = [clock()]
        episode = house.sample_episode(objects=DEFAULT_OBJECTS, seed=100 + seed)
        times.append(clock())
        scene = compose(episode, house.catalogue, visuals=False)
        times.append(clock())
        World(scene)
        times.append(clock())
        rows.append(np.diff(times))
    sample, composed, world = 1e3 * np.min(rows, axis=0)
    return {"sample_ms": float(sample), "compose_ms": float(composed), "world_ms": float(world)}


def measure_profile(trial: RecordedTrial) -> dict[str, float]:
    """Measure the share of each part of a control step with MuJoCo's timers, if they can be used."""
    library = ctypes.util.find_library("gomp")
    if library is None:
        return {}
    # The clock is a C function because a Python clock would take longer than the steps that it measures.
    clock = ctypes.CFUNCTYPE(ctypes.c_double)(("omp_get_wtime", ctypes.CDLL(library)))
    world = trial.world()
    timer, kinds, total = world.data.timer, mujoco.mjtTimer, 0.0
    mujoco.set_mjcb_time(clock)
    try:
        for action in trial.actions(PROFILED_S):
            start = time.perf_counter()
            world.step(action)
            total += time.perf_counter() - start
    finally:
        mujoco.set_mjcb_time(None)
    names = {
        "broad phase": kinds.mjTIMER_COL_BROAD,
        "mid and narrow phase": kinds.mjTIMER_COL_NARROW,
        "kinematics and inertia": (kinds.mjTIMER_POS_KINEMATICS, kinds.mjTIMER_POS_INERTIA),
        "making constraints": (kinds.mjTIMER_POS_MAKE, kinds.mjTIMER_POS_PROJECT),
        "solving constraints": kinds.mjTIMER_CONSTRAINT,
        "velocities and actuators": (kinds.mjTIMER_VELOCITY, kinds.mjTIMER_ACTUATION),
        "integration": kinds.mjTIMER_ADVANCE,
    }
    shares = {
        name: sum(timer[kind].duration for kind in (kinds_ if isinstance(kinds_, tuple) else (kinds_,)))
        / total
        for name, kinds_ in names.items()
    }
    engine = timer[kinds.mjTIMER_STEP].duration / total
    return {**shares, "rest of the engine": engine - sum(shares.values()), "Python": 1.0 - engine}
