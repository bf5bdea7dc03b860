"""One trial: an episode, an assistance condition, a participant and a seed, recorded into a run directory."""

import dataclasses
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.errors import UserCodeError
from experiments.familiarisation.familiarise import Familiarisation, familiarise
from experiments.house import House
from experiments.participants.base import Participant
from experiments.runs import records
from experiments.runs.phases import TRAINING
from experiments.runs.records import EventLog
from experiments.runs.run_directory import run_directory
from experiments.session.endings import INTERRUPTED
from experiments.session.film_config import FilmConfig
from experiments.session.first_person import TrialFilm
from experiments.session.viewer import OnProgress, Progress
from experiments.signals import Stopped, signals_postponed
from experiments.trials.setup import (
    draw_person,
    early_replanner,
    prepare_session,
    simulated_user,
    trial_episode,
)
from experiments.trials.training import training_config
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_record import NOTHING_FILMED, SessionResult, draw_floor_plan, save_record
from mjsim.errors import PhysicsError
from mjsim.model.scene import Scene, compose
from mjsim.person_parameters import PersonParameters
from planner.live import LiveReplanner
from planner.route import RoutePlanner
from planner.solver import solver


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
            episode = trial_episode(config, house)
            planner = early_replanner(config, house, episode)
            scene = compose(episode, house.catalogue, person=person, visuals=film is not None)

            def progress(now: Progress) -> None:
                on_progress(now)
                signals.check()

            known = _before_the_task(config, house, person, folder, lambda _: signals.check())
            result = _Trial(config, house, scene, folder, film, known, planner).run(progress)
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
    planner: RoutePlanner | None = None

    def run(self, on_progress: OnProgress) -> SessionResult:
        """Run the session; log and video are complete in the folder afterwards."""
        result = self._run_once(on_progress, rollouts=True)
        if isinstance(result.error, PhysicsError):
            # Again, step by step: the run is the same, and the record then leads up to the very step that failed.
            for path in self.folder.iterdir():
                if path.is_file():
                    path.unlink()
            planner = early_replanner(self.config, self.house, self.scene.episode)
            result = dataclasses.replace(self, planner=planner)._run_once(on_progress, rollouts=False)
        return result

    def _run_once(self, on_progress: OnProgress, *, rollouts: bool) -> SessionResult:
        film = error = None
        replanner = self.planner
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
                user=self._make_user(),
            )
            session.rollouts = session.rollouts and rollouts
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
    scene = compose(trial_episode(training, house), house.catalogue, person=person, visuals=False)
    result = _Trial(training, house, scene, place, None, Familiarisation((), known.seen)).run(on_progress)
    if result.error is not None and not result.has_steps:
        raise result.error
    save_record(place, place, scene, result, time.perf_counter() - started)
    return known.trained(result.log.events)
