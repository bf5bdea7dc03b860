"""What a trial is made of: its person, its episode, and a session that is ready to run."""

import hashlib
from pathlib import Path

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House
from experiments.participants import participant
from experiments.participants.base import Participant
from experiments.runs import records
from experiments.runs.recording import Recording, provenance
from experiments.runs.records import EventLog
from experiments.session.assistant import Assistant, deliveries
from experiments.session.regrets import LiveRegrets, Regrets
from experiments.session.session import Session
from experiments.session.task_board import TaskBoard
from experiments.session.user_code import make_participant
from experiments.session.viewer import Viewer
from experiments.trials.fingerprint import fingerprint, trial_inputs
from experiments.trials.person_distribution import PersonDistribution
from experiments.trials.trial_config import TrialConfig
from mjsim.episode import Episode
from mjsim.model.scene import Scene
from mjsim.options import WorldOptions
from mjsim.person_parameters import PersonParameters
from mjsim.world import World
from planner.early import EarlyReplanner
from planner.exact.solver import ExactSolver
from planner.replanner import Replanner
from planner.route import RoutePlanner, TaskState
from planner.solver import solver

_SESSION = 77  # sets the session's random numbers apart from those of the house with the same seed
_LIST_ORDER, _CHANCE, _PERSON, _BEHAVIOUR = range(4)  # purposes of random numbers in a session
FAMILIARISATION = 20.0  # s of wall time to prove the plan before the clock of a live trial starts


def draw_person(config: TrialConfig) -> PersonParameters:
    """The participant of a trial, drawn by the person's seed.

    What `config.person` does not describe is drawn as the participant's factory says in its attribute `person`, a
    mapping as for `PersonDistribution.of`; what neither describes is usual.

    Raises:
        ConfigError: There is no such participant, or a value cannot be drawn.
    """
    factory = participant(config.user)
    try:
        of_participant = PersonDistribution.of(getattr(factory, "person", {}))
    except ConfigError as error:
        raise ConfigError(f"participant {config.user!r}: {error}") from error
    return of_participant.updated(config.person).draw(_session_rng(config.person_seed, _PERSON))


def draw_behaviour(config: TrialConfig) -> dict[str, float]:
    """The values of the participant model in a trial, drawn by the person's seed; empty if it has none.

    Raises:
        ConfigError: There is no such participant, or it has no such value.
    """
    parameters = getattr(participant(config.user), "behaviour", {})
    rng = _session_rng(config.person_seed, _BEHAVIOUR)
    return config.behaviour.draw(config.user, parameters, rng)


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


def simulated_user(config: TrialConfig, house: House) -> Participant:
    """The participant that a trial names; `house` is what it knows."""
    rng = _session_rng(config.person_seed, _CHANCE)
    return make_participant(config.user, house, rng, draw_behaviour(config))


def early_replanner(config: TrialConfig, house: House, episode: Episode) -> Replanner | None:
    """A replanner that makes its first plan while the world is made; None where the planner has to wait for it."""
    exact = solver(config.planner)
    if config.live or not isinstance(exact, ExactSolver):
        return None
    first = TaskState(
        position=(episode.start.x, episode.start.y),
        loose={placed.name: placed.position[:2] for placed in episode.objects},
        carried=(),
        deliveries=deliveries(house, episode),
    )
    return EarlyReplanner(house.geodesics, exact, first, capacity=config.capacity)


def prepare_session(
    config: TrialConfig,
    house: House,
    scene: Scene,
    log: EventLog,
    viewer: Viewer | None = None,
    replanner: RoutePlanner | None = None,
    *,
    world: World | None = None,
    user: Participant | None = None,
) -> tuple[Session, World]:
    """Make the world, the assistant and the participant of a trial, ready to run.

    Args:
        config: The trial.
        house: The house that it names, for the scene's person (`House.for_person`).
        scene: The composed episode, with the participant's body.
        log: Takes the events.
        viewer: Sees every control step, or None.
        replanner: Plans for the assistant; None for one whose plans repeat.
        world: A new world of the scene in the trial's fidelity; None to make one.
        user: The participant; None to make the one that is named.
    """
    order_rng = _session_rng(config.order_seed, _LIST_ORDER)
    order = [scene.index.names[i] for i in order_rng.permutation(len(scene.index.names))]
    world = world or World(scene, WorldOptions(fidelity=config.fidelity, capacity=config.capacity))
    behaviour = draw_behaviour(config)
    _log_start(config, house, world, order, log)
    drawn = {"behaviour": behaviour} if behaviour else {}
    log.append(0.0, records.PARTICIPANT, user=config.user, person=scene.person.as_dict(), **drawn)
    session = Session(
        world,
        _make_assistant(config, TaskBoard(house, scene.episode, order), world, log, replanner),
        user or simulated_user(config, house),
        Recording(world, log),
        walls=house.navmesh.outline,
        time_limit=config.limit,
        viewer=viewer,
    )
    return session, world


def _session_rng(seed: int, purpose: int) -> np.random.Generator:
    """The generator of one purpose in a session, apart from those of the house with the same seed."""
    return np.random.default_rng(np.random.SeedSequence([seed, _SESSION]).spawn(4)[purpose])


def _log_start(config: TrialConfig, house: House, world: World, order: list[str], log: EventLog) -> None:
    inputs = trial_inputs(config, house.catalogue)
    episode = world.scene.episode.to_json().encode()
    log.append(
        0.0,
        "start",
        format=records.LOG_FORMAT,
        **provenance(world),
        **config.settings(),
        fingerprint=fingerprint(config, inputs),
        inputs=inputs,
        episode_sha256=hashlib.sha256(episode).hexdigest(),
        order=order,
    )


def _make_assistant(
    config: TrialConfig, board: TaskBoard, world: World, log: EventLog, replanner: RoutePlanner | None
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
        background=isinstance(replanner, EarlyReplanner),
    )
    if config.live:
        state = assistant.task_state(world.observation())
        route = replanner.prepare(state, seconds=FAMILIARISATION)
        regrets.prepare(state, route.plan)
    return assistant
