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

from experiments.assistant import Assistant
from experiments.errors import RecordError
from experiments.glasses import FilmConfig, Glasses
from experiments.house import House
from experiments.records import EventLog
from experiments.trial import TrialConfig, prepare_session
from mjsim.files import replacing
from mjsim.observation import ObjectStatus, Observation
from mjsim.scene import compose
from mjsim.world import World

Image = NDArray[np.uint8]
Moment = Callable[[Observation, Mapping[str, NDArray[np.float64]]], bool]

APPROACHING = 2.4  # m to an object: nearer ones lie below the view of somebody who looks straight ahead
AT_A_BIN = 2.2  # m to the middle of a bin
SETTLED = 2.0  # s; what lies near the start is not approached yet
FACING = math.radians(20.0)
PATIENCE = 240.0  # s of simulated time until every moment must have come


@dataclass(frozen=True)
class Shot:
    """One picture of a trial, taken when its moment has come.

    Attributes:
        name: Of the picture.
        trial: The trial.
        moment: Judges from the observation and each object's target position, m.
    """

    name: str
    trial: TrialConfig
    moment: Moment


class _Done(Exception):  # noqa: N818 - ends a session early, which is no error
    """All pictures are taken."""


class _Photographer:
    """A viewer that takes pictures when their moments come."""

    def __init__(
        self, glasses: Glasses, shots: Sequence[Shot], targets: Mapping[str, NDArray[np.float64]]
    ) -> None:
        self._glasses = glasses
        self._due = list(shots)
        self._targets = targets
        self.taken: dict[str, Image] = {}

    def show(self, world: World, observation: Observation, assistant: Assistant) -> None:
        """Take the pictures whose moment this is."""
        now = [shot for shot in self._due if shot.moment(observation, self._targets)]
        if now:
            frame = self._glasses.frame(world, observation, assistant)
            self.taken |= {shot.name: frame for shot in now}
            self._due = [shot for shot in self._due if shot not in now]
        if not self._due:
            raise _Done


def after(seconds: float) -> Moment:
    """The first moment from a simulated time on, s."""
    return lambda observation, _: observation.time >= seconds


def approaching(observation: Observation, targets: Mapping[str, NDArray[np.float64]]) -> bool:  # noqa: ARG001
    """Hands empty, and an object lies close ahead."""
    places = [
        p for n, p in _positions(observation).items() if n in observation.names_with(ObjectStatus.LOOSE)
    ]
    near = any(_ahead(observation, place, APPROACHING) for place in places)
    return observation.time > SETTLED and not observation.carried and _walking(observation) and near


def carrying_two(observation: Observation, targets: Mapping[str, NDArray[np.float64]]) -> bool:  # noqa: ARG001
    """Both hands full and at rest, on the way."""
    return len(observation.carried) == 2 and not observation.busy and _walking(observation)


def at_a_bin(observation: Observation, targets: Mapping[str, NDArray[np.float64]]) -> bool:
    """The bin of something carried is close ahead."""
    return any(_ahead(observation, targets[name], AT_A_BIN) for name in observation.carried)


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
        with Glasses(scene, house, film) as glasses:
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


def _positions(observation: Observation) -> dict[str, NDArray[np.float64]]:
    return dict(zip(observation.object_names, observation.object_positions, strict=True))


def _walking(observation: Observation) -> bool:
    return float(np.linalg.norm(observation.velocity)) > 0.5


def _ahead(observation: Observation, place: NDArray[np.float64], reach: float) -> bool:
    offset = place[:2] - observation.position
    turn = math.atan2(offset[1], offset[0]) - observation.heading
    return float(np.hypot(*offset)) < reach and abs(math.remainder(turn, math.tau)) < FACING


def _write(image: Image, text: str, x: int, y: int, size: int) -> None:
    """Dark text with its middle at column `x`, row `y`."""
    face = cv2.FontFace("sans")
    left, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), face, size, 600)
    cv2.putText(image, text, (x - (left + width) // 2, y + size // 3), (30, 34, 40), face, size, 600)
