"""Whether the trials of a batch can be run, as far as that shows before the first one starts."""

import dataclasses
import functools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from msgspec.structs import replace

from experiments.errors import ConfigError
from experiments.house import House
from experiments.participants.registry import DEFAULT_PARTICIPANT, participant
from experiments.record.records import EventLog
from experiments.trials.fingerprint import Inputs, trial_inputs
from experiments.trials.setup import draw_behaviour, draw_person, prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.conditions import CONDITIONS, condition
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import parse_house
from mjsim.house.compiled.house import MAX_HOUSES
from mjsim.house.scene.scene import compose
from mjsim.values.episode import POINTS, Episode
from mjsim.values.errors import EpisodeError, PersonError
from mjsim.values.person_parameters import PersonParameters
from planner.solvers import solver

Houses = Callable[[str], House]


def check_names(trials: Sequence[TrialConfig]) -> None:
    """Raise the error of a trial whose participant, assistance, planner or behaviour there is not."""
    for check, names in (
        (participant, {trial.user for trial in trials}),
        (condition, {name for trial in trials for name in (trial.assistance, trial.training_assistance)}),
        (solver, {trial.planner for trial in trials}),
    ):
        for name in sorted(names):
            check(name)
    for trial in {(t.user, t.behaviour): t for t in trials}.values():
        draw_behaviour(trial)


def check_trials(trials: Sequence[TrialConfig]) -> list[Inputs]:
    """What each trial depends on; raises the error of a trial that cannot be run, as far as that shows beforehand."""
    check_names(trials)
    catalogue = functools.cache(load_catalogue)
    house = functools.lru_cache(MAX_HOUSES)(House.load)
    for trial in {(t.episode, t.house, t.objects): t for t in trials if t.episode is not None}.values():
        _check_episode(trial, catalogue(trial.house))
    for name, seed, points in dict.fromkeys(
        (t.house, t.house_seed, t.points) for t in trials if _may_be_small(t)
    ):
        house(name).sample_points(seed=seed, points=points)
    _check_people(trials, house)
    for trial in {(t.house, t.user, t.assistance): t for t in reversed(trials)}.values():
        if _may_not_fit(trial):
            _begin(trial, house(trial.house))
    return [trial_inputs(trial, catalogue(trial.house)) for trial in trials]


def _may_be_small(trial: TrialConfig) -> bool:
    """The houses that come with the package have room for the usual points."""
    own = parse_house(trial.house).kind != "shipped"
    return trial.episode is None and (own or trial.points > POINTS)


def _check_episode(trial: TrialConfig, catalogue: Catalogue) -> None:
    episode = Episode.load(Path(str(trial.episode)))
    if len(episode.objects) != trial.objects:
        raise ConfigError(f"objects is {trial.objects}, but {trial.episode} holds {len(episode.objects)}")
    try:
        compose(episode, catalogue)
    except EpisodeError as error:
        raise EpisodeError(f"{trial.episode}: {error}") from error


def _check_people(trials: Iterable[TrialConfig], house: Houses) -> None:
    """Check that each person reaches every receptacle."""
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
    """If the widest body with the shortest reach fits, everyone does."""
    radii, reaches = zip(*sizes, strict=True)
    try:
        house.for_person(dataclasses.replace(PersonParameters(), body_radius=max(radii), reach=min(reaches)))
    except (ConfigError, PersonError):
        for person in sizes.values():
            house.for_person(person)


def _may_not_fit(trial: TrialConfig) -> bool:
    """The default participant makes do with whatever a condition of this package shows."""
    return trial.user != DEFAULT_PARTICIPANT or trial.assistance.partition("-")[0] not in CONDITIONS


def _begin(trial: TrialConfig, house: House) -> None:
    """Begin the trial with a single object, so that participant and condition meet; nothing is kept."""
    small = replace(trial, objects=1, episode=None, live=False)
    person = draw_person(small)
    house = house.for_person(person)
    scene = compose(trial_episode(small, house), house.catalogue, person=person)
    session, _ = prepare_session(small, house, scene, EventLog())
    session.begin()
