"""The events of a log, one type for each line of `events.jsonl`; docs/data.md is made from them."""

from typing import Annotated, Literal

import msgspec

from mjsim.actions import EventKind, Refusal
from planner.plan import Status, VisitKind

Seconds = Annotated[float, msgspec.Meta(ge=0.0)]
Metres = Annotated[float, msgspec.Meta(ge=0.0)]
Count = Annotated[int, msgspec.Meta(ge=0)]
VisitPair = tuple[VisitKind, str]


class Logged(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="event", tag=str.lower, kw_only=True
):
    """A line of the log.

    Attributes:
        t: Simulated time, s.
    """

    t: Seconds


class Start(Logged, frozen=True, forbid_unknown_fields=False):
    """First line: what was run, and on what. The settings of the trial stand here too, as in `metrics.json`.

    Attributes:
        format: Format of the log.
        versions: Versions of mjsim, its physics code, MuJoCo and NumPy, and the machine's architecture.
        model: Fingerprint of the compiled house with its objects, without what is only drawn.
        world: Options of the world: timestep, capacity, grip, fidelity.
        fingerprint: Hash of the settings and of `inputs`.
        inputs: What the trial depends on besides its settings, by hash or version: the house, the code, libraries.
        episode_sha256: SHA-256 of `episode.json`.
        order: Object names in the participant's own random order.
        objects: How many misplaced objects.
        assistance: Assistance condition.
        house: House name, or path of its catalogue.
        time_limit: Simulated time after which the trial ends, s.
    """

    format: int
    versions: dict[str, str]
    model: str
    world: dict[str, float | str]
    fingerprint: str
    inputs: dict[str, str]
    episode_sha256: str
    order: list[str]
    objects: Count
    assistance: str
    house: str
    time_limit: Seconds


class Participant(Logged, frozen=True):
    """Second line: who took part.

    Attributes:
        user: The simulated participant.
        person: Every value of the person that was drawn, by name; those of the hands under `motion` (docs/people.md).
        behaviour: Every value of the participant model that was drawn, by name; absent for models without any.
    """

    user: str
    person: dict[str, float | dict[str, float]]
    behaviour: dict[str, float] | None = None


class Plan(Logged, frozen=True):
    """The assistant made a plan: at the start, where the person did something else, or a better one.

    Attributes:
        cost_m: Length of the planned tour from where the person was, from place to place, m.
        lower_bound_m: No tour between these places is shorter, m.
        status: `optimal` if the planner proved it, else `feasible`.
        visits: The tour: what is done, with which object.
        improved: Whether it is a better plan for the same state of the task.
        reach_bound_m: Of the first plan: the least walk for somebody who reaches, m (docs/metrics.md).
    """

    cost_m: Metres
    lower_bound_m: Metres
    status: Status
    visits: list[VisitPair]
    improved: bool = False
    reach_bound_m: Metres | None = None


class Attempt(Logged, frozen=True):
    """The person tried to pick or place something.

    Attributes:
        action: `pick` or `place`.
        object: The object, or null where none was named and none was found.
        applied: Whether the motion began.
        refusal: Why not, or null.
    """

    action: VisitKind
    object: str | None
    applied: bool
    refusal: Refusal | None


class Visit(Logged, frozen=True):
    """A pick or place succeeded.

    Attributes:
        kind: `pick` or `place`.
        object: The object.
        suggested: The visit that was suggested, or null.
        deviated: Whether it is another one.
        alternatives: How many other visits were feasible.
        tied_alternatives: How many of them place another object into the bin of the suggested visit.
        tied: Whether the visit deviates only in which object goes first into that bin.
        position: Where the person stood, m.
        geodesic_m: Shortest walk from where the person stood at the visit before, m.
        location_m: The planner's distance from the place of the visit before to the place of this one, m.
        regret_m: By how much the visit makes the rest of the task longer than the best one, m; null where not known,
            absent without regrets.
        suggested_regret_m: The same of the suggested visit, m.
    """

    kind: VisitKind
    object: str
    suggested: VisitPair | None
    deviated: bool
    alternatives: Count
    tied_alternatives: Count
    tied: bool
    position: tuple[float, float]
    geodesic_m: Metres
    location_m: Metres
    regret_m: Metres | None = None
    suggested_regret_m: Metres | None = None


