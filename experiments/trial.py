"""One trial: an episode, an assistance condition, a participant and a seed, recorded into a run directory."""

import hashlib
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments import records
from experiments.assistant import Assistant
from experiments.checksums import write_checksums
from experiments.conditions import TaskBoard
from experiments.errors import ConfigError
from experiments.files import save_arrays, write_json
from experiments.first_person import FilmConfig, Filming, FirstPersonRenderer
from experiments.house import House
from experiments.metrics import measure
from experiments.participants import participant
from experiments.recording import Recording, provenance
from experiments.records import Event, EventLog
from experiments.regrets import LiveRegrets, Regrets
from experiments.run_directory import keep_failed, run_directory
from experiments.session import OnProgress, Session, Viewer
from experiments.trial_config import TrialConfig
from experiments.video import VideoWriter
from mjsim.episode import Episode
from mjsim.errors import PhysicsError
from mjsim.model.scene import Scene, compose
from mjsim.options import WorldOptions
from mjsim.render import gl_info
from mjsim.world import World
from planner.live import LiveReplanner
from planner.replanner import Replanner
from planner.solver import solver

_SESSION = 77  # sets the session's random numbers apart from those of the house with the same seed
_LIST_ORDER, _PERSON = 0, 1  # purposes of random numbers in a session
NOTHING_DRAWN = "none: nothing was drawn"  # in place of the renderer's name
FAMILIARISATION = 20.0  # s of wall time to prove the plan before the clock of a live trial starts


