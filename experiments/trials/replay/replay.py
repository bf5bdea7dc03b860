"""Replay a recorded run, compare every control step with the record, and film the run in any view."""

from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from experiments.errors import ConfigError, RecordError, ReplayError
from experiments.house import House
from experiments.record import records
from experiments.record.files import read_json
from experiments.record.reader import Record, read_run
from experiments.record.verify import Mismatch, checksum_mismatches, damage, derived_mismatches
from experiments.session.film_config import CAMERAS, FIRST_PERSON, FREE, FilmConfig
from experiments.session.first_person import Filming, FirstPersonRenderer
from experiments.session.session import Viewer
from experiments.session.video import VideoWriter
from experiments.trials.replay.comparison import Verdict, phase_mismatches, simulated_mismatches, verdicts
from experiments.trials.replay.external_view import ExternalViewer, camera_path
from experiments.trials.replay.replayer import Replayer, mismatch_error
from mjsim.support.files import replacing
from mjsim.values.errors import AssetError
from mjsim.values.person_parameters import PersonParameters

MAX_WIDTH = 1280  # maximum width of a film that shows the participant's view, in pixels
MIN_PICTURE = (416, 312)  # minimum width and height of such a film's picture, with which its text is legible

Point = tuple[float, float, float]


@dataclass(frozen=True)
class ReplayFilm:
    """Settings of a film that is made from a replay.

    Attributes:
        path: Video file to write.
        config: Frame size and render profile. If it is None, frames have the shape of the participant's page,
            or the default size if there was no page.
        camera: `first-person` (with the HUD), `top-down`, or `free`.
        eye: Position of a free camera in metres, or None to circle the house.
        target: Point at which a free camera looks, in metres, or None for the middle of the floor.

    Raises:
        ConfigError: The camera is unknown, or its position cannot be set.
    """

    path: Path
    config: FilmConfig | None
    camera: str = FIRST_PERSON
    eye: Point | None = None
    target: Point | None = None
    profile: str = "fast"

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise ConfigError(f"no camera {self.camera!r}; there are {', '.join(CAMERAS)}")
        if self.camera != FREE and (self.eye is not None or self.target is not None):
            raise ConfigError(f"only --camera {FREE} takes --eye and --target; this is {self.camera}")


@dataclass(frozen=True)
class ReplayReport:
    """The result of a replay that agrees with the record.

    Attributes:
        first: Control step at which the replay started.
        steps: Number of verified control steps.
        ended: Reason why the run ended.
        failure: Physics error that ended both the run and the replay, or None.
        differences: Versions and models that differ from those of the recording without changing the result.
        frames_sha256: Hash of the filmed frames, or None.
        as_filmed: True if the frames are identical to those of the run's video. None unless both were filmed.
    """

    first: int
    steps: int
    ended: str
    failure: str | None
    person: PersonParameters
    differences: tuple[str, ...]
    verdicts: tuple[Verdict, ...]
    frames_sha256: str | None
    as_filmed: bool | None


