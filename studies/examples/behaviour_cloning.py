"""Worked example: train an agent to fetch and deliver an object by imitation, with Stable-Baselines3.

    pip install -e '.[learn]'
    python -m studies.examples.behaviour_cloning

A Stable-Baselines3 policy is fitted to the actions of a built-in participant. In the first round, the
participant acts. In later rounds, the policy acts, and the participant's choice in the same situation is
recorded (DAgger). The policy observes the breadcrumbs of the HUD. The share of objects that it delivers in
unseen episodes is printed before and after training. This takes a few minutes on a CPU.
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

from experiments import House
from mjsim.environments import Continuous, ObservationDict, RearrangeEnv, Sensor
from studies.examples.breadcrumbs import breadcrumb_sensor
from studies.examples.demonstrations import Demonstrations, demonstrate

UNSEEN = 1_000_000  # first seed of the evaluation episodes, which is larger than any training seed
TRIGGER_WEIGHT = 10.0  # weight of picks and places, which are rare but essential


@dataclass(frozen=True)
class Settings:
    """Settings of the training and of the evaluation.

    Attributes:
        episodes: Number of training episodes, each in another house.
        rounds: Number of rounds in which the policy acts and the participant corrects it.
        breadcrumbs: True if the policy observes the breadcrumbs.
        epochs: Number of passes over the data in each round.
        evaluation: Number of unseen episodes for the evaluation.
        seed: Seed of the networks and of all random numbers.
    """

    episodes: int = 80
    rounds: int = 1
    breadcrumbs: bool = True
    epochs: int = 15
    evaluation: int = 20
    seed: int = 0


def make_environment(episodes: int | None, time_limit: float, sensors: Sequence[Sensor] = ()) -> RearrangeEnv:
    """Create an environment with one object and 8 actions per second. It observes its state and `sensors`.

    Raises:
        TypeError: Gymnasium has created an environment of another class.
    """
    made = gymnasium.make(
        "mjsim.environments:mjsim/Rearrange-v0",
        objects=1,
        observations=("state", *sensors),
        actions=Continuous(repeat=3),
        time_limit=time_limit,
        episodes=episodes,
        physics_errors="truncate",  # an untrained policy may break the physics
    )
    environment = made.unwrapped
    if not isinstance(environment, RearrangeEnv):
        raise TypeError(f"expected a RearrangeEnv, got {environment!r}")
    return environment


def learn(settings: Settings, console: Console) -> tuple[Any, float, float]:
    """Train a policy by imitation.

    Returns:
        The Stable-Baselines3 model, and the share of objects delivered in unseen episodes before and after
        training.
    """
    torch.manual_seed(settings.seed)
    torch.set_num_threads(1)  # more threads do not help, because the network is small
    rng = np.random.default_rng(settings.seed)
    house = House.load()
    sensors = (breadcrumb_sensor(house),) if settings.breadcrumbs else ()
    environment = make_environment(settings.episodes, 30.0, sensors)
    network = {"net_arch": [256, 256], "activation_fn": torch.nn.ReLU}
    model = PPO("MultiInputPolicy", environment, policy_kwargs=network, seed=settings.seed, device="cpu")

    def driver(observation: ObservationDict) -> NDArray[np.float32]:
        action, _ = model.predict(observation, deterministic=True)
        return np.asarray(action, np.float32)

    def evaluated(when: str) -> float:
        share = evaluate(model, make_environment(None, 60.0, sensors), settings.evaluation)
        console.print(f"{when}: {share:.0%} delivered in {settings.evaluation} unseen episodes")
        return share

    before = evaluated("before")
    gathered: list[Demonstrations] = []
    for number in range(settings.rounds + 1):
        started = time.perf_counter()
        name, acts, noise = ("policy", driver, 0.0) if number else ("expert", None, 0.15)
        seeds = range(settings.episodes)
        shown = demonstrate(environment.core, house, seeds=seeds, rng=rng, driver=acts, noise=noise)
        gathered.append(shown)
        loss = fit(model, gathered, epochs=settings.epochs, rng=rng)
        samples, seconds = sum(len(d.actions) for d in gathered), time.perf_counter() - started
        console.print(
            f"round {number}: the {name} delivered {shown.delivered:.0%}; "
            f"{samples} samples, loss {loss:.4f}, {seconds:.0f} s"
        )
    after = evaluated("after")
    environment.close()
    return model, before, after


def fit(model: Any, shown: Sequence[Demonstrations], *, epochs: int, rng: np.random.Generator) -> float:
    """Fit the policy's mean action to the demonstrated actions. Return the mean loss of the last epoch."""
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
    """Return the share of objects that the policy delivers in unseen episodes. Close the environment."""
    delivered = total = 0
    for seed in range(UNSEEN, UNSEEN + episodes):
        seen, info = environment.reset(seed=seed)
        is_over = False
        while not is_over:
            action, _ = model.predict(seen, deterministic=True)
            seen, _, terminated, truncated, info = environment.step(action)
            is_over = terminated or truncated
        delivered += info["delivered"]
        total += info["objects"]
    environment.close()
    return delivered / total


def main() -> None:
    """Train and evaluate a policy with the settings given on the command line."""
    parser = argparse.ArgumentParser(description="Train an agent to deliver an object, by imitation.")
    parser.add_argument("--episodes", type=int, default=Settings.episodes, help="houses to learn in")
    parser.add_argument("--rounds", type=int, default=Settings.rounds, help="rounds of correction")
    parser.add_argument("--no-breadcrumbs", action="store_true", help="do not observe the breadcrumbs")
    parser.add_argument("--seed", type=int, default=Settings.seed, help="seed of the networks and the noise")
    parser.add_argument("--out", type=Path, help="file to save the trained model to (.zip)")
    given = parser.parse_args()
    console = Console()
    settings = Settings(given.episodes, given.rounds, not given.no_breadcrumbs, seed=given.seed)
    model, _, _ = learn(settings, console)
    if given.out is not None:
        model.save(given.out)
        console.print(f"saved {given.out}")


if __name__ == "__main__":
    main()
