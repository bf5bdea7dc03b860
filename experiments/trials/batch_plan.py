"""Check that the trials of a batch can be run, and find the trials that are missing from its folder."""

import dataclasses
import functools
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from experiments.errors import ConfigError
from experiments.house import House
from experiments.participants.registry import DEFAULT_PARTICIPANT, participant
from experiments.record.archive import discard
from experiments.record.records import EventLog
from experiments.record.run_directory import TRIALS
from experiments.trials.batch_folder import OUTDATED, StoredTrial, put_aside, trial_key, trial_name
from experiments.trials.design import counted
from experiments.trials.fingerprint import Inputs, changes, trial_inputs
from experiments.trials.setup import draw_behaviour, draw_person, prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import TrialReader
from hud.conditions import CONDITIONS, condition
from hud.errors import HudError
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import parse_house
from mjsim.house.compiled.house import MAX_HOUSES
from mjsim.house.scene.scene import compose
from mjsim.values.episode import POINTS, Episode
from mjsim.values.errors import EpisodeError, PersonError
from mjsim.values.person_parameters import PersonParameters
from planner.errors import PlannerError
from planner.solvers import solver

# Functions that look up a name in a setting, and raise an error if it is unknown
NAMES: Mapping[str, Callable[[str], object]] = {
    "user": participant,
    "assistance": condition,
    "training_assistance": condition,
    "planner": solver,
}
MAX_REASONS = 3  # maximum number of reasons that are listed in a note
Houses = Callable[[str], House]


@dataclass(frozen=True)
class BatchPlan:
    """The finished and the missing trials of a batch.

    Attributes:
        done: Trials of the design that are in the folder and would still have the same result.
        missing: Settings of all other trials of the design, by run directory.
        notes: Messages that explain which trials are rerun and why.
        stored: All trials in the folder, before outdated ones were moved.
        unusable: Error message for each trial in the folder that cannot be read.
    """

    done: tuple[StoredTrial, ...]
    missing: Mapping[Path, TrialConfig]
    notes: tuple[str, ...]
    stored: Sequence[StoredTrial]
    unusable: Mapping[Path, str]


def plan_batch(
    trials: Sequence[TrialConfig],
    inputs: Sequence[Inputs],
    out: Path,
    reader: TrialReader | None = None,
    prefix: str = "",
) -> BatchPlan:
    """Find the trials of a design that are missing from a folder, and move outdated trials out of the way.

    Only archives whose names begin with `prefix` are changed.
    """
    wanted = dict(zip(trials, inputs, strict=True))
    stored, unusable = (reader or TrialReader(out)).read()
    by_key: dict[str, list[StoredTrial]] = {}
    for found in stored:
        by_key.setdefault(found.key, []).append(found)
    done, missing, reasons = [], {}, Counter[str]()
    outdated, early = set[str](), set[str]()
    for trial, needed in wanted.items():
        same = [s for s in by_key.get(trial_key(trial.settings()), []) if s.is_in(trial.house, needed)]
        current = [s for s in same if s.complete and s.inputs == needed]
        for old in same:
            if old not in current:
                reasons.update([_why_again(old, needed)])
                (outdated if old.complete else early).add(old.path.name)
        if current:
            done.append(current[0])
            continue
        path = out / TRIALS / trial_name(trial, needed)
        if path in unusable:
            reasons.update([unusable[path]])
            outdated.add(path.name)
        missing[path] = trial
    put_aside(out, outdated, prefix)
    discard(out / TRIALS, early, prefix=prefix)
    return BatchPlan(tuple(done), missing, tuple(_notes(reasons, out)), stored, unusable)


def _why_again(trial: StoredTrial, inputs: Inputs) -> str:
    if not trial.complete:
        return f"ended early, {trial.row['ended']}"
    return f"{', '.join(changes(trial.inputs, inputs))} changed"


