"""The events of a log, one type for each kind of line of `events.jsonl`; docs/data.md is made from them."""

from typing import Annotated, Literal

import msgspec

from mjsim.values.actions import Refusal
from planner.plan import Status, VisitKind

Seconds = Annotated[float, msgspec.Meta(ge=0.0)]
Metres = Annotated[float, msgspec.Meta(ge=0.0)]
Count = Annotated[int, msgspec.Meta(ge=0)]
VisitPair = tuple[VisitKind, str]


def _tag(class_name: str) -> str:
    return class_name.removesuffix("Event").lower()


class LoggedEvent(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="event", tag=_tag, kw_only=True
):
    """A line of the log.

    Attributes:
        t: Simulated time, s.
    """

    t: Seconds


class StartEvent(LoggedEvent, frozen=True, forbid_unknown_fields=False):
    """First line: what was run, and on what. It also holds the settings of the trial, as in `metrics.json`.

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
        rooms: How many rooms the house has; None in older records.
        area_m2: Area of their floor, m2; None in older records.
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
    rooms: Count | None = None
    area_m2: float | None = None


class ParticipantEvent(LoggedEvent, frozen=True):
    """Second line: who took part.

    Attributes:
        user: The simulated participant.
        person: Every value of the person that was drawn, by name (docs/participants.md); hands under `motion`.
        behaviour: Every value of the participant model that was drawn, by name; absent for models without any.
    """

    user: str
    person: dict[str, float | dict[str, float]]
    behaviour: dict[str, float] | None = None


class PhaseBegunEvent(LoggedEvent, frozen=True, tag="phase_begun"):
    """A phase before the task started; the clock of the task stays at 0. Logs without phases before the task have none.

    Attributes:
        phase: `story`, `flythrough` or `training`.
    """

    phase: Literal["story", "flythrough", "training"]


class PhaseEndedEvent(LoggedEvent, frozen=True, tag="phase_ended"):
    """A phase before the task ended.

    Attributes:
        phase: As above.
        duration_s: Time spent reading, watching, or training, s.
        bins: Of a simulated participant's fly-through: receptacle -> time at which it came into view, s.
        reason: Why the training ended, as in `end`; the run directory `training` holds its record.
        attempts: How often the questions about the story were answered. Only in logs from before version 0.3.
    """

    phase: Literal["story", "flythrough", "training"]
    duration_s: Seconds
    bins: dict[str, Seconds] | None = None
    reason: str | None = None
    attempts: int | None = None


class PlanEvent(LoggedEvent, frozen=True):
    """The assistant made a plan: the first one, one after a deviation, or a better one.

    Attributes:
        cost_m: Length of the planned tour from where the person was, from place to place, m.
        lower_bound_m: No tour between these places is shorter, m.
        status: `optimal` if the planner proved it, else `feasible`.
        visits: The tour: what is done, with which object.
        improved: Whether it is a better plan for the same state of the task.
        reach_bound_m: Of the first plan: lower bound on walking at maximum reach, m (docs/metrics.md).
    """

    cost_m: Metres
    lower_bound_m: Metres
    status: Status
    visits: list[VisitPair]
    improved: bool = False
    reach_bound_m: Metres | None = None


class AttemptEvent(LoggedEvent, frozen=True):
    """The person tried to pick or place something.

    Attributes:
        action: `pick` or `place`.
        object: The object; null if none was named and none was in reach.
        applied: Whether the motion started.
        refusal: Why not, or null.
    """

    action: VisitKind
    object: str | None
    applied: bool
    refusal: Refusal | None


class VisitEvent(LoggedEvent, frozen=True):
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


class RegretEvent(LoggedEvent, frozen=True):
    """Regrets of a visit that were found after the task.

    Attributes:
        visit: Number of the visit, from 0.
        regret_m: As in `visit`.
        suggested_regret_m: As in `visit`.
    """

    visit: Count
    regret_m: Metres | None = None
    suggested_regret_m: Metres | None = None


class ScrollEvent(LoggedEvent, frozen=True):
    """The person scrolled the task list.

    Attributes:
        rows: By how many rows, positive towards the list's end.
    """

    rows: int


class OverrunEvent(LoggedEvent, frozen=True):
    """A control step was late: the machine was busy, or inputs of the page did not come.

    Attributes:
        seconds: How late, s of wall time.
        skipped: Whether the clock was set to the present, because the process had been suspended.
        missing: Whether it had waited for inputs that the page had promised, and was taken without them; logged for the
            first such step in a row.
    """

    seconds: float
    skipped: bool
    missing: bool = False


class StartedEvent(LoggedEvent, frozen=True):
    """The person started the clock; nothing of the task was shown before.

    Attributes:
        waited_s: How long the session had waited for it, s of wall time.
        wall: When, s since 1970.
    """

    waited_s: float
    wall: float


class PauseEvent(LoggedEvent, frozen=True):
    """The clock was stopped.

    Attributes:
        reason: `hidden` (the tab), `disconnected`, `silent` (no sign of life of the page for 1 s), `restarted` (the
            process that simulates the session died), `asked` or `taken over`.
        wall: When, s since 1970.
    """

    reason: Literal["asked", "hidden", "disconnected", "silent", "restarted", "taken over"]
    wall: float


class ResumeEvent(LoggedEvent, frozen=True):
    """The clock continued.

    Attributes:
        wall: When, s since 1970.
    """

    wall: float


class BlurEvent(LoggedEvent, frozen=True):
    """The page lost the keyboard focus to another window, or regained it.

    Attributes:
        away: Whether it lost the focus.
        wall: When, s since 1970.
    """

    away: bool
    wall: float


class DisplayEvent(LoggedEvent, frozen=True):
    """How well the person saw the session in the last 5 s, as the page measured it.

    Attributes:
        draw: Who drew the picture: the browser, or the server, whose frames it showed.
        renderer: What drew it.
        width: Width of the view, px of the page.
        height: Its height, px of the page.
        pixel_ratio: How many px of the screen one px of the page has.
        frames_per_s: Pictures shown a second.
        frame_ms: Median of the times between two pictures.
        frame_ms_95: 95 % of these times are shorter.
        latency_ms: Median from an input to the picture that shows it, or, where the browser draws, to the state of the
            server that counts it; null where nothing was pressed.
        dropped: Pictures that came and were not shown.
        wall: When, s since 1970.
        field_of_view: Horizontal field of view of the picture, rad; null where the person cannot choose it.
    """

    draw: Literal["browser", "server"]
    renderer: str
    width: Count
    height: Count
    pixel_ratio: float
    frames_per_s: float
    frame_ms: float
    frame_ms_95: float
    latency_ms: float | None
    dropped: Count
    wall: float
    field_of_view: float | None = None


class DrawEvent(LoggedEvent, frozen=True):
    """The server draws from now on, because the browser cannot.

    Attributes:
        draw: Who draws now.
        reason: Why the other one does not: `slow` (below 20 pictures a second), `context lost`, or what was lacking.
        wall: When, s since 1970.
    """

    draw: Literal["browser", "server"]
    reason: str
    wall: float


class EndEvent(LoggedEvent, frozen=True):
    """Last line.

    Attributes:
        reason: Why the trial ended.
        error: What went wrong, where something did.
        signal: Name of the signal that interrupted it, where one did.
    """

    reason: str
    signal: str | None = None
    error: str | None = None


TYPES = tuple(LoggedEvent.__subclasses__())  # so far