class Regret(Logged, frozen=True):
    """Regrets of a visit that were found after the task.

    Attributes:
        visit: Number of the visit, from 0.
        regret_m: As in `visit`.
        suggested_regret_m: As in `visit`.
    """

    visit: Count
    regret_m: Metres | None = None
    suggested_regret_m: Metres | None = None


class PhaseBegun(Logged, frozen=True, tag="phase_begun"):
    """A phase before the task began; the clock of the task stands still. Without these events there was only the task.

    Attributes:
        phase: `story`, `flythrough` or `training`.
    """

    phase: Literal["story", "flythrough", "training"]


class PhaseEnded(Logged, frozen=True, tag="phase_ended"):
    """A phase before the task ended.

    Attributes:
        phase: As above.
        duration_s: How long the person took, s: of reading, watching, or training.
        bins: Of a simulated participant's fly-through: receptacle -> time at which it came into view, s.
        reason: Why the training ended, as in `end`; the run directory `training` holds its record.
    """

    phase: Literal["story", "flythrough", "training"]
    duration_s: Seconds
    bins: dict[str, Seconds] | None = None
    reason: str | None = None


class End(Logged, frozen=True):
    """Last line.

    Attributes:
        reason: Why the trial ended.
        error: What went wrong, where something did.
        signal: Name of the signal that interrupted it, where one did.
    """

    reason: str
    signal: str | None = None
    error: str | None = None


class Scroll(Logged, frozen=True):
    """The person scrolled the task list.

    Attributes:
        rows: By how many rows, positive towards the list's end.
    """

    rows: int


class Overrun(Logged, frozen=True):
    """A control step came late, because the machine was busy.

    Attributes:
        seconds: How late, s of wall time.
        skipped: Whether the clock went on from there, because the process had been stopped.
    """

    seconds: float
    skipped: bool


class Pause(Logged, frozen=True):
    """The clock was stopped.

    Attributes:
        reason: `hidden` (the tab), `disconnected`, `asked` or `taken over`.
        wall: When, s since 1970.
    """

    reason: str
    wall: float


class Resume(Logged, frozen=True):
    """The clock went on.

    Attributes:
        wall: When, s since 1970.
    """

    wall: float


class Blur(Logged, frozen=True):
    """The page lost the keyboard to another window, or got it back.

    Attributes:
        away: Whether it lost it.
        wall: When, s since 1970.
    """

    away: bool
    wall: float


class Outcome(Logged, frozen=True):
    """Something happened in the world.

    Attributes:
        object: The object.
        receptacle: The receptacle concerned, or null.
    """

    object: str
    receptacle: str | None


OUTCOMES = {
    EventKind.PICKED: "an object was gripped and lifted",
    EventKind.PICK_FAILED: "a pick was begun but did not succeed",
    EventKind.PLACED: "an object came to rest in its receptacle",
    EventKind.PLACE_FAILED: "a place was begun, but the object did not end up in the receptacle",
    EventKind.GRIP_LOST: "a carried object slipped out of a hand",
    EventKind.DISLODGED: "a delivered object left its receptacle again",
    EventKind.EJECTED: "an object was faster than anything could throw it (docs/health.md)",
    EventKind.TUNNELLED: "an object went through something solid (docs/health.md)",
}
TYPES: tuple[type[Logged], ...] = (
    Start,
    Participant,
    PhaseBegun,
    PhaseEnded,
    Plan,
    Attempt,
    Visit,
    Regret,
    Scroll,
    Overrun,
    Pause,
    Resume,
    Blur,
    End,
)
