"""Take the pictures of the documentation: a person's view under each assistance condition in real trials."""

import contextlib
import math
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.house import House
from experiments.record import records
from experiments.record.phases import LeaveSession
from experiments.record.records import EventLog
from experiments.record.run_directory import check_file
from experiments.session.film_config import FRAME_SIZE, FilmConfig
from experiments.session.first_person import FirstPersonRenderer
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from hud.projection import CameraView
from hud.state import HudState
from mjsim.house.scene.scene import compose
from mjsim.house.sight.sight import visible_objects
from mjsim.support.files import replacing
from mjsim.values.errors import RenderError
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.world.world import World

Image = NDArray[np.uint8]

# Range of distances to an object in metres. Nearer objects are not visible when looking straight ahead.
APPROACHING = (2.3, 3.3)
AT_A_BIN = (0.0, 2.2)  # range of distances to the middle of a bin, in metres
MIN_WALK = 1.0  # time in seconds after which the person must have walked to reach an object
FACING = math.radians(20.0)
MAX_TIME = 240.0  # simulated time in seconds within which all pictures must be taken


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The world at one moment of a trial, with the person's observation."""

    world: World
    observation: Observation
    targets: Mapping[str, NDArray[np.float64]]  # centre (3,) in metres of each object's bin, by object name

    def ahead(self, place: NDArray[np.float64], distance: tuple[float, float]) -> bool:
        """Return True if the person faces a place within a range of distances, in metres."""
        offset = place[:2] - self.observation.position
        turn = math.remainder(math.atan2(offset[1], offset[0]) - self.observation.heading, math.tau)
        return distance[0] < float(np.hypot(*offset)) < distance[1] and abs(turn) < FACING

    def walking(self) -> bool:
        return float(np.linalg.norm(self.observation.velocity)) > 0.5

    def visible(self) -> tuple[str, ...]:
        seen = self.observation
        return visible_objects(self.world.scene, self.world.data, seen.eye, seen.heading, seen.pitch)


Trigger = Callable[[Snapshot], bool]


@dataclass(frozen=True)
class Shot:
    """A picture of a trial, which is taken at the first snapshot for which `trigger` returns True."""

    name: str
    trial: TrialConfig
    trigger: Trigger


class _Done(LeaveSession):
    """Raised when all pictures have been taken."""


class _ShotTaker:
    """A viewer that takes each picture when its trigger returns True."""

    def __init__(
        self, renderer: FirstPersonRenderer, shots: Sequence[Shot], targets: Mapping[str, NDArray[np.float64]]
    ) -> None:
        self._renderer = renderer
        self._open = list(shots)
        self._targets = targets
        self.taken: dict[str, Image] = {}

    def camera(self, world: World) -> CameraView:
        return self._renderer.camera_view(world.data)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        snapshot = Snapshot(world, observation, self._targets)
        due = [shot for shot in self._open if shot.trigger(snapshot)]
        if due:
            frame = self._renderer.frame(world.data, hud_state)
            self.taken |= {shot.name: frame for shot in due}
            self._open = [shot for shot in self._open if shot not in due]
        if not self._open:
            raise _Done


def after(seconds: float) -> Trigger:
    """Return a trigger that is true from a simulated time in seconds onwards."""
    return lambda snapshot: snapshot.observation.time >= seconds


def approaching(snapshot: Snapshot) -> bool:
    """Return True if a hand is free and a visible object is straight ahead."""
    seen = snapshot.observation
    if len(seen.carried) > 1 or seen.busy or seen.time < MIN_WALK:
        return False
    places = dict(zip(seen.object_names, seen.object_positions, strict=True))
    near = [n for n in seen.names_with(ObjectStatus.LOOSE) if snapshot.ahead(places[n], APPROACHING)]
    return bool(near) and not set(near).isdisjoint(snapshot.visible())


def carrying_two(snapshot: Snapshot) -> bool:
    """Return True if the person walks with an object in each hand."""
    return len(snapshot.observation.carried) == 2 and not snapshot.observation.busy and snapshot.walking()


def at_a_bin(snapshot: Snapshot) -> bool:
    """Return True if the bin of a carried object is straight ahead and nearby."""
    return any(snapshot.ahead(snapshot.targets[name], AT_A_BIN) for name in snapshot.observation.carried)


SITUATIONS: Mapping[str, tuple[str, Trigger]] = {
    "start": ("At the start", after(0.4)),
    "object": ("Approaching an object", approaching),
    "carrying": ("Carrying two", carrying_two),
    "bin": ("At a bin", at_a_bin),
}


def take_pictures(shots: Sequence[Shot], film: FilmConfig) -> dict[str, Image]:
    """Run trials until all pictures have been taken.

    Returns:
        RGB frames (height, width, 3) as uint8, by the name of the shot.

    Raises:
        RecordError: A trigger was not true within four simulated minutes.
        ExperimentError, MjsimError: A trial or the rendering has failed.
    """
    taken: dict[str, Image] = {}
    for trial in dict.fromkeys(shot.trial for shot in shots):
        house = House.load(trial.house)
        scene = compose(trial_episode(trial, house), house.catalogue)
        mine = [shot for shot in shots if shot.trial == trial]
        targets = {name: house.receptacles[key].center for name, key in scene.episode.targets.items()}
        with FirstPersonRenderer(scene, house, film) as renderer:
            taker = _ShotTaker(renderer, mine, targets)
            timed = msgspec.structs.replace(trial, time_limit=MAX_TIME)
            session, _ = prepare_session(timed, house, scene, EventLog(), taker)
            with contextlib.suppress(_Done):
                session.run()
        missing = [shot.name for shot in mine if shot.name not in taker.taken]
        if missing:
            raise RecordError(f"no moment for the pictures {missing} within {MAX_TIME:g} s; use another seed")
        taken |= taker.taken
    return taken