def _notes(reasons: Counter[str], out: Path) -> Iterable[str]:
    if reasons:
        why = "; ".join(f"{reason} ({count})" for reason, count in reasons.most_common(MAX_REASONS))
        yield f"run again: {counted(reasons.total(), 'trial')}: {why}; complete trials are kept in {out / OUTDATED}"


def check_names(trials: Sequence[TrialConfig]) -> None:
    """Raise an error that names the setting if a participant, condition, planner or behaviour is unknown."""
    for key, check in NAMES.items():
        for name in sorted({str(getattr(trial, key)) for trial in trials}):
            try:
                check(name)
            except (ConfigError, HudError, PlannerError) as error:
                raise type(error)(f"{key}: {error}") from error
    for trial in {(t.user, t.behaviour): t for t in trials}.values():
        draw_behaviour(trial)


def check_settings(trials: Sequence[TrialConfig], house: Houses) -> None:
    """Raise an error if a trial has an unknown name, house or episode, or too many points for its house."""
    check_names(trials)
    catalogue = functools.cache(load_catalogue)
    houses = {trial.house for trial in trials}
    for name in houses:
        catalogue(name)
    for trial in {(t.episode, t.house, t.objects): t for t in trials if t.episode is not None}.values():
        _check_episode(trial, catalogue(trial.house))
    custom = {name for name in houses if parse_house(name).kind != "shipped"}  # these may be small
    sampled = (t for t in trials if t.episode is None and (t.house in custom or t.points > POINTS))
    for name, seed, points in dict.fromkeys((t.house, t.house_seed, t.points) for t in sampled):
        house(name).sample_points(seed=seed, points=points)


def check_trials(trials: Sequence[TrialConfig]) -> list[Inputs]:
    """Check that trials have valid settings and files. Return hashes and versions of their inputs."""
    house = functools.lru_cache(MAX_HOUSES)(House.load)
    check_settings(trials, house)
    catalogue = functools.cache(load_catalogue)
    _check_people(trials, house)
    for trial in {(t.house, t.user, t.assistance): t for t in reversed(trials)}.values():
        if _may_not_fit(trial):
            _begin(trial, house(trial.house))
    return [trial_inputs(trial, catalogue(trial.house)) for trial in trials]


def _check_episode(trial: TrialConfig, catalogue: Catalogue) -> None:
    episode = Episode.load(Path(str(trial.episode)))
    if len(episode.objects) != trial.objects:
        raise ConfigError(f"objects is {trial.objects}, but {trial.episode} has {len(episode.objects)}")
    try:
        compose(episode, catalogue)
    except EpisodeError as error:
        raise EpisodeError(f"{trial.episode}: {error}") from error


def _check_people(trials: Iterable[TrialConfig], house: Houses) -> None:
    usual = PersonParameters()
    people: dict[str, dict[tuple[float, float], PersonParameters]] = {}
    for trial in trials:
        person = draw_person(trial)
        people.setdefault(trial.house, {})[person.body_radius, person.reach] = person
    for name, sizes in people.items():
        sizes.pop((usual.body_radius, usual.reach), None)
        if sizes:
            _check_sizes(house(name), sizes)


def _check_sizes(house: House, sizes: dict[tuple[float, float], PersonParameters]) -> None:
    radii, reaches = zip(*sizes, strict=True)
    try:
        house.for_person(dataclasses.replace(PersonParameters(), body_radius=max(radii), reach=min(reaches)))
    except (ConfigError, PersonError):
        for person in sizes.values():
            house.for_person(person)


def _may_not_fit(trial: TrialConfig) -> bool:
    return trial.user != DEFAULT_PARTICIPANT or trial.assistance.partition("-")[0] not in CONDITIONS


def _begin(trial: TrialConfig, house: House) -> None:
    """Start a trial with one object to check that the participant and the condition work together."""
    small = replace(trial, objects=1, episode=None, live=False)
    person = draw_person(small)
    house = house.for_person(person)
    scene = compose(trial_episode(small, house), house.catalogue, person=person)
    session, _ = prepare_session(small, house, scene, EventLog())
    session.begin()
