"""Worked example: an agent learns to fetch and deliver an object by imitation, with Stable-Baselines3.

    pip install -e '.[learn]'
    python -m experiments.examples.behaviour_cloning

A built-in participant demonstrates; a policy of Stable-Baselines3 is fitted to its actions, on its own episodes and
then, for a number of rounds, on episodes in which the learner acts and is corrected (DAgger). The learner wears the
glasses: a sensor tells it where the breadcrumbs lead. The policy's share of delivered objects in episodes it never saw
is printed before and after. It runs on a CPU in a few minutes.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from rich.console import Console
from stable_baselines3 import PPO

from experiments.examples.breadcrumbs import breadcrumb_sensor
from experiments.examples.demonstrations import Demonstrations, demonstrate
from experiments.house import House
from mjsim.environments.control import Continuous
from mjsim.environments.core import ObservationDict
from mjsim.environments.gymnasium_environment import RearrangeEnv
from mjsim.environments.sensors import Sensor

UNSEEN = 1_000_000  # first seed of the evaluation; far from those of the demonstrations
TRIGGER_WEIGHT = 10.0  # attempts are rare and decide everything


@dataclass(frozen=True)
class Settings:
    """Size of the experiment.

    Attributes:
        episodes: Houses to learn in.
        rounds: Rounds in which the learner acts and is corrected.
        glasses: Whether the learner sees where the breadcrumbs lead.
        epochs: Passes over the data in each round.
        evaluation: Unseen episodes to measure in.
        seed: Of everything.
    """

    episodes: int = 80
    rounds: int = 1
    glasses: bool = True
    epochs: int = 15
    evaluation: int = 20
    seed: int = 0


def make_environment(
    episodes: int | None, time_limit: float, breadcrumbs: Sequence[Sensor] = ()
) -> RearrangeEnv:
    """One object, eight decisions a second."""
    made = gymnasium.make(
        "mjsim/Rearrange-v0",
        objects=1,
        observations=("state", *breadcrumbs),
        actions=Continuous(repeat=3),
        time_limit=time_limit,
        episodes=episodes,
        physics_errors="truncate",  # a learner flails, and training should outlive it
    )
    environment = made.unwrapped
    if not isinstance(environment, RearrangeEnv):
        raise TypeError(f"expected a RearrangeEnv, got {environment!r}")
    return environment


def learn(settings: Settings, console: Console) -> tuple[Any, float, float]:
    """Train an agent.

    Returns:
        The Stable-Baselines3 model, and its share of delivered objects in unseen episodes before and after.
    """
    torch.manual_seed(settings.seed)
    torch.set_num_threads(1)  # the network is small: more threads wait for each other
    rng = np.random.default_rng(settings.seed)
    house = House.load()
    sensors = (breadcrumb_sensor(house.known()),) if settings.glasses else ()
    environment = make_environment(settings.episodes, 30.0, sensors)
    model = PPO(
        "MultiInputPolicy",
        environment,
        policy_kwargs={"net_arch": [256, 256], "activation_fn": torch.nn.ReLU},
        seed=settings.seed,
        device="cpu",
    )

    def driver(observation: ObservationDict) -> NDArray[np.float32]:
        action, _ = model.predict(observation, deterministic=True)
        return np.asarray(action, np.float32)

    before = evaluate(model, make_environment(None, 60.0, sensors), settings.evaluation)
    console.print(f"before: {before:.0%} delivered in {settings.evaluation} unseen episodes")
    gathered: list[Demonstrations] = []
    for number in range(settings.rounds + 1):
        started = time.perf_counter()
        shown = demonstrate(
            environment.core,
            house,
            seeds=range(settings.episodes),
            rng=rng,
            driver=driver if number else None,
            noise=0.0 if number else 0.15,
        )
        gathered.append(shown)
        loss = fit(model, gathered, epochs=settings.epochs, rng=rng)
        who = "learner" if number else "demonstrator"
        console.print(
            f"round {number}: the {who} delivered {shown.delivered:.0%}; {sum(len(d.actions) for d in gathered)} rows, "
            f"loss {loss:.4f}, {time.perf_counter() - started:.0f} s"
        )
    after = evaluate(model, make_environment(None, 60.0, sensors), settings.evaluation)
    console.print(f"after: {after:.0%} delivered in {settings.evaluation} unseen episodes")
    environment.close()
    return model, before, after


def fit(model: Any, shown: Sequence[Demonstrations], *, epochs: int, rng: np.random.Generator) -> float:
    """Fit the policy's mean action to the demonstrated ones; returns the last epoch's mean loss."""
    observations = {
        name: torch.as_tensor(np.concatenate([d.observations[name] for d in shown]))
        for name in shown[0].observations
    }
    actions = torch.as_tensor(np.concatenate([d.actions for d in shown]))
    weights = 1.0 + (TRIGGER_WEIGHT - 1.0) * (actions[:, 3:].abs() > 0.5)
    policy = model.policy
    policy.set_training_mode(True)
    optimizer = torch.optim.Adam(policy.parameters(), lr=1e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, epochs)
    losses: list[float] = []
    for _ in range(epochs):
        losses.clear()
        for rows in np.array_split(rng.permutation(len(actions)), max(1, len(actions) // 256)):
            taken = policy.get_distribution({k: v[rows] for k, v in observations.items()}).distribution.mean
            loss = (weights[rows] * (taken - actions[rows]) ** 2).mean()
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            losses.append(float(loss.detach()))
        schedule.step()
    return float(np.mean(losses))


def evaluate(model: Any, environment: RearrangeEnv, episodes: int) -> float:
    """Share of the objects that the policy delivers in episodes it never saw; closes the environment."""
    delivered = total = 0
    for seed in range(UNSEEN, UNSEEN + episodes):
        seen, info = environment.reset(seed=seed)
        over = False
        while not over:
            action, _ = model.predict(seen, deterministic=True)
            seen, _, terminated, truncated, info = environment.step(action)
            over = terminated or truncated
        delivered += info["delivered"]
        total += info["objects"]
    environment.close()
    return delivered / total


def main() -> None:
    """Run the example from the command line."""
    parser = argparse.ArgumentParser(description="Train an agent to deliver an object, by imitation.")
    parser.add_argument("--episodes", type=int, default=Settings.episodes, help="houses to learn in")
    parser.add_argument("--rounds", type=int, default=Settings.rounds, help="rounds of correction")
    parser.add_argument(
        "--without-glasses", action="store_true", help="do not show where the breadcrumbs lead"
    )
    parser.add_argument("--seed", type=int, default=Settings.seed)
    parser.add_argument("--out", type=Path, default=None, help="where to save the trained model (.zip)")
    given = parser.parse_args()
    console = Console()
    settings = Settings(
        episodes=given.episodes, rounds=given.rounds, seed=given.seed, glasses=not given.without_glasses
    )
    model, _, _ = learn(settings, console)
    if given.out is not None:
        model.save(given.out)
        console.print(f"saved {given.out}")


if __name__ == "__main__":
    main()