def replay(
    directory: Path,
    *,
    start: float = 0.0,
    film: ReplayFilm | None = None,
    watch: Callable[[Replayer], Viewer] | None = None,
    assistance: str | None = None,
    house: House | None = None,
    catalogue: str | None = None,
    language: str = "en",
    on_progress: Callable[[int, int], None] = lambda *_: None,
) -> ReplayReport:
    """Simulate a recorded run again, and compare every control step with the record.

    Args:
        directory: Run directory.
        start: Simulated time in seconds. The replay starts at the last checkpoint at or before it.
        film: Settings of the film, or None.
        watch: Function that creates a viewer to use instead of the film, or None.
        assistance: Assistance condition whose HUD is shown, or None for the recorded condition. The actions
            and plans are always those of the record.
        house: The house of the run, if it is already loaded.
        catalogue: Path of the house's catalogue, if it was moved. Its content must not have changed.
        language: Language of the texts in the film.
        on_progress: Called with the number of control steps replayed so far and the total number.

    Raises:
        RecordError: `directory` is not a run directory.
        ReplayError: The run cannot be replayed, or it differs from the record.
        ConfigError, MjsimError, HudError: The house, the condition or the film cannot be used.
    """
    record = read_run(directory)
    if faults := damage(record):
        faults += checksum_mismatches(directory)
        raise mismatch_error(directory, record, faults[0], (), verdicts(directory, record, faults, 0, 0))
    duration = float(record.trajectory["time"][-1])
    if start > round(duration, 6):  # times in the log have 6 decimals
        raise ConfigError(f"the run lasts {duration:.2f} s; start earlier than {start:g} s")
    house = (house or _house_of(directory, record, catalogue)).in_language(language)
    shown = assistance or str(record.start["assistance"])
    replayer = Replayer(directory, record, house, start=start, assistance=shown)
    with ExitStack() as stack:
        viewer, video = _open_film(replayer, film, stack) if film else (watch and watch(replayer), None)
        replayer.run(viewer, on_progress)
        mismatches = _mismatches(replayer)
        end = replayer.first + replayer.replayed().steps
        found = verdicts(directory, record, mismatches, replayer.first, end)
        if mismatches:
            raise mismatch_error(directory, record, mismatches[0], replayer.differences, found)
    if (directory / records.TRAINING).is_dir():
        training = replay(directory / records.TRAINING, house=house)
        found = (*found, Verdict(records.TRAINING, True, f"{training.steps} steps of a run of its own"))
    frames = video.frames_sha256 if video else None
    return ReplayReport(
        first=replayer.first,
        steps=record.steps - replayer.first,
        ended=record.reason or "",
        failure=replayer.failure,
        person=record.person,
        differences=replayer.differences,
        verdicts=found,
        frames_sha256=frames,
        as_filmed=_as_filmed(directory, frames),
    )


def _mismatches(replayer: Replayer) -> list[Mismatch]:
    """Return all mismatches of a replay, sorted by control step. Checksum mismatches come last."""
    directory, record = replayer.directory, replayer.record
    simulated = (*phase_mismatches(replayer), *simulated_mismatches(replayer))
    found = sorted(simulated, key=lambda mismatch: mismatch.step or 0)
    if not found:
        found += derived_mismatches(directory, record)
    return [*found, *checksum_mismatches(directory)]


def _house_of(directory: Path, record: Record, catalogue: str | None) -> House:
    name = catalogue or str(record.start["house"])
    try:
        house = House.load(name)
    except AssetError as error:
        raise ConfigError(
            f"cannot load the house of {directory}: {error}; if it was moved, name its catalogue with --house"
        ) from error
    recorded = record.start["inputs"].get("house")
    if catalogue is not None and house.catalogue.content != recorded:
        raise ReplayError(
            f"{catalogue} is not the house of {directory}: its content has the hash {house.catalogue.content}, "
            f"not {recorded} as recorded; name the unchanged catalogue",
            0,
        )
    return house


def as_seen(record: Record, profile: str) -> FilmConfig:
    """Return film settings that match the participant's browser, or the defaults if no size was logged."""
    views = [
        event for event in record.events if event["event"] == "display" and event.get("draw") == "browser"
    ]
    if not views:
        return FilmConfig.with_panels(profile=profile)
    width, height = views[-1]["width"], views[-1]["height"]
    scale = min(1.0, MAX_WIDTH / width)
    return FilmConfig.around(
        max(MIN_PICTURE[0], round(scale * width)),
        max(MIN_PICTURE[1], round(scale * height)),
        profile,
        views[-1].get("field_of_view"),
    )


def _open_film(replayer: Replayer, film: ReplayFilm, stack: ExitStack) -> tuple[Viewer, VideoWriter]:
    path = stack.enter_context(replacing(film.path))
    config = film.config or as_seen(replayer.record, film.profile)
    scene, house = replayer.scene, replayer.house
    if film.camera == FIRST_PERSON:
        renderer = stack.enter_context(FirstPersonRenderer(scene, house, config))
        video = stack.enter_context(VideoWriter(path, width=config.width, height=config.height))
        return Filming(renderer, video), video
    camera = camera_path(film.camera, house.bounds, config.width / config.height, film.eye, film.target)
    video = stack.enter_context(VideoWriter(path, width=config.width, height=config.height))
    return stack.enter_context(closing(ExternalViewer(scene, config, camera, video))), video


def _as_filmed(directory: Path, frames: str | None) -> bool | None:
    try:
        then = read_json(directory / records.METRICS).get("frames_sha256")
    except RecordError:  # a failed run has no metrics
        return None
    return None if frames is None or then is None else bool(frames == then)
