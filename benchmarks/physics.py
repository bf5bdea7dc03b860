"""Simulated seconds per core-second of every fidelity, against the raw engine, over objects and over threads.

What is simulated are errands: everything that a session asked of its world in a trial of the follower under optimal
assistance, recorded and played again. The raw engine takes the same steps of the same model with the same controls.
Both are timed in turns of a hundred calls; of each turn the best of some repetitions counts, in CPU time, so that the
ratios hold on a busy machine as well. Threads are timed on the clock.
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
from mujoco.batch import Batch

from experiments.house import House
from experiments.recorded_trial import VisitTask, play, record_errand
from mjsim.actions import Action, Move
from mjsim.model.scene import Scene, compose
from mjsim.options import FIDELITIES
from mjsim.world import World
from mjsim.world_state import set_physics, take_physics
from mjsim.worlds import Worlds

OBJECTS = (6, 12, 18, 24, 48)
LEVEL = 24
TURN = 100  # calls that are timed at once
REPEATS = 3
WALK = 60.0  # simulated s of which the profile is measured
TOGETHER = 3.0  # simulated s of which the number of threads is measured
WORLDS = 16  # per core: with few of them, threads wait for each other at the end of every step
TARGETS = (("full", 120.0), ("windows", 500.0), ("event", 3000.0))  # simulated s per core-second
MOST_OVERHEAD = 1.3  # times the raw engine
MANY_THREADS = 1.8  # times one thread, on two


def measure(*, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON."""
    house = House.load("apartment")
    repeats = 2 if quick else REPEATS
    seeds = (3,) if quick else (3, 4, 5)
    tiers = [measure_tier(house, fidelity, seeds, repeats) for fidelity in FIDELITIES]
    walked = record_errand(house, LEVEL, seeds[0], "full")
    levels = (LEVEL,) if quick else OBJECTS
    return {
        "benchmark": "physics",
        "objects": LEVEL,
        "cores": len(os.sched_getaffinity(0)),
        "tiers": tiers,
        "overhead": [measure_overhead(record_errand(house, n, seeds[0], "full"), repeats) for n in levels],
        "threads": measure_threads(walked, repeats),
        "memory": measure_memory(walked.scene),
        "set_up": measure_set_up(house, 2 if quick else 5),
        "profile": measure_profile(walked),
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    """The result for people."""
    yield f"{result['objects']} objects, {result['cores']} cores; simulated seconds per core-second, Python included"
    targets = dict(TARGETS)
    full = next(row for row in result["tiers"] if row["fidelity"] == "full")
    for row in result["tiers"]:
        speed, target = row["speed"], targets[row["fidelity"]]
        ratio = speed / full["speed"]
        yield f"  {row['fidelity']:9}{speed:9.0f}{ratio:7.1f} x full  (>= {target:g}: {verdict(speed >= target)})"
    yield "tier full, us per control step:"
    yield f"{'objects':>9}{'World.step':>12}{'mj_step':>9}{'ratio':>8}{'awake':>7}{'contacts':>10}"
    for row in result["overhead"]:
        yield (
            f"{row['objects']:9}{row['step_us']:12.0f}{row['raw_us']:9.0f}{row['ratio']:8.2f}{row['awake']:7.1f}"
            f"{row['contacts']:10.1f}"
        )
    ratio = next(row["ratio"] for row in result["overhead"] if row["objects"] == result["objects"])
    yield f"World.step over mj_step: {ratio:.2f} (<= {MOST_OVERHEAD:g}: {verdict(ratio <= MOST_OVERHEAD)})"
    yield "speed over one thread:"
    yield f"{'threads':>9}{'step':>8}{'stretches':>11}{'mj_step':>9}{'Batch':>8}"
    for row in result["threads"]:
        yield (
            f"{row['threads']:9}{row['worlds']:8.2f}{row['stretches']:11.2f}{row['raw']:9.2f}{row['batch']:8.2f}"
        )
    for row in result["threads"]:
        for kind in ("worlds", "stretches") if row["threads"] == 2 else ():
            holds = verdict(row[kind] >= MANY_THREADS)
            name = {"worlds": "step", "stretches": "stretches"}[kind]
            yield f"two threads over one, {name}: {row[kind]:.2f} (>= {MANY_THREADS:g}: {holds})"
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


def verdict(holds: bool) -> str:
    """For people."""
    return "holds" if holds else "MISSED"


def measure_tier(house: House, fidelity: str, seeds: Sequence[int], repeats: int) -> dict[str, Any]:
    """Simulated seconds per core-second of a tier, over some trials."""
    simulated = spent = 0.0
    for seed in seeds:
        errand = record_errand(house, LEVEL, seed, fidelity)
        world = errand.world()
        turns = [errand.calls[i : i + TURN] for i in range(0, len(errand.calls), TURN)]
        best = np.full(len(turns), np.inf)
        for _ in range(repeats):
            world.reset()
            best = np.minimum(best, [play(world, turn) for turn in turns])
        simulated += world.observation().time
        spent += float(best.sum())
    return {"fidelity": fidelity, "seeds": list(seeds), "simulated_s": simulated, "speed": simulated / spent}


@dataclass(frozen=True, eq=False)
class Drive:
    """What drives the engine in a control step: activations, controls, welds, what wakes; or a state to go on from."""

    act: Any = None
    ctrl: Any = None
    active: Any = None
    asleep: Any = None
    physics: Any = None


def drives(errand: VisitTask) -> tuple[list[Drive], float, float]:
    """What drove the engine in an errand, and how many trees were awake and contacts there were, on average."""
    world, found, awake, contacts = errand.world(), [], 0, 0
    advance = mujoco.mj_step

    def noted(model: Any, data: Any, nstep: int = 1) -> None:
        nonlocal awake, contacts
        inputs = (data.act, data.ctrl, data.eq_active, data.tree_asleep)
        found.append(Drive(*(array.copy() for array in inputs)))
        advance(model, data, nstep)
        awake, contacts = awake + data.ntree_awake, contacts + data.ncon

    mujoco.mj_step = noted
    try:
        for name, argument in errand.calls:
            if name == "step":
                world.step(argument)
            elif name == "restore":
                world.restore(world.state())
                found.append(Drive(physics=take_physics(world.model, world.data)))
    finally:
        mujoco.mj_step = advance
    count = max(1, sum(drive.physics is None for drive in found))
    return found, awake / count, contacts / count


def drive_raw(model: Any, data: Any, turn: Sequence[Drive], substeps: int) -> float:
    """Let the engine alone take some steps; CPU seconds of them."""
    act, ctrl, active, asleep = data.act, data.ctrl, data.eq_active, data.tree_asleep
    advance, clock, lost = mujoco.mj_step, time.process_time, 0.0
    start = clock()
    for drive in turn:
        if drive.physics is not None:
            began = clock()
            set_physics(model, data, drive.physics)
            lost += clock() - began
            continue
        act[:], ctrl[:], active[:], asleep[:] = drive.act, drive.ctrl, drive.active, drive.asleep
        advance(model, data, substeps)
    return clock() - start - lost


def measure_overhead(errand: VisitTask, repeats: int) -> dict[str, Any]:
    """Microseconds of `World.step` and of the raw engine for the same control steps, in turns."""
    calls = [call for call in errand.calls if call[0] in ("step", "restore")]
    found, awake, contacts = drives(errand)
    world, model = errand.world(), errand.scene.model
    data = mujoco.MjData(model)
    substeps = round(world.control_timestep / model.opt.timestep)
    starts = range(0, len(calls), TURN)
    mine, raw = (np.full(len(starts), np.inf) for _ in range(2))
    for _ in range(repeats):
        world.reset()
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        for turn, i in enumerate(starts):
            mine[turn] = min(mine[turn], play(world, calls[i : i + TURN]))
            raw[turn] = min(raw[turn], drive_raw(model, data, found[i : i + TURN], substeps))
        if not np.array_equal(world.data.qpos, data.qpos):
            raise RuntimeError("the raw engine went another way than the world that it was compared with")
    steps = sum(name == "step" for name, _ in calls)
    return {
        "objects": len(errand.scene.index.names),
        "step_us": 1e6 * float(mine.sum()) / steps,
        "raw_us": 1e6 * float(raw.sum()) / steps,
        "ratio": float(mine.sum() / raw.sum()),
        "awake": awake,
        "contacts": contacts,
    }


def measure_threads(errand: VisitTask, repeats: int) -> list[dict[str, Any]]:
    """Speed on 1, 2, .. threads relative to 1: of `Worlds`, of the raw engine on threads, and of MuJoCo's `Batch`.

    Worlds are stepped together, all by one control step at a time, and for all steps in one call (stretches).
    """
    cores = len(os.sched_getaffinity(0))
    counts = [n for n in (1, 2, 4, 8, 16, 32, 64) if n < cores] + [cores]
    actions = errand.actions(TOGETHER)
    worlds = [errand.world() for _ in range(WORLDS * cores)]
    best = {kind: dict.fromkeys(counts, np.inf) for kind in ("worlds", "stretches", "raw", "batch")}
    for _ in range(2 * repeats):
        for count in counts:
            best["worlds"][count] = min(best["worlds"][count], _step_worlds(worlds, actions, count))
            best["stretches"][count] = min(best["stretches"][count], _step_apart(worlds, actions, count))
            best["raw"][count] = min(best["raw"][count], _step_raw(worlds, len(actions), count))
            best["batch"][count] = min(best["batch"][count], _step_batch(worlds, len(actions), count))
    return [
        {"threads": count, **{kind: times[1] / times[count] for kind, times in best.items()}}
        for count in counts
    ]


def _step_worlds(worlds: Sequence[World], actions: Sequence[Action], threads: int) -> float:
    with Worlds(worlds, threads=threads) as together:
        together.reset()
        start = time.perf_counter()
        for action in actions:
            together.step([action] * len(worlds))
        return time.perf_counter() - start


def _step_apart(worlds: Sequence[World], actions: Sequence[Action], threads: int) -> float:
    with Worlds(worlds, threads=threads) as together:
        together.reset()
        start = time.perf_counter()
        together.each(lambda world: play(world, [("step", action) for action in actions]))
        return time.perf_counter() - start


def _step_raw(worlds: Sequence[World], steps: int, threads: int) -> float:
    """The worlds stand still; their engines step all the same."""
    with Worlds(worlds, threads=threads) as together:
        together.reset()
        start = time.perf_counter()
        for _ in range(steps):
            together.each(lambda world: mujoco.mj_step(world.model, world.data, 10))
        return time.perf_counter() - start


def _step_batch(worlds: Sequence[World], steps: int, threads: int) -> float:
    worlds[0].reset()
    batch = Batch(worlds[0].model, len(worlds), threads, persistent=True)
    batch.act[:] = worlds[0].data.act
    start = time.perf_counter()
    for _ in range(steps):
        batch.step(nstep=10)
    return time.perf_counter() - start


def measure_memory(scene: Scene, count: int = 20) -> dict[str, Any]:
    """Resident megabytes that another world of a scene takes, and megabytes of its model."""
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
    """Milliseconds of CPU time until a new episode can be stepped, the best of some."""
    clock, rows = time.process_time, []
    for seed in range(count):
        times = [clock()]
        episode = house.sample_episode(objects=LEVEL, seed=100 + seed)
        times.append(clock())
        scene = compose(episode, house.catalogue)
        times.append(clock())
        World(scene)
        times.append(clock())
        rows.append(np.diff(times))
    sample, composed, world = 1e3 * np.min(rows, axis=0)
    return {"sample_ms": float(sample), "compose_ms": float(composed), "world_ms": float(world)}


def measure_profile(errand: VisitTask) -> dict[str, float]:
    """Share of each part of a control step, by MuJoCo's own timers; empty where the system has no clock for them."""
    library = ctypes.util.find_library("gomp")
    if library is None:
        return {}
    # A C function that returns seconds as a double: a clock in Python would take longer than what it measures.
    clock = ctypes.CFUNCTYPE(ctypes.c_double)(("omp_get_wtime", ctypes.CDLL(library)))
    world = errand.world()
    timer, kinds, total = world.data.timer, mujoco.mjtTimer, 0.0
    mujoco.set_mjcb_time(clock)
    try:
        for action in errand.actions(WALK):
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
