"""Set up a trial: draw its person, choose its episode, and create a session that is ready to run."""

import hashlib
from pathlib import Path

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House
from experiments.participants.base import Participant
from experiments.participants.distribution import Distributions, draw
from experiments.participants.registry import participant
from experiments.record import records
from experiments.record.journal import Journal
from experiments.record.records import EventLog
from experiments.record.writer import RecordWriter, provenance
from experiments.session.assistant import Assistant, deliveries
from experiments.session.own_planner import planner_named
from experiments.session.session import Session, Viewer
from experiments.session.task_board import TaskBoard
from experiments.session.user_code import make_participant
from experiments.trials.fingerprint import fingerprint, trial_inputs
from experiments.trials.person import DEFAULT, check_person, drawn_person
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import Scene
from mjsim.values.episode import Episode
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.world import World
from planner.regret import RegretEvaluator
from planner.route import TaskState
from planner.service import Planner
from planner.solver_source import SolverSource

_SESSION = 77  # keeps the session's random numbers independent of the house's random numbers
_LIST_ORDER, _CHANCE, _PERSON, _BEHAVIOUR = range(4)  # indices of a session's random streams
# How long a live trial waits for a proof of its first plan, and then for regrets, in seconds
PREPARATION_S = 0.6


def draw_person(config: TrialConfig) -> PersonParameters:
    """Draw the body parameters of a trial's participant, using the person seed.

    Parameters without a distribution in `config.person` are drawn from the mapping `person` of the
    participant's factory, which is used as in `Distributions.of`. All other parameters have default values.
    """
    factory = participant(config.user)
    try:
        of_participant = Distributions.of(getattr(factory, "person", {}))
        check_person(of_participant)
    except ConfigError as error:
        raise ConfigError(f"participant {config.user!r}: {error}") from error
    described = of_participant.updated(config.person)
    if not described:
        return DEFAULT
    return drawn_person(described, _session_rng(config.person_seed, _PERSON))


def draw_behaviour(config: TrialConfig) -> dict[str, float]:
    """Draw the parameters of the participant model, if it has any, using the person seed."""
    parameters = getattr(participant(config.user), "behaviour", {})
    rng = _session_rng(config.person_seed, _BEHAVIOUR)
    values = draw(parameters, config.behaviour, rng, f"participant {config.user!r}")
    for name, value in values.items():
        parameters[name].check(name, value)
    return values


def trial_episode(config: TrialConfig, house: House) -> Episode:
    """Return the episode of a trial, which is sampled or read from a file."""
    if config.episode is None:
        return house.sample_episode(objects=config.objects, seed=config.house_seed, points=config.points)
    episode = Episode.load(Path(config.episode))
    if len(episode.objects) != config.objects:
        raise ConfigError(
            f"objects is {config.objects}, but {config.episode} has {len(episode.objects)}; leave it out"
        )
    return episode


def simulated_user(config: TrialConfig, house: House) -> Participant:
    rng = _session_rng(config.person_seed, _CHANCE)
    return make_participant(config.user, house, rng, draw_behaviour(config))


def solver_source(config: TrialConfig, house: House) -> SolverSource:
    return SolverSource(house.geodesics, planner_named(config.planner), capacity=config.capacity)


def regret_evaluator(config: TrialConfig, house: House) -> RegretEvaluator:
    return RegretEvaluator(house.geodesics, capacity=config.capacity)


def trial_planner(config: TrialConfig, house: House, episode: Episode) -> Planner:
    """Create a planner for a trial. The caller must close the planner.

    A live planner prepares the first plan before the clock of the trial starts.
    """
    planner = Planner(solver_source(config, house), regret_evaluator(config, house), live=config.live)
    if config.live:
        planner.prepare(first_state(house, episode), seconds=PREPARATION_S)
    return planner


def first_state(house: House, episode: Episode) -> TaskState:
    """Return the initial task state of an episode."""
    return TaskState(
        position=(episode.start.x, episode.start.y),
        loose={placed.name: placed.position[:2] for placed in episode.objects},
        carried=(),
        deliveries=deliveries(house, episode),
    )


def prepare_session(
    config: TrialConfig,
    house: House,
    scene: Scene,
    log: EventLog,
    viewer: Viewer | None = None,
    planner: Planner | None = None,
    *,
    world: World | None = None,
    user: Participant | None = None,
    journal: Journal | None = None,
) -> tuple[Session, World]:
    """Create the world, the assistant and the participant of a trial, and a session that uses them.

    Args:
        config: The settings of the trial.
        house: The house for the scene's person (`House.for_person`).
        scene: The composed episode.
        log: The event log.
        viewer: Viewer that shows the session, or None.
        planner: Planner to use, or None to create the planner that the settings name.
        world: A new world to use, or None to create one.
        user: Participant to use, or None to create the participant that the settings name.
        journal: Journal that receives the record, or None to keep the record in memory.
    """
    order_rng = _session_rng(config.order_seed, _LIST_ORDER)
    planner = planner or Planner(solver_source(config, house), regret_evaluator(config, house))
    order = [scene.index.names[i] for i in order_rng.permutation(len(scene.index.names))]
    options = WorldOptions(fidelity=config.fidelity, capacity=config.capacity)
    world = world or World(scene, options, walls=house.navmesh.outline)
    behaviour = draw_behaviour(config)
    _log_start(config, house, world, order, log)
    drawn = {"behaviour": behaviour} if behaviour else {}
    log.append(0.0, records.PARTICIPANT, user=config.user, person=scene.person.as_dict(), **drawn)
    session = Session(
        world,
        Assistant(
            TaskBoard(house, scene.episode, order, scene.person.eye_height),
            assistance=config.assistance,
            planner=planner,
            log=log,
            log_regrets=config.regret,
            options=world.options,
        ),
        user or simulated_user(config, house),
        RecordWriter(scene.episode, log, journal),
        time_limit=config.limit,
        viewer=viewer,
    )
    return session, world


def _session_rng(seed: int, purpose: int) -> np.random.Generator:
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
        rooms=len(house.catalogue.rooms),
        area_m2=round(house.rooms.area, 2),
    )
