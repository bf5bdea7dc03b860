"""Measure the speed of the environment: steps and resets per core-second, and the speed-up by processes."""

import statistics
import time
from collections.abc import Iterator
from typing import Any

import gymnasium

from benchmarks.support.requirements import outcome
from mjsim.values.options import FIDELITIES, WorldOptions

ID = "mjsim.environments:mjsim/Rearrange-v0"
SECONDS = 1.0
ROUNDS = 3
CONSTANT = "constant map"  # observations that take no time to compute
SETTINGS: dict[str, dict[str, Any]] = {
    CONSTANT: {"observations": ("map",)},
    "state": {"observations": ("state",)},
    "state, in_view": {"observations": ("state", "in_view")},
    "state, rgb 128 x 96": {"observations": ("state", "rgb")},
    "state, rgb, depth, segmentation": {"observations": ("state", "rgb", "depth", "segmentation")},
    "state, discrete": {"observations": ("state",), "actions": "discrete"},
}


def steps_per_second(options: dict[str, Any], seconds: float = SECONDS) -> tuple[float, float]:
    """Return steps and simulated seconds per second of CPU time, for random actions and 6 objects."""
    env = gymnasium.make(ID, episodes=1, disable_env_checker=True, **options)
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(20):  # warm up the compiler, the caches and the OpenGL context
        env.step(env.action_space.sample())
    steps, simulated, spent = 0, 0.0, 0.0
    while spent < seconds:
        _, info = env.reset(seed=0)
        started, is_over = time.process_time(), False
        while not is_over and spent + time.process_time() - started < seconds:
            *_, terminated, truncated, info = env.step(env.action_space.sample())
            steps, is_over = steps + 1, terminated or truncated
        spent += time.process_time() - started
        simulated += float(info["time"])
    env.close()
    return steps / spent, simulated / spent


def seconds_per_reset(episodes: int | None, resets: int) -> float:
    """Return the mean CPU time of a reset in seconds. Without `episodes`, every reset uses a new house."""
    env = gymnasium.make(ID, episodes=episodes, disable_env_checker=True)
    for seed in range(episodes or 1):
        env.reset(seed=seed)
    started = time.process_time()
    for seed in range(1, resets + 1):
        env.reset(seed=seed)
    spent = time.process_time() - started
    env.close()
    return spent / resets


def vector_speedup(processes: int, steps: int = 300, rounds: int = 4) -> float:
    """Return the speed of several environments in parallel processes, relative to a single environment.

    Both are timed alternately with image observations. Without images, communication between processes would
    dominate.
    """
    options: dict[str, Any] = {"episodes": 1, "observations": ("state", "rgb")}
    one = gymnasium.make_vec(ID, num_envs=1, vectorization_mode="sync", **options)
    many = gymnasium.make_vec(
        ID,
        num_envs=processes,
        vectorization_mode="async",
        vector_kwargs={"context": "spawn"},  # OpenGL contexts cannot be used after a fork
        **options,
    )
    rates = [0.0, 0.0]
    for number in range(rounds + 1):  # the first round only warms up
        for i, envs in enumerate((one, many)):
            envs.reset(seed=0)
            actions = envs.action_space.sample()
            started = time.perf_counter()
            for _ in range(steps):
                envs.step(actions)
            if number:
                rates[i] += envs.num_envs * steps / (time.perf_counter() - started)
    one.close()
    many.close()
    return rates[1] / rates[0]


def measure(*, quick: bool = False) -> dict[str, Any]:
    """Measure all settings in turn, in several rounds, so that the ratios are reliable on a busy machine."""
    seconds, rounds = (SECONDS / 4, 1) if quick else (SECONDS, ROUNDS)
    rates: dict[str, dict[str, list[tuple[float, float]]]] = {
        fidelity: {name: [] for name in SETTINGS} for fidelity in FIDELITIES
    }
    for _ in range(rounds):
        for fidelity, rows in rates.items():
            for name, options in SETTINGS.items():
                world = WorldOptions(fidelity=fidelity)
                rows[name].append(steps_per_second({**options, "world": world}, seconds))
    medians = {
        fidelity: {
            name: [statistics.median(column) for column in zip(*row, strict=True)]
            for name, row in rows.items()
        }
        for fidelity, rows in rates.items()
    }
    return {
        "rates": medians,  # steps and simulated seconds per core-second
        "state_share": {fidelity: rows["state"][0] / rows[CONSTANT][0] for fidelity, rows in medians.items()},
        "new_house_ms": 1e3 * seconds_per_reset(None, 2 if quick else 10),
        "repeated_house_ms": 1e3 * seconds_per_reset(4, 20 if quick else 400),
        "two_processes": vector_speedup(2, rounds=1 if quick else 4),
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    yield "random actions, 6 objects; steps per core-second (simulated seconds per core-second)"
    yield "| observations | " + " | ".join(result["rates"]) + " |"
    yield "|---" * (1 + len(result["rates"])) + "|"
    for name in SETTINGS:
        cells = (
            f"{steps:.0f} ({simulated:.0f})"
            for steps, simulated in (r[name] for r in result["rates"].values())
        )
        yield f"| {name} | " + " | ".join(cells) + " |"
    yield f"reset to a new house: {result['new_house_ms']:.0f} ms"
    yield f"reset to one of 4 houses that repeat: {result['repeated_house_ms']:.2f} ms"
    yield f"2 environments in 2 processes: {result['two_processes']:.2f} times as many steps as one"
    share = result["state_share"]["full"]
    yield f"steps with `state` over steps with a constant, full: {share:.2f} (>= 0.85: {outcome(share, '>=', 0.85)})"
