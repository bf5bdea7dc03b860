"""What a film shows: the whole view of the participant, and the panels of the HUD next to it."""

import dataclasses
import math

import av
import msgspec
import numpy as np
import pytest
from sessions import Recorder

from experiments.errors import RecordError
from experiments.record.records import EventLog
from experiments.session import first_person
from experiments.session.film_config import FilmConfig
from experiments.session.first_person import Filming, FirstPersonRenderer, TrialFilm
from experiments.session.video import VideoWriter
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.compose import Compositor
from hud.state import FLOORPLAN
from mjsim.house.scene.scene import compose
from mjsim.render import Renderer, render_house_map
from mjsim.values.errors import RenderError

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
def scene(house):
    return compose(trial_episode(DEMO, house), house.catalogue)


@pytest.fixture(scope="module")
def drawn(house, scene):
    with FirstPersonRenderer(scene, house, FILM) as renderer:
        yield renderer


@pytest.fixture(scope="module")
def checked(house, scene, drawn):
    """The demo, whose hands were compared."""
    width, height = FILM.view[2:]
    with Renderer(scene.model, width=width, height=height, profile="draft") as bare:
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


@pytest.mark.slow
def test_a_film_has_the_horizontal_field_of_view_that_the_person_has_chosen(house, scene, begun):
    world, _, _ = begun
    for chosen in (1.2, 1.9):
        film = dataclasses.replace(FILM, field_of_view=chosen)
        with FirstPersonRenderer(scene, house, film) as renderer:
            camera = renderer._camera(world.data)
        _, _, width, height = film.view
        assert 2.0 * math.atan(math.tan(camera.fovy / 2.0) * width / height) == pytest.approx(chosen)


@pytest.fixture(scope="module")
def begun(house, scene):
    """The world, the observation and the HUD at the start of the demo."""
    config, recorder = msgspec.structs.replace(DEMO, time_limit=0.2), Recorder()
    session, world = prepare_session(config, house, scene, EventLog(), recorder)
    session.run()
    return world, *recorder.shown[0]


class Lent:
    """A renderer that is used again after it was closed, because a new one takes seconds."""

    def __init__(self, drawn):
        self.frame, self.camera_view = drawn.frame, drawn.camera_view
        self.closed = 0

    def close(self):
        self.closed += 1


@pytest.mark.parametrize("kind", ["film of a trial", "film of a replay"])
def test_every_frame_that_is_shown_is_filmed_and_the_camera_is_that_of_the_view(
    house, scene, drawn, begun, tmp_path, monkeypatch, kind
):
    world, observation, state = begun
    path, frame, camera, lent = (
        tmp_path / "film.mp4",
        drawn.frame(world.data, state),
        drawn.camera_view(world.data),
        Lent(drawn),
    )
    monkeypatch.setattr(first_person, "FirstPersonRenderer", lambda *_: lent)
    if kind == "film of a trial":
        film = TrialFilm(scene, house, FILM, path)
        close = film.close
    else:
        writer = VideoWriter(path, width=FILM.width, height=FILM.height)
        film, close = Filming(lent, writer), writer.close
    found = film.camera(world)
    for _ in range(3):
        film.show(world, observation, state)
    close()
    assert (found.position == camera.position).all() and (found.rotation == camera.rotation).all()
    assert (found.fovy, found.width, found.height) == (camera.fovy, camera.width, camera.height)
    with av.open(str(path)) as container:
        shown = [image.to_ndarray(format="rgb24") for image in container.decode(video=0)]
    assert len(shown) == 3
    assert all(np.abs(image.astype(int) - frame).mean() < 12 for image in shown)
    if kind == "film of a trial":
        assert film.renderer_name and film.failure is None
        assert len(film.frames_sha256) == 64 and lent.closed == 1


def fail(error):
    def failing(*_, **__):
        raise error

    return failing


@pytest.mark.parametrize(
    ("step", "error"),
    [
        ("the renderer", RenderError("no context")),
        ("the renderer", OSError("no driver")),
        ("the writer", RecordError("odd size")),
        ("a picture", RenderError("lost context")),
        ("a frame", RecordError("disk full")),
        ("the end", RecordError("disk full")),
    ],
)
def test_a_trial_whose_film_fails_continues_without_a_film_and_its_file(
    house, scene, drawn, begun, tmp_path, monkeypatch, step, error
):
    world, observation, state = begun
    path, attempts, lent = tmp_path / "film.mp4", [], Lent(drawn)
    monkeypatch.setattr(
        first_person, "FirstPersonRenderer", fail(error) if step == "the renderer" else lambda *_: lent
    )
    if step == "the writer":
        monkeypatch.setattr(first_person, "VideoWriter", fail(error))
    film = TrialFilm(scene, house, FILM, path)
    film.show(world, observation, state)
    if step == "a picture":
        lent.frame = fail(error)
    elif step == "a frame":
        monkeypatch.setattr(film._video, "write", lambda frame: attempts.append(frame) or fail(error)())
    elif step == "the end":
        completed = film._video.close
        monkeypatch.setattr(film._video, "close", lambda: completed() or fail(error)())
    for _ in range(2):
        film.show(world, observation, state)
    film.close()
    assert film.failure == f"no video: {error}"
    assert film.frames_sha256 is None and not path.exists()
    assert len(attempts) == (step == "a frame"), "nothing is written after the first failure"
    assert (film.camera(world) is None) == (step == "the renderer")
    assert lent.closed == (step != "the renderer")
