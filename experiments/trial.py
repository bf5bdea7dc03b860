"""One trial: an episode, an assistance condition, a participant and a seed, recorded into a run directory."""

import dataclasses
import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments import records
from experiments.analysis.topdown import draw_topdown
from experiments.assistant import Assistant
from experiments.errors import ConfigError
from experiments.glasses import FilmConfig, Filming, Glasses
from experiments.house import House
from experiments.metrics import compute_metrics
from experiments.participants import default_participant, participant
from experiments.records import EventLog
from experiments.session import Progress, Session, Viewer
from experiments.video import VideoWriter
from mjsim.scene import Scene, compose
from mjsim.world import World
from planner.replanner import Replanner
from planner.solver import solver

_SESSION = 77  # keeps the session's chance apart from that of the house with the same seed
SECONDS_PER_OBJECT = 150.0  # s; several times what the slowest searcher takes


@dataclass(frozen=True)
class TrialConfig:
    """Everything that decides how a trial goes; equal configurations give equal records.

    Attributes:
        objects: How many misplaced objects.
        assistance: Assistance condition.
        seed: Seed of the house, the participant and the list order.
        user: Participant, or None for the one that makes the most of the condition.
        house: House name, or path of a catalogue.
        planner: Solver of the routing problem.
        time_limit: Simulated time after which the trial ends, s; None for a generous one.
    """

    objects: int
    assistance: str
    seed: int
    user: str | None = None
    house: str = "apartment"
    planner: str = "ortools"
    time_limit: float | None = None

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ConfigError(f"seed must not be negative, got {self.seed}")
        if self.time_limit is not None and not self.time_limit > 0:
            raise ConfigError(f"time limit must be positive, got {self.time_limit} s")

    @property
    def user_name(self) -> str:
        """The participant's name, with the default filled in."""
        return self.user or default_participant(self.assistance)

    @property
    def limit(self) -> float:
        """Simulated time after which the trial ends, s."""
        return self.time_limit if self.time_limit is not None else 60.0 + SECONDS_PER_OBJECT * self.objects


def run_trial(
    config: TrialConfig,
    out: Path,
    *,
    film: FilmConfig | None = None,
    topdown: bool = True,
    house: House | None = None,
    on_progress: Callable[[Progress], None] = lambda _: None,
) -> dict[str, Any]:
    """Run a trial and write its record to `out`, whole or not at all.

    Args:
        config: What to run.
        out: Run directory; an earlier run there is replaced.
        film: How to film it, or None for no video.
        topdown: Whether to draw the floor plan.
        house: A loaded house to use again; it must be the one that `config` names.
        on_progress: Called after every control step.

    Returns:
        What `metrics.json` holds.

    Raises:
        ExperimentError, MjsimError, PlannerError, HudError: The configuration or the run directory is unusable, or the
            physics failed.
    """
    started = time.perf_counter()
    house = house or House.load(config.house)
    episode = house.sample_episode(objects=config.objects, seed=config.seed)
    with records.run_directory(out) as folder:
        scene = compose(episode, house.catalogue)
        with EventLog(folder / records.EVENTS) as log:
            if film is None:
                shown: dict[str, Any] = {"frames_sha256": None, "renderer": None}
                session, world = prepare_session(config, house, scene, log)
                reason = session.run(on_progress)
            else:
                with (
                    Glasses(scene, house, film) as glasses,
                    VideoWriter(folder / records.VIDEO, width=film.width, height=film.height) as video,
                ):
                    session, world = prepare_session(config, house, scene, log, Filming(glasses, video))
                    reason = session.run(on_progress)
                shown = {"frames_sha256": video.frames_sha256, "renderer": glasses.renderer_name}
        arrays = session.trajectory.arrays()
        episode.save(folder / records.EPISODE)
        session.trajectory.save(folder / records.TRAJECTORY)
        plans = [e for e in log.events if e["event"] == "plan"]
        records.write_json(folder / records.PLAN, plans)
        if topdown:
            draw_topdown(folder / records.TOPDOWN, house, scene, plans[0], arrays)
        metrics = {
            **_settings(config),
            "ended": reason,
            **dataclasses.asdict(compute_metrics(log.events, arrays["position"])),
            **_health(world, arrays),
            **shown,
            "wall_s": round(time.perf_counter() - started, 3),
        }
        records.write_json(folder / records.METRICS, metrics)
    return metrics


def prepare_session(
    config: TrialConfig, house: House, scene: Scene, log: EventLog, viewer: Viewer | None = None
) -> tuple[Session, World]:
    """Make the world, the assistant and the participant of a trial, ready to run.

    Args:
        config: The trial.
        house: The house that it names.
        scene: The composed episode.
        log: Takes the events.
        viewer: Sees every control step, or None.
    """
    episode = scene.episode
    order_rng, user_rng = (
        np.random.default_rng(s) for s in np.random.SeedSequence([config.seed, _SESSION]).spawn(2)
    )
    names = [o.name for o in episode.objects]
    order = [names[i] for i in order_rng.permutation(len(names))]
    log.append(
        0.0,
        "start",
        format=records.LOG_FORMAT,
        **_settings(config),
        episode_sha256=hashlib.sha256(episode.to_json().encode()).hexdigest(),
        order=order,
    )
    assistant = Assistant(
        house,
        episode,
        assistance=config.assistance,
        replanner=Replanner(house.geodesics, solver(config.planner)),
        order=order,
        log=log,
    )
    world = World(scene)
    session = Session(
        world,
        assistant,
        participant(config.user_name)(house.known(), user_rng),
        log=log,
        targets=episode.targets,
        time_limit=config.limit,
        viewer=viewer,
    )
    return session, world


def _settings(config: TrialConfig) -> dict[str, Any]:
    settings = dataclasses.asdict(config)
    return {**settings, "user": config.user_name, "time_limit": config.limit}


def _health(world: World, arrays: dict[str, Any]) -> dict[str, Any]:
    health = world.health
    return {
        "max_penetration_m": health.max_penetration_m,
        "max_weld_error_m": health.max_weld_error_m,
        "simulated_s": float(arrays["time"][-1]),
    }
