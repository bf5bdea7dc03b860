"""Event types for the session as a whole: its start, its phases, its display and so on."""

from typing import Annotated, Literal

import msgspec

Seconds = Annotated[float, msgspec.Meta(ge=0.0)]
Count = Annotated[int, msgspec.Meta(ge=0)]


class LoggedEvent(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    tag_field="event",
    tag=lambda name: name.removesuffix("Event").lower(),
    kw_only=True,
):
    """A line of the event log.

    Attributes:
        t: Simulated time in seconds.
    """

    t: Seconds


class StartEvent(LoggedEvent, frozen=True, forbid_unknown_fields=False):
    """The first line of the log. It also contains all settings of the trial, as in `metrics.json`.

    Attributes:
        format: Version of the log format.
        versions: Versions of mjsim, its physics code, MuJoCo and NumPy, and the machine's architecture.
        model: Fingerprint of the compiled model of the house and its objects, without purely visual parts.
        world: Options of the simulated world: timestep, capacity, grip and fidelity.
        fingerprint: Hash of the settings and of `inputs`.
        inputs: Hashes or versions of the trial's other dependencies: the house, the code and libraries.
        episode_sha256: SHA-256 of `episode.json`.
        order: Names of the objects in the participant's random order.
        objects: Number of misplaced objects.
        assistance: Assistance condition.
        house: House name, or path of its catalogue.
        time_limit: Simulated time in seconds after which the trial ends.
        rooms: Number of rooms, or None in older records.
        area_m2: Floor area of the rooms in square metres, or None in older records.
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
    """The second line of the log, which describes the participant.

    Attributes:
        user: Name of the participant model.
        person: Parameters of the person by name, including randomly drawn values. The parameters of the hands
            are grouped under `motion` (docs/participants.md).
        behaviour: Parameters drawn for the participant model, by name. Absent if the model has none.
    """

    user: str
    person: dict[str, float | dict[str, float]]
    behaviour: dict[str, float] | None = None


class PhaseBegunEvent(LoggedEvent, frozen=True, tag="phase_begun"):
    """The beginning of a phase that precedes the task. The task clock stays at 0.

    Attributes:
        phase: `story`, `flythrough` or `training`.
    """

    phase: Literal["story", "flythrough", "training"]


class PhaseEndedEvent(LoggedEvent, frozen=True, tag="phase_ended"):
    """The end of a phase that precedes the task.

    Attributes:
        phase: As in `phase_begun`.
        duration_s: Time in seconds that the participant spent reading, watching or training.
        bins: Time in seconds at which each receptacle came into view. Only in simulated fly-throughs.
        reason: Reason why the training ended, as in `end`. Its record is in the run directory `training`.
        attempts: Number of attempts at the questions about the story. Only in logs from before version 0.3.
    """

    phase: Literal["story", "flythrough", "training"]
    duration_s: Seconds
    bins: dict[str, Seconds] | None = None
    reason: str | None = None
    attempts: int | None = None


class StartedEvent(LoggedEvent, frozen=True):
    """The participant started the clock. The task is hidden until then.

    Attributes:
        waited_s: Wall time in seconds that the session spent waiting for the start.
        wall: Unix time in seconds.
    """

    waited_s: float
    wall: float


class PauseEvent(LoggedEvent, frozen=True):
    """The clock was paused.

    Attributes:
        reason: `hidden` (the tab), `disconnected`, `silent` (no heartbeat from the page for 1 s), `restarted` (the
            worker process died), `asked`, `taken over` or `picture lost` (the browser cannot draw).
        wall: Unix time in seconds.
    """

    reason: Literal["asked", "hidden", "disconnected", "silent", "restarted", "taken over", "picture lost"]
    wall: float


class ResumeEvent(LoggedEvent, frozen=True):
    """The clock was resumed.

    Attributes:
        wall: Unix time in seconds.
    """

    wall: float


class BlurEvent(LoggedEvent, frozen=True):
    """The page lost or regained the keyboard focus.

    Attributes:
        away: True if the page lost the focus.
        wall: Unix time in seconds.
    """

    away: bool
    wall: float


class OverrunEvent(LoggedEvent, frozen=True):
    """A control step was late because the machine was busy or inputs did not arrive.

    Attributes:
        seconds: Delay in seconds of wall time.
        skipped: True if the clock was set to the present because the process had been suspended.
        missing: True if the step ran without inputs that the page had announced. Logged only for the first such step in
            a row.
    """

    seconds: float
    skipped: bool
    missing: bool = False


class DisplayEvent(LoggedEvent, frozen=True):
    """The page measured the quality of the display over the last 5 s.

    Attributes:
        draw: `browser` if the browser drew the view, or `server` if it showed frames from the server.
        renderer: Name of the renderer.
        width: Width of the view in CSS pixels.
        height: Height of the view in CSS pixels.
        pixel_ratio: Screen pixels per CSS pixel.
        frames_per_s: Frames shown per second.
        frame_ms: Median time between two frames in milliseconds.
        frame_ms_95: 95th percentile of the time between two frames in milliseconds.
        latency_ms: Median time in milliseconds from an input to the frame that shows it. If the browser
            draws, the time to the server's state that includes the input. It is null if nothing was pressed.
        dropped: Number of received frames that were not shown.
        wall: Unix time in seconds.
        field_of_view: Horizontal field of view in radians; null if the person cannot choose it.
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
    """The view is now drawn by the server instead of the browser or vice versa, or at another resolution.

    Attributes:
        draw: `browser` or `server`, depending on which of them draws from now on.
        reason: Reason for the change: `slow` (below 20 frames per second), `slow: 70 % of the resolution` (the
            browser draws fewer pixels), `context lost`, or the missing feature.
        wall: Unix time in seconds.
    """

    draw: Literal["browser", "server"]
    reason: str
    wall: float


class EndEvent(LoggedEvent, frozen=True):
    """The last line of the log.

    Attributes:
        reason: Reason why the trial ended.
        error: Description of the error, if there was one.
        signal: Name of the signal that interrupted the trial, if any.
    """

    reason: str
    signal: str | None = None
    error: str | None = None
