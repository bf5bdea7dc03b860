"""What a film shows: the whole view of the participant, and the panels of the HUD next to it."""

import dataclasses

import pytest
from sessions import Recorder

from experiments.record.records import EventLog
from experiments.session import first_person
from experiments.session.film_config import FilmConfig
from experiments.session.first_person import FirstPersonRenderer
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.compose import Compositor
from hud.state import FLOORPLAN
from mjsim.house.scene.scene import compose
from mjsim.render import Renderer, render_house_map

DEMO = TrialConfig(objects=6, assistance="guided", seed=0, fidelity="event")
FILM = FilmConfig.with_panels(640, 360, "draft")


class Checker(Recorder):
    """A viewer that compares the view in frames of a film with the bare view, while the hands move."""

    def __init__(self, drawn, bare):
        super().__init__()
        self._drawn, self._bare = drawn, bare
        self.hidden = []  # number of pixels below the messages that differ, for each compared frame

    def show(self, world, observation, hud_state):
        if observation.busy and len(self.shown) % 20 == 0:
            left, top, width, height = FILM.view
            frame = self._drawn.frame(world.data, hud_state)[top : top + height, left : left + width]
            view = self._bare.rgb(world.data, markers=hud_state.markers)
            self.hidden.append(int((frame != view)[height // 8 :].any(axis=2).sum()))
        super().show(world, observation, dataclasses.replace(hud_state, pointer=None))


@pytest.fixture(scope="module")
def checked(house):
    """The demo, whose hands were compared."""
    scene = compose(trial_episode(DEMO, house), house.catalogue)
    width, height = FILM.view[2:]
    with (
        FirstPersonRenderer(scene, house, FILM) as drawn,
        Renderer(scene.model, width=width, height=height, profile="draft") as bare,
    ):
        checker = Checker(drawn, bare)
        session, _ = prepare_session(DEMO, house, scene, EventLog(), checker)
        session.run()
    return checker


@pytest.mark.slow
def test_hands_and_what_they_reach_for_are_never_hidden(checked):
    assert len(checked.hidden) >= 10 and max(checked.hidden) == 0


def test_panels_cover_at_most_a_quarter_of_the_demos_frames_and_nothing_of_its_view(checked, house):
    film, compositor = FilmConfig.with_panels(), Compositor({}, house.texts, beside=True)
    left, top, width, height = film.view
    for _, state in checked.shown[::25]:
        panels = compositor.layout(state, film.width, film.height).panels
        assert sum(r.width * r.height for r in panels.values()) <= 0.25 * film.width * film.height
        over = {
            name
            for name, r in panels.items()
            if r.x < left + width and left < r.right and r.y < top + height and top < r.bottom
        }
        assert over <= {"message"}
        if "message" in over:
            assert panels["message"].bottom < top + height // 8, "far above the hands"


def test_a_minimap_shows_the_house_from_above_also_if_its_picture_is_drawn_late(house, monkeypatch):
    config = TrialConfig(objects=6, assistance="none-minimap", seed=0, fidelity="event", time_limit=1.0)
    scene, recorder = compose(trial_episode(config, house), house.catalogue), Recorder()
    session, world = prepare_session(config, house, scene, EventLog(), recorder)
    session.run()
    state, frames = recorder.shown[0][1], []
    for pictures in ({}, {FLOORPLAN: render_house_map(house.catalogue, house.bounds)}):
        monkeypatch.setattr(first_person, "render_pictures", lambda _, found=pictures: dict(found))
        with FirstPersonRenderer(scene, house, FILM) as drawn:
            frames.append(drawn.frame(world.data, state))
    assert state.minimap is not None
    assert (frames[0] == frames[1]).all()
