"""The pictures of the documentation: what a person sees under each condition, taken from real trials."""

import contextlib
import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.first_person import FilmConfig, FirstPersonRenderer
from experiments.house import House
from experiments.records import EventLog
from experiments.trial import TrialConfig, prepare_session
from hud.projection import CameraView
from hud.state import HudState
from mjsim.files import replacing
from mjsim.model.scene import compose
from mjsim.observation import ObjectStatus, Observation
from mjsim.visibility import visible_objects
from mjsim.world import World

Image = NDArray[np.uint8]

APPROACHING = (
    2.3,
    3.3,
)  # m to an object: nearer ones lie below the view of somebody who looks straight ahead
AT_A_BIN = (0.0, 2.2)  # m to the middle of a bin
SETTLED = 1.0  # s; what lies near the start is not approached yet
FACING = math.radians(20.0)
PATIENCE = 240.0  # s of simulated time until every moment must have come


@dataclass(frozen=True, eq=False)
class Now:
    """A moment of a trial.

    Attributes:
        world: The physics.
        observation: What there is.
        targets: Object name -> middle of its bin, m, shape (3,).
    """

    world: World
    observation: Observation
    targets: Mapping[str, NDArray[np.float64]]

    def ahead(self, place: NDArray[np.float64], distance: tuple[float, float]) -> bool:
        """Whether the person faces a place within a range of distances, m."""
        offset = place[:2] - self.observation.position
        turn = math.remainder(math.atan2(offset[1], offset[0]) - self.observation.heading, math.tau)
        return distance[0] < float(np.hypot(*offset)) < distance[1] and abs(turn) < FACING

    def walking(self) -> bool:
        """Whether the person is on the way."""
        return float(np.linalg.norm(self.observation.velocity)) > 0.5

    def visible(self) -> tuple[str, ...]:
        """Objects in view."""
        seen = self.observation
        return visible_objects(self.world.scene, self.world.data, seen.eye, seen.heading, seen.pitch)


Moment = Callable[[Now], bool]


@dataclass(frozen=True)
class Shot:
    """One picture of a trial, taken when its moment has come.

    Attributes:
        name: Of the picture.
        trial: The trial.
        moment: Whether to take it now.
    """

    name: str
    trial: TrialConfig
    moment: Moment


class _Done(Exception):  # noqa: N818 - ends a session early, which is no error
    """All pictures are taken."""


class _Photographer:
    """A viewer that takes pictures when their moments come."""

    def __init__(
        self, glasses: FirstPersonRenderer, shots: Sequence[Shot], targets: Mapping[str, NDArray[np.float64]]
    ) -> None:
        self._glasses = glasses
        self._due = list(shots)
        self._targets = targets
        self.taken: dict[str, Image] = {}

    def camera(self, world: World) -> CameraView:
        """The eye camera."""
        return self._glasses.camera_view(world.data)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Take the pictures whose moment this is."""
        now = Now(world, observation, self._targets)
        come = [shot for shot in self._due if shot.moment(now)]
        if come:
            frame = self._glasses.frame(world.data, hud_state)
            self.taken |= {shot.name: frame for shot in come}
            self._due = [shot for shot in self._due if shot not in come]
        if not self._due:
            raise _Done


def after(seconds: float) -> Moment:
    """The first moment from a simulated time on, s."""
    return lambda now: now.observation.time >= seconds


def approaching(now: Now) -> bool:
    """Hands not full, and an object in view ahead."""
    seen = now.observation
    if len(seen.carried) > 1 or seen.busy or seen.time < SETTLED:
        return False
    places = dict(zip(seen.object_names, seen.object_positions, strict=True))
    near = [n for n in seen.names_with(ObjectStatus.LOOSE) if now.ahead(places[n], APPROACHING)]
    return bool(near) and not set(near).isdisjoint(now.visible())


def carrying_two(now: Now) -> bool:
    """Both hands full, on the way."""
    return len(now.observation.carried) == 2 and not now.observation.busy and now.walking()


def at_a_bin(now: Now) -> bool:
    """The bin of something carried is close ahead."""
    return any(now.ahead(now.targets[name], AT_A_BIN) for name in now.observation.carried)


SITUATIONS: Mapping[str, tuple[str, Moment]] = {
    "start": ("At the start", after(0.4)),
    "object": ("Approaching an object", approaching),
    "carrying": ("Carrying two", carrying_two),
    "bin": ("At a bin", at_a_bin),
}


def take_pictures(shots: Sequence[Shot], film: FilmConfig) -> dict[str, Image]:
    """Run the trials of `shots` as far as needed.

    Returns:
        Frames by the names of the shots, uint8 RGB, shape (height, width, 3).

    Raises:
        RecordError: A moment did not come within four simulated minutes.
        ExperimentError, MjsimError: A trial cannot be run, or nothing can be rendered.
    """
    taken: dict[str, Image] = {}
    for trial in dict.fromkeys(shot.trial for shot in shots):
        house = House.load(trial.house)
        scene = compose(house.sample_episode(objects=trial.objects, seed=trial.seed), house.catalogue)
        mine = [shot for shot in shots if shot.trial == trial]
        targets = {name: house.receptacles[key].center for name, key in scene.episode.targets.items()}
        with FirstPersonRenderer(scene, house, film) as glasses:
            photographer = _Photographer(glasses, mine, targets)
            patient = dataclasses.replace(trial, time_limit=PATIENCE)
            session, _ = prepare_session(patient, house, scene, EventLog(), photographer)
            with contextlib.suppress(_Done):
                session.run()
        missing = [shot.name for shot in mine if shot.name not in photographer.taken]
        if missing:
            raise RecordError(
                f"the moments of {missing} did not come within {PATIENCE:g} s; take another seed"
            )
        taken |= photographer.taken
    return taken


def contact_sheet(
    conditions: Sequence[str], frames: Mapping[tuple[str, str], Image], width: int = 480
) -> Image:
    """Conditions below each other, situations beside each other, with captions.

    Args:
        conditions: Names, from the top.
        frames: Frame by condition and situation.
        width: Of one picture on the sheet, px.

    Returns:
        RGB, uint8.
    """
    margin, caption = width // 40, width // 12
    height = round(width * 3 / 4)
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
    """Write an RGB image of shape (height, width, 3), whole or not at all."""
    with replacing(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def _write(image: Image, text: str, x: int, y: int, size: int) -> None:
    """Dark text with its middle at column `x`, row `y`."""
    face = cv2.FontFace("sans")
    left, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), face, size, 600)
    cv2.putText(image, text, (x - (left + width) // 2, y + size // 3), (30, 34, 40), face, size, 600)
