"""One trial: an episode, an assistance condition, a participant and a seed, recorded into a run directory."""

import dataclasses
import hashlib
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.errors import ConfigError, UserCodeError
from experiments.familiarisation.familiarise import Familiarisation, familiarise
from experiments.house import House
from experiments.participants import participant
from experiments.participants.base import Participant
from experiments.runs import records
from experiments.runs.phases import TRAINING
from experiments.runs.recording import Recording, provenance
from experiments.runs.records import EventLog
from experiments.runs.run_directory import run_directory
from experiments.session.assistant import Assistant
from experiments.session.endings import INTERRUPTED
from experiments.session.first_person import FilmConfig, TrialFilm
from experiments.session.regrets import LiveRegrets, Regrets
from experiments.session.session import OnProgress, Progress, Session, Viewer
from experiments.session.task_board import TaskBoard
from experiments.session.user_code import make_participant
from experiments.signals import Stopped, signals_postponed
from experiments.trials.fingerprint import fingerprint, trial_inputs
from experiments.trials.person_distribution import PersonDistribution
from experiments.trials.training import training_config
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_record import NOTHING_FILMED, SessionResult, draw_floor_plan, save_record
from mjsim.episode import Episode
from mjsim.errors import PhysicsError
from mjsim.model.scene import Scene, compose
from mjsim.options import WorldOptions
from mjsim.person_parameters import PersonParameters
from mjsim.world import World
from planner.live import LiveReplanner
from planner.replanner import Replanner
from planner.route import RoutePlanner
from planner.solver import solver

_SESSION = 77  # sets the session's random numbers apart from those of the house with the same seed
_LIST_ORDER, _CHANCE, _PERSON, _BEHAVIOUR = range(4)  # purposes of random numbers in a session
FAMILIARISATION = 20.0  # s of wall time to prove the plan before the clock of a live trial starts


def run_trial(
    config: TrialConfig,
    out: Path,
    *,
    film: FilmConfig | None = None,
    topdown: bool = True,
    replace: bool = False,
    house: House | None = None,
    on_progress: OnProgress = lambda _: None,
    on_warning: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run a trial and write its record to `out`, whole or not at all; however it ended, what was simulated is kept.

    Args:
        config: What to run.
        out: Run directory.
        film: How to film it, or None for no video.
        topdown: Whether to draw the floor plan.
        replace: Whether `out` may take the place of an earlier run.
        house: A loaded house to use again; it must be the one that `config` names.
        on_progress: Called after every control step.
        on_warning: Called with what went wrong without harm to the record: no video, no floor plan.

    Returns:
        What `metrics.json` holds.

    Raises:
        ExperimentError, MjsimError, PlannerError, HudError: The configuration or the run directory is unusable, or
            participant or condition failed.
        PhysicsError: The physics failed.
        Stopped: A signal came when the session was over.
    """
    started = time.perf_counter()
    with signals_postponed() as signals:
        with run_directory(out, replace=replace) as folder:
            person = draw_person(config)
            house = (house or House.load(config.house)).for_person(person)
            scene = compose(trial_episode(config, house), house.catalogue, person=person)

            def progress(now: Progress) -> None:
                on_progress(now)
                signals.check()

            known = _before_the_task(config, house, person, folder, lambda _: signals.check())
            result = _Trial(config, house, scene, folder, film, known).run(progress)
            if result.error is not None and not result.has_steps:
                raise result.error
            signals.save()
            wall = time.perf_counter() - started
            metrics = save_record(folder, out, scene, result, wall)
        if result.error is not None:
            raise _kept(result.error, out)
    for warning in (
        result.no_film,
        draw_floor_plan(out, house, scene, result) if topdown else None,
    ):
        if warning is not None:
            on_warning(warning)
    if signals.number is not None and metrics["ended"] != INTERRUPTED:
        raise Stopped(signals.number)
    return metrics


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


def _kept(error: Exception, out: Path) -> Exception:
    """The error that ended a trial; it also says where the record is."""
    if isinstance(error, PhysicsError | UserCodeError):
        error.args = (f"{error} (kept for `mjsim replay {out}`)",)
    error.add_note(f"What was simulated is kept in {out}.")
    return error


@dataclass(frozen=True)
class _Trial:
    """A trial that is about to run in its working folder."""

    config: TrialConfig
    house: House
    scene: Scene
    folder: Path
    film: FilmConfig | None
    known: Familiarisation

    def run(self, on_progress: OnProgress) -> SessionResult:
        """Run the session; log and video are complete in the folder afterwards."""
        result = self._run_once(on_progress, rollouts=True)
        if isinstance(result.error, PhysicsError):
            # Again, step by step: the run is the same, and the record then leads up to the very step that failed.
            for path in self.folder.iterdir():
                if path.is_file():
                    path.unlink()
            result = self._run_once(on_progress, rollouts=False)
        return result

    def _run_once(self, on_progress: OnProgress, *, rollouts: bool) -> SessionResult:
        film = error = replanner = None
        with ExitStack() as stack:
            log = stack.enter_context(EventLog(self.folder / records.EVENTS))
            if self.film is not None:
                film = TrialFilm(self.scene, self.house, self.film, self.folder / records.VIDEO)
                stack.enter_context(film)
            if self.config.live:
                planner = solver(self.config.planner)
                live = LiveReplanner(self.house.geodesics, planner, capacity=self.config.capacity)
                replanner = stack.enter_context(live)
            session, _ = prepare_session(
                self.config,
                self.house,
                self.scene,
                log,
                film,
                replanner,
                rollouts=rollouts,
                user=self._make_user(),
            )
            self.known.log(log)
            try:
                session.run(on_progress)
            except Exception as failure:
                error = failure
        if film is None:
            return SessionResult.of_session(session, error)
        return SessionResult.of_session(
            session,
            error,
            frames_sha256=film.frames_sha256,
            renderer=film.renderer_name or NOTHING_FILMED,
            no_film=film.failure,
        )

    def _make_user(self) -> Participant:
        house, seen = self.house, self.known.seen
        return simulated_user(self.config, house if seen is None else dataclasses.replace(house, seen=seen))


def _before_the_task(
    config: TrialConfig, house: House, person: PersonParameters, folder: Path, on_progress: OnProgress
) -> Familiarisation:
    """Go through the phases before the task; the training is a run of its own in the run directory."""
    known = familiarise(config.phase_names, config.story, house, person)
    if TRAINING not in config.phase_names:
        return known
    started, training = time.perf_counter(), training_config(config)
    place = folder / records.TRAINING
    place.mkdir()
    scene = compose(trial_episode(training, house), house.catalogue, person=person)
    result = _Trial(training, house, scene, place, None, Familiarisation((), known.seen)).run(on_progress)
    if result.error is not None and not result.has_steps:
        raise result.error
    save_record(place, place, scene, result, time.perf_counter() - started)
    return known.trained(result.log.events)


def simulated_user(config: TrialConfig, house: House) -> Participant:
    """The participant that a trial names; `house` is what it knows."""
    rng = _session_rng(config.person_seed, _CHANCE)
    return make_participant(config.user, house, rng, draw_behaviour(config))


def prepare_session(
    config: TrialConfig,
    house: House,
    scene: Scene,
    log: EventLog,
    viewer: Viewer | None = None,
    replanner: RoutePlanner | None = None,
    *,
    rollouts: bool = True,
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
        rollouts: See `Session`.
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
        rollouts=rollouts,
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
    )
    if config.live:
        state = assistant.task_state(world.observation())
        route = replanner.prepare(state, seconds=FAMILIARISATION)
        regrets.prepare(state, route.plan)
    return assistant
