"""Plan when simulated participants arrive, leave, return, reload a page or lose their connection."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import msgspec
import numpy as np

from experiments.record.phases import REHEARSAL
from experiments.study.file import Cell, Study
from experiments.visit.plan import COMPREHENSION, CONSENT, PLAYED
from experiments.visit.recruiter import Recruiter

Leaving = Literal["vanishes", "withdraws", "withdraws and deletes", "refuses", "fails", "gives up"]
STUDY_IDS, SUBMIT_TO = ("STUDY_ID", "projectId", "hitId"), "turkSubmitTo"  # query parameters in links
RETURNS, RELOADS, BAD, TWICE, WRONG = 0.1, 0.2, 0.15, 0.15, 0.1  # fractions of participants
HOW = (0.6, 0.2, 0.2)  # probabilities of the first three ways of leaving


@dataclass(frozen=True)
class Planned:
    """The planned behaviour of a simulated participant.

    Attributes:
        arrives: Time of arrival, in seconds of study time.
        leaves: Way in which the participant leaves the study early, or None.
        returns_in: Phase in which the participant closes the page and later reopens the link, or None.
        reloads_in: Phase in which the participant reloads the page, or None.
        bad: True if the connection is slow and interrupted.
        twice: True if the participant submits forms twice, opens links twice, and opens trials in a second page.
        wrong: True if the participant first submits each form with a mistake.
    """

    number: int
    seed: int
    arrives: float
    leaves: Leaving | None
    leaves_in: str
    returns_in: str | None
    reloads_in: str | None
    bad: bool
    twice: bool
    wrong: bool


def plan_people(
    phases: Sequence[str], people: int, seed: int, *, per_minute: float, dropouts: float
) -> list[Planned]:
    """Plan the behaviour of the participants in a rehearsal. Return them in order of arrival.

    Args:
        people: Number of participants. Their arrivals form a Poisson process.
        per_minute: Mean number of arrivals per minute of study time.
    """
    found, arrives = [], 0.0
    for number in range(people):
        rng = np.random.default_rng([seed, number])
        arrives += float(rng.exponential(60.0 / per_minute))
        leaves, leaves_in = _leaving(phases, rng) if rng.random() < dropouts else (None, "")
        returns, reloads = (str(rng.choice(phases[:-1])) for _ in range(2))
        found.append(
            Planned(
                number,
                int(rng.integers(2**53)),
                arrives,
                leaves,
                leaves_in,
                returns if rng.random() < RETURNS else None,
                reloads if rng.random() < RELOADS else None,
                bool(rng.random() < BAD),
                bool(rng.random() < TWICE),
                bool(rng.random() < WRONG),
            )
        )
    return found


def _leaving(phases: Sequence[str], rng: np.random.Generator) -> tuple[Leaving, str]:
    phase = str(rng.choice(phases[:-1]))
    if phase == CONSENT and rng.random() < 0.5:
        return "refuses", phase
    if phase == COMPREHENSION and rng.random() < 0.5:
        return "fails", phase
    how: tuple[Leaving, ...] = ("vanishes", "withdraws", "withdraws and deletes")
    return how[int(rng.choice(len(how), p=HOW))], phase


def moment(phase: str, rng: np.random.Generator) -> int:
    """Draw the number of inputs after which a trial is interrupted."""
    return int(rng.integers(2, 15 if phase == PLAYED[0] else 60))


def link_parameters(study: Study, platform: Recruiter) -> dict[str, str]:
    """Return the query parameters of a platform's links, with empty values for participant ids."""
    settings = study.settings.recruitment
    own = {**dict.fromkeys(STUDY_IDS, settings.study_id), SUBMIT_TO: next(iter(settings.sites), "")}
    return {name: own.get(name, "") for name in platform.parameters}


def rehearsed(study: Study, factor: float) -> Study:
    """Copy a study for simulated participants, and divide all minimum durations and timeouts by a factor."""
    settings = study.settings
    away = ("abandoned_after", "timed_out_after")
    shorter = {name: getattr(settings.limits, name) / factor for name in away}
    limits = msgspec.structs.replace(settings.limits, **shorter)
    minimum = {name: seconds / factor for name, seconds in settings.minimum.items()}
    cells = [
        Cell([msgspec.structs.replace(trial, user=REHEARSAL) for trial in c.trials]) for c in study.cells
    ]
    settings = msgspec.structs.replace(settings, limits=limits, minimum=minimum)
    return replace(study, cells=cells, settings=settings, rehearsal=True)