def run_trial(
    config: TrialConfig,
    out: Path,
    *,
    film: FilmConfig | None = None,
    topdown: bool = True,
    house: House | None = None,
    on_progress: OnProgress = lambda _: None,
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
        ExperimentError, MjsimError, PlannerError, HudError: The configuration or the run directory is unusable.
        PhysicsError: The physics failed. What led there is kept beside `out`, and the message says where.
    """
    started = time.perf_counter()
    house = house or House.load(config.house)
    episode = trial_episode(config, house)
    with run_directory(out) as folder:
        scene = compose(episode, house.catalogue)
        result = _simulate(config, house, scene, folder, film, on_progress)
        arrays = _write_record(folder, episode, result)
        if isinstance(result.ended, PhysicsError):
            write_checksums(folder, records.FILES)
            kept = keep_failed(folder, out)
            raise PhysicsError(f"{result.ended} (kept for `mjsim replay {kept}`)") from result.ended
        if topdown:
            from experiments.analysis.topdown import draw_topdown  # matplotlib: batches do without

            draw_topdown(folder / records.TOPDOWN, house, scene, result.plans[0], arrays)
        metrics = {
            **measure(result.log.events, arrays),
            "frames_sha256": result.frames_sha256,
            # The floor plan is drawn as well. Asking for the renderer's name where nothing is drawn would start it.
            "renderer": gl_info().renderer if film or topdown else NOTHING_DRAWN,
            "wall_s": round(time.perf_counter() - started, 3),
        }
        write_json(folder / records.METRICS, metrics)
        write_checksums(folder, records.FILES)
    return metrics


def trial_episode(config: TrialConfig, house: House) -> Episode:
    """The disorganized house of a trial: sampled, or read from its file.

    Raises:
        ConfigError: The file holds another number of objects than the trial.
        EpisodeError, SamplingError: There is no such episode.
    """
    if config.episode is None:
        return house.sample_episode(objects=config.objects, seed=config.house_seed, points=config.points)
    episode = Episode.load(Path(config.episode))
    if len(episode.objects) != config.objects:
        raise ConfigError(
            f"objects is {config.objects}, but {config.episode} holds {len(episode.objects)}; leave it out"
        )
    return episode


@dataclass(frozen=True, eq=False)
class _SessionResult:
    """A session that is over: why it ended, or how the physics failed, and the hash of the frames filmed."""

    session: Session
    log: EventLog
    ended: str | PhysicsError
    frames_sha256: str | None

    @property
    def plans(self) -> list[Event]:
        """Every plan that was logged."""
        return [event for event in self.log.events if event["event"] == "plan"]


def _write_record(folder: Path, episode: Episode, result: _SessionResult) -> dict[str, NDArray[Any]]:
    """Write what the session left behind, and return the arrays of its trajectory."""
    arrays = result.session.trajectory.arrays()
    episode.save(folder / records.EPISODE)
    save_arrays(folder / records.TRAJECTORY, arrays)
    result.session.recording.save(folder / records.RECORDING, arrays["action"])
    write_json(folder / records.PLAN, result.plans)
    return arrays


def _simulate(
    config: TrialConfig,
    house: House,
    scene: Scene,
    folder: Path,
    film: FilmConfig | None,
    on_progress: OnProgress,
) -> _SessionResult:
    """Run the session of a trial; log and video are complete in `folder` afterwards."""
    result = _simulate_once(config, house, scene, folder, film, on_progress, rollouts=True)
    if isinstance(result.ended, PhysicsError) and config.fidelity != "full":
        # Again, step by step: the run is the same, and the record then leads up to the very step that failed.
        for path in folder.iterdir():
            path.unlink()
        result = _simulate_once(config, house, scene, folder, film, on_progress, rollouts=False)
    return result


def _simulate_once(
    config: TrialConfig,
    house: House,
    scene: Scene,
    folder: Path,
    film: FilmConfig | None,
    on_progress: OnProgress,
    *,
    rollouts: bool,
) -> _SessionResult:
    with ExitStack() as stack:
        log = stack.enter_context(EventLog(folder / records.EVENTS))
        video = viewer = None
        if film is not None:
            renderer = stack.enter_context(FirstPersonRenderer(scene, house, film))
            writer = VideoWriter(folder / records.VIDEO, width=film.width, height=film.height)
            video = stack.enter_context(writer)
            viewer = Filming(renderer, video)
        replanner = None
        if config.live:
            replanner = stack.enter_context(
                LiveReplanner(house.geodesics, solver(config.planner), capacity=config.capacity)
            )
        session, _ = prepare_session(config, house, scene, log, viewer, replanner, rollouts=rollouts)
        try:
            ended: str | PhysicsError = session.run(on_progress)
        except PhysicsError as error:
            ended = error
    return _SessionResult(session, log, ended, video.frames_sha256 if video else None)


def prepare_session(
    config: TrialConfig,
    house: House,
    scene: Scene,
    log: EventLog,
    viewer: Viewer | None = None,
    replanner: Replanner | None = None,
    *,
    rollouts: bool = True,
    world: World | None = None,
) -> tuple[Session, World]:
    """Make the world, the assistant and the participant of a trial, ready to run.

    Args:
        config: The trial.
        house: The house that it names.
        scene: The composed episode.
        log: Takes the events.
        viewer: Sees every control step, or None.
        replanner: Plans for the assistant; None for one whose plans repeat.
        rollouts: See `Session`.
        world: A new world of the scene in the trial's fidelity; None to make one.
    """
    order_rng = _session_rng(config.order_seed, _LIST_ORDER)
    order = [scene.index.names[i] for i in order_rng.permutation(len(scene.index.names))]
    world = world or World(scene, WorldOptions(fidelity=config.fidelity, capacity=config.capacity))
    _log_start(config, world, order, log)
    session = Session(
        world,
        _make_assistant(config, TaskBoard(house, scene.episode, order), world, log, replanner),
        participant(config.user)(house, _session_rng(config.person_seed, _PERSON)),
        Recording(world, log),
        walls=house.navmesh.outline,
        time_limit=config.limit,
        viewer=viewer,
        rollouts=rollouts,
    )
    return session, world


def _session_rng(seed: int, purpose: int) -> np.random.Generator:
    """The generator of one purpose in a session, apart from those of the house with the same seed."""
    return np.random.default_rng(np.random.SeedSequence([seed, _SESSION]).spawn(2)[purpose])


def _log_start(config: TrialConfig, world: World, order: list[str], log: EventLog) -> None:
    episode = world.scene.episode.to_json().encode()
    log.append(
        0.0,
        "start",
        format=records.LOG_FORMAT,
        **provenance(world),
        **config.settings(),
        episode_sha256=hashlib.sha256(episode).hexdigest(),
        order=order,
    )


def _make_assistant(
    config: TrialConfig, board: TaskBoard, world: World, log: EventLog, replanner: Replanner | None
) -> Assistant:
    """The assistant of a trial; for a live one, all that takes long is done before the clock starts."""
    geodesics = board.house.geodesics
    replanner = replanner or Replanner(geodesics, solver(config.planner), capacity=config.capacity)
    regrets = (LiveRegrets if config.live else Regrets)(geodesics, config.capacity)
    assistant = Assistant(
        board,
        assistance=config.assistance,
        planner=replanner,
        log=log,
        regrets=regrets,
        log_regrets=config.regret,
        options=world.options,
    )
    if config.live:
        state = assistant.task_state(world.observation())
        route = replanner.prepare(state, seconds=FAMILIARISATION)
        regrets.prepare(state, route.plan)
    return assistant
