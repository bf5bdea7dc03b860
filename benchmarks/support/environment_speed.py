"""Measure the speed of the environment: steps and resets per core-second, and the speed-up by processes.

python -m benchmarks.support.environment_speed
"""

import time
from typing import Any

import gymnasium
from rich.console import Console
from rich.table import Table

ID = "mjsim.environments:mjsim/Rearrange-v0"
SECONDS = 3.0
SETTINGS: dict[str, dict[str, Any]] = {
    "one number": {"observations": ("remaining",)},
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


def main() -> None:
    table = Table("observations", "steps per core-second", "simulated s per core-second")
    for name, options in SETTINGS.items():
        steps, simulated = steps_per_second(options)
        table.add_row(name, f"{steps:.0f}", f"{simulated:.0f}")
    console = Console()
    console.print(table)
    console.print(f"reset to a new house: {seconds_per_reset(None, 10) * 1e3:.0f} ms")
    console.print(f"reset to one of 4 houses that repeat: {seconds_per_reset(4, 400) * 1e3:.2f} ms")
    console.print(f"2 environments in 2 processes: {vector_speedup(2):.2f} times as many steps as one")


if __name__ == "__main__":
    main()
