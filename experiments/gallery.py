"""The pictures of the README: what a person sees under each condition, taken from real trials."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.assistant import Assistant
from experiments.glasses import FilmConfig, Glasses
from experiments.house import House
from experiments.records import EventLog
from experiments.trial import TrialConfig, prepare_session
from mjsim.files import replacing
from mjsim.observation import Observation
from mjsim.scene import compose
from mjsim.world import World


@dataclass(frozen=True)
class Shot:
    """One picture: the trial, and the simulated moment at which it is taken, s."""

    name: str
    trial: TrialConfig
    time: float


class _Photographer:
    """A viewer that takes pictures at given moments."""

    def __init__(self, glasses: Glasses, shots: Sequence[Shot], out: Path) -> None:
        self._glasses = glasses
        self._due = sorted(shots, key=lambda shot: shot.time)
        self._out = out

    def show(self, world: World, observation: Observation, assistant: Assistant) -> None:
        """Take the pictures that are due."""
        while self._due and observation.time >= self._due[0].time:
            frame = self._glasses.frame(world, observation, assistant)
            save_png(self._out / f"{self._due.pop(0).name}.png", frame)


def save_png(path: Path, rgb: NDArray[np.uint8]) -> None:
    """Write an RGB image of shape (height, width, 3), whole or not at all."""
    with replacing(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))


def take_pictures(
    shots: Sequence[Shot], out: Path, film: FilmConfig, on_picture: Callable[[Shot], None] = lambda _: None
) -> None:
    """Run the trials of `shots` as far as needed and write `out/<name>.png` for each.

    Raises:
        ExperimentError, MjsimError: A trial cannot be run, or nothing can be rendered.
    """
    out.mkdir(parents=True, exist_ok=True)
    for trial in dict.fromkeys(shot.trial for shot in shots):
        house = House.load(trial.house)
        scene = compose(house.sample_episode(objects=trial.objects, seed=trial.seed), house.catalogue)
        mine = [shot for shot in shots if shot.trial == trial]
        short = dataclasses.replace(trial, time_limit=max(shot.time for shot in mine) + 0.1)
        with Glasses(scene, house, film) as glasses:
            session, _ = prepare_session(short, house, scene, EventLog(), _Photographer(glasses, mine, out))
            session.run()
        for shot in mine:
            on_picture(shot)
