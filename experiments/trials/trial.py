"""Run a trial and record it in a run directory."""

import dataclasses
import os
import time
from collections.abc import Callable
from contextlib import chdir, closing, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.errors import UserCodeError, describe
from experiments.house import House
from experiments.record import records
from experiments.record.phases import INTERRUPTED, RECORDED, TRAINING, origin_of
from experiments.record.reader import Record
from experiments.record.records import EventLog
from experiments.record.run_directory import add_files, run_directory
from experiments.record.writer import NOTHING_FILMED, save_record
from experiments.session.familiarise import Familiarisation, familiarise
from experiments.session.film_config import FilmConfig
from experiments.session.session import OnProgress, Progress
from experiments.session.signals import Stopped, signals_postponed
from experiments.trials.floor_plan import draw_topdown
from experiments.trials.setup import (
    draw_person,
    prepare_session,
    simulated_user,
    trial_episode,
    trial_planner,
)
from experiments.trials.training import training_config
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import Scene, compose
from mjsim.support.files import work_folder
from mjsim.values.errors import PhysicsError
from mjsim.values.person_parameters import PersonParameters
from planner.service import Planner

if TYPE_CHECKING:
    from experiments.session.first_person import TrialFilm


def run_trial(
    config: TrialConfig,
    out: Path,
    *,
    film: FilmConfig | None = None,
    topdown: bool = True,
    replace: bool = False,
    scratch: Path | None = None,
    house: House | None = None,
    on_progress: OnProgress = lambda _: None,
    on_warning: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run a trial and atomically write its record to a folder, even if the trial ends early.

    Args:
        config: Settings of the trial.
        out: Run directory.
        film: Settings of the film, or None for no video.
        topdown: True to draw the floor plan.
        replace: True if an earlier run in `out` may be replaced.
        scratch: Parent of the temporary folder (default: the parent of `out`).
        house: The house that `config` names, if it is already loaded.
        on_progress: Called after every action.
        on_warning: Called with errors that do not affect the record, such as a failed video or floor plan.

    Returns:
        The content of `metrics.json`.

    Raises:
        ExperimentError, MjsimError, PlannerError, HudError: The settings or the run directory cannot be used, or
            the participant or the condition failed.
        PhysicsError: The physics failed.
        Stopped: A signal arrived after the session had ended.
    """
    started = time.perf_counter()
    with chdir("."), signals_postponed() as signals:  # custom code may change the current folder
        with run_directory(out, replace=replace, scratch=scratch) as folder:
            person = draw_person(config)
            house = (house or House.load(config.house)).for_person(person)
            episode = trial_episode(config, house)
            planner = trial_planner(config, house, episode)
            scene = compose(episode, house.catalogue, person=person, visuals=film is not None)

            def progress(now: Progress) -> None:
                on_progress(now)
                signals.check()

            known = _before_the_task(config, house, person, folder, lambda _: signals.check())
            filming = None if film is None else _make_film(scene, house, film, folder)
            result = _run_session(config, house, scene, known, progress, filming, planner)
            signals.save()
            metrics = result.save(folder, out, time.perf_counter() - started)
        if result.error is not None:
            raise _kept(result.error, out)
    for warning in (
        result.film.failure if result.film is not None else None,
        draw_floor_plan(out, house, result.record) if topdown else None,
    ):
        if warning is not None:
            on_warning(warning)
    if signals.number is not None and metrics["ended"] != INTERRUPTED:
        raise Stopped(signals.number)
    return metrics


def draw_floor_plan(run: Path, house: House, record: Record) -> str | None:
    """Draw the floor plan of a run. Return an error message, or None if this succeeded."""
    if not record.plans:
        return None
    try:
        origin = origin_of([record.start["user"]])
        origin = house.texts.recorded if origin == RECORDED else origin
        with work_folder(Path(os.path.realpath(run)).parent) as folder:
            walked = record.trajectory["position"]
            draw_topdown(folder / records.TOPDOWN, house, record.episode, record.plans[0], walked, origin)
            add_files(folder, run)
    except Exception as error:  # the record must be kept even if drawing fails
        return f"no floor plan: {describe(error)}"
    return None


def _kept(error: Exception, out: Path) -> Exception:
    if isinstance(error, PhysicsError | UserCodeError):
        error.args = (f"{error} (kept for `mjsim replay {out}`)",)
    error.add_note(f"The run is kept in {out}.")
    return error


@dataclass(frozen=True, eq=False)
class _SessionResult:
    record: Record
    error: Exception | None
    film: "TrialFilm | None"

    def save(self, folder: Path, out: Path, wall: float) -> dict[str, Any]:
        if self.error is not None and not self.record.steps:
            raise self.error
        if self.film is None:
            return save_record(folder, out, self.record, wall)
        renderer = self.film.renderer_name or NOTHING_FILMED
        return save_record(
            folder, out, self.record, wall, frames_sha256=self.film.frames_sha256, renderer=renderer
        )


def _run_session(
    config: TrialConfig,
    house: House,
    scene: Scene,
    known: Familiarisation,
    on_progress: OnProgress,
    film: "TrialFilm | None" = None,
    planner: Planner | None = None,
) -> _SessionResult:
    error, log = None, EventLog()
    planner = planner or trial_planner(config, house, scene.episode)
    known_house = house if known.seen is None else dataclasses.replace(house, seen=known.seen)
    with closing(planner), closing(film) if film else nullcontext():
        user = simulated_user(config, known_house)
        session, _ = prepare_session(config, house, scene, log, film, planner, user=user)
        known.log(log)
        try:
            session.run(on_progress)
        except Exception as failure:
            error = failure
    return _SessionResult(session.record.record(), error, film)


def _make_film(scene: Scene, house: House, config: FilmConfig, folder: Path) -> "TrialFilm":
    from experiments.session.first_person import (
        TrialFilm,  # imported late because OpenGL and FFmpeg load slowly
    )

    return TrialFilm(scene, house, config, folder / records.VIDEO)


def _before_the_task(
    config: TrialConfig, house: House, person: PersonParameters, folder: Path, on_progress: OnProgress
) -> Familiarisation:
    known = familiarise(config.phase_names, config.story, house, person)
    if TRAINING not in config.phase_names:
        return known
    started, training = time.perf_counter(), training_config(config)
    training_folder = folder / records.TRAINING
    training_folder.mkdir()
    scene = compose(trial_episode(training, house), house.catalogue, person=person, visuals=False)
    result = _run_session(training, house, scene, Familiarisation((), known.seen), on_progress)
    result.save(training_folder, training_folder, time.perf_counter() - started)
    return known.trained(result.record.events)