def contact_sheet(
    conditions: Sequence[str], frames: Mapping[tuple[str, str], Image], width: int = 480
) -> Image:
    """Arrange frames by condition (rows) and situation (columns), with captions. Return an RGB image.

    Args:
        conditions: Names of the conditions, from top to bottom.
        frames: Frames by condition and situation.
        width: Width of a picture on the sheet in pixels.
    """
    margin, caption = width // 40, width // 12
    height = round(width * FRAME_SIZE[1] / FRAME_SIZE[0])
    columns, rows = len(SITUATIONS), len(conditions)
    across = caption + columns * (width + margin) + margin
    sheet = np.full((caption + rows * (height + margin) + margin, across, 3), 250, dtype=np.uint8)
    for column, (label, _) in enumerate(SITUATIONS.values()):
        left = caption + margin + column * (width + margin)
        _write(sheet, label, left + width // 2, caption // 2 + margin // 2, caption // 2)
    for row, name in enumerate(conditions):
        top = caption + margin + row * (height + margin)
        strip = np.full((caption, height, 3), 250, dtype=np.uint8)
        _write(strip, name.capitalize(), height // 2, caption // 2, caption // 2)
        sheet[top : top + height, :caption] = cv2.rotate(strip, cv2.ROTATE_90_COUNTERCLOCKWISE)
        for column, key in enumerate(SITUATIONS):
            left = caption + margin + column * (width + margin)
            small = cv2.resize(frames[name, key], (width, height), interpolation=cv2.INTER_AREA)
            sheet[top : top + height, left : left + width] = small
    return sheet


def save_png(path: Path, rgb: Image) -> None:
    with replacing(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def _write(image: Image, text: str, x: int, y: int, size: int) -> None:
    """Draw dark text with its centre at column `x` and row `y`."""
    face = cv2.FontFace("sans")
    left, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), face, size, 600)
    cv2.putText(image, text, (x - (left + width) // 2, y + size // 3), (30, 34, 40), face, size, 600)


SEED = 7
CONDITIONS = ("none", "highlight", "optimal")
SHOTS = (
    Shot("guided", TrialConfig(objects=12, assistance="guided", seed=SEED), after(0.4)),
    Shot("optimal_carrying", TrialConfig(objects=12, assistance="optimal", seed=SEED), carrying_two),
    Shot("highlight", TrialConfig(objects=12, assistance="highlight", seed=SEED), after(1.3)),
    Shot("none", TrialConfig(objects=12, assistance="none", seed=0), after(6.0)),
)
SHEET = "contact_sheet.png"
WALK = TrialConfig(objects=6, assistance="optimal", seed=0, fidelity="event")  # trial of the floor plan


def make_gallery(
    out: Path, film: FilmConfig, *, replace: bool, sheet_only: bool, frames: bool
) -> Iterator[Path]:
    """Write the pictures of the documentation and yield their paths.

    Args:
        out: Output folder.
        film: Size and render profile of the pictures.
        replace: True to overwrite existing pictures.
        sheet_only: True to make only the contact sheet.
        frames: True to also write each frame of the contact sheet in full size.

    Raises:
        RecordError: A picture already exists, or its trigger was not true within four simulated minutes.
        RenderError: Rendering is not possible.
    """
    shots = () if sheet_only else SHOTS
    names = [*(f"{shot.name}.png" for shot in shots), SHEET, *(() if sheet_only else (records.TOPDOWN,))]
    sheet_frames = [f"{condition}_{key}.png" for condition in CONDITIONS for key in SITUATIONS]
    for name in [*names, *(sheet_frames if frames else ())]:
        check_file(out / name, replace=replace)
    out.mkdir(parents=True, exist_ok=True)
    if not sheet_only:
        with tempfile.TemporaryDirectory() as folder, replacing(out / records.TOPDOWN) as drawn:
            run_trial(WALK, Path(folder) / "run", on_warning=_fail)
            shutil.copyfile(Path(folder) / "run" / records.TOPDOWN, drawn)
        yield out / records.TOPDOWN
    for name, frame in take_pictures(shots, film).items():
        save_png(out / f"{name}.png", frame)
        yield out / f"{name}.png"
    taken = {}
    for condition in CONDITIONS:
        trial = TrialConfig(objects=12, assistance=condition, seed=SEED)
        moments = [Shot(key, trial, moment) for key, (_, moment) in SITUATIONS.items()]
        for key, frame in take_pictures(moments, FilmConfig.with_panels()).items():
            taken[condition, key] = frame
            if frames:
                save_png(out / f"{condition}_{key}.png", frame)
                yield out / f"{condition}_{key}.png"
    save_png(out / SHEET, contact_sheet(CONDITIONS, taken))
    yield out / SHEET


def _fail(warning: str) -> None:
    # Warnings are treated as errors, because the gallery needs the floor plan of the trial.
    raise RenderError(warning)
