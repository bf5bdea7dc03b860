"""Replaying a run: simulate it again, compare every control step with the record, and film it in any view."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from experiments import records
from experiments.errors import ConfigError, RecordError
from experiments.files import read_json
from experiments.first_person import FilmConfig, Filming, FirstPersonRenderer
from experiments.house import House
from experiments.replaying.check import first_fault
from experiments.replaying.overview import CAMERAS, FIRST_PERSON, Overview, camera_path
from experiments.replaying.replayer import Replayer, fault_error
from experiments.replaying.run_record import RunRecord, load_run
from experiments.session import Viewer
from experiments.video import VideoWriter
from mjsim.files import replacing

Point = tuple[float, float, float]


@dataclass(frozen=True)
class ReplayFilm:
    """How to film a replay.

    Attributes:
        path: Video file to write.
        config: Frame size and render profile.
        camera: `first-person` (the view through the glasses), `top-down`, or `free`.
        eye: Where a free camera stands, m; None for one that circles the house.
        target: What a free camera looks at, m; None for the middle of the floor.
    """

    path: Path
    config: FilmConfig
    camera: str = FIRST_PERSON
    eye: Point | None = None
    target: Point | None = None

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise ConfigError(f"no camera {self.camera!r}; there are {', '.join(CAMERAS)}")
        if self.camera != "free" and (self.eye is not None or self.target is not None):
            raise ConfigError(f"only a free camera is put somewhere; the {self.camera} one has its own place")


@dataclass(frozen=True)
class ReplayReport:
    """A replay that went as recorded.

    Attributes:
        first: Control step at which it started.
        steps: Control steps verified.
        ended: Why the run ended.
        failure: How the physics failed, in the run and again in the replay, or None.
        differences: What differs from when the run was recorded, without consequence.
        frames_sha256: Hash of the frames filmed, or None.
        as_filmed: Whether these are the frames of the run's own video, bit for bit; None without one of the two.
    """

    first: int
    steps: int
    ended: str
    failure: str | None
    differences: tuple[str, ...]
    frames_sha256: str | None
    as_filmed: bool | None


def replay(
    directory: Path,
    *,
    start: float = 0.0,
    film: ReplayFilm | None = None,
    assistance: str | None = None,
    house: House | None = None,
    on_progress: Callable[[int, int], None] = lambda *_: None,
) -> ReplayReport:
    """Simulate a run again and compare every control step with the record.

    Args:
        directory: Run directory, or what a failed run left.
        start: Simulated time, s; the replay starts at the last checkpoint at or before it.
        film: How to film it, or None.
        assistance: Assistance condition whose glasses are shown, or None for the recorded one. What the person
            did and what was planned stay as they were.
        house: A loaded house to use again; it must be the one of the run.
        on_progress: Called with the control steps passed and those recorded.

    Raises:
        RecordError: `directory` holds no run.
        ReplayError: It cannot be replayed, or something is not as recorded; `step` and the message name the first
            bad control step.
        ConfigError, MjsimError, HudError: The house, the condition or the film is unusable.
    """
    record = load_run(directory)
    if record.fault is not None and record.fault.step == 0:
        raise fault_error(directory, record.start, record.fault)
    house = house or House.load(str(record.start["house"]))
    shown = assistance or str(record.start["assistance"])
    replayer = Replayer(record, house, start=start, assistance=shown)
    with ExitStack() as stack:
        viewer, video = _open_film(replayer, film, stack) if film else (None, None)
        replayer.run(viewer, on_progress)
        fault = first_fault(replayer)
        if fault is not None:
            raise replayer.error(fault)
    frames = video.frames_sha256 if video else None
    return ReplayReport(
        first=replayer.first,
        steps=record.steps - replayer.first,
        ended=record.reason or "",
        failure=replayer.failure,
        differences=replayer.differences,
        frames_sha256=frames,
        as_filmed=_as_filmed(record, frames),
    )


def _open_film(replayer: Replayer, film: ReplayFilm, stack: ExitStack) -> tuple[Viewer, VideoWriter]:
    """A viewer that films to a file, which appears if the replay goes well."""
    path = stack.enter_context(replacing(film.path))
    config, scene, house = film.config, replayer.scene, replayer.house
    if film.camera == FIRST_PERSON:
        glasses = stack.enter_context(FirstPersonRenderer(scene, house, config))
        video = stack.enter_context(VideoWriter(path, width=config.width, height=config.height))
        return Filming(glasses, video), video
    camera = camera_path(film.camera, house.bounds, config.width / config.height, film.eye, film.target)
    video = stack.enter_context(VideoWriter(path, width=config.width, height=config.height))
    return stack.enter_context(Overview(scene, config, camera, video)), video


def _as_filmed(record: RunRecord, frames: str | None) -> bool | None:
    try:
        then = read_json(record.directory / records.METRICS).get("frames_sha256")
    except RecordError:  # a run that failed has no metrics
        return None
    return None if frames is None or then is None else bool(frames == then)
