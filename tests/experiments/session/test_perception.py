"""What a participant may perceive."""

import dataclasses

import numpy as np
import pytest
from sessions import Recorder, opened

from experiments.session.session import INTERRUPTED
from mjsim.house.sight.sight import visible_objects
from mjsim.render import Renderer
from mjsim.values.actions import WAIT
from mjsim.values.observation import ObjectStatus


class Spy:
    """Stands where it is and turns, and hands every percept to a check."""

    needs = frozenset()
    check = None

    def act(self, percept):
        Spy.check(percept)
        return WAIT


def spy(house, rng):  # noqa: ARG001 - the interface of participants
    return Spy()


def percepts(house, assistance, monkeypatch):
    """The first percept of a session, what there is in the world then, and what the HUD shows."""
    found, recorder = [], Recorder()
    session, world, _ = opened(house, assistance, recorder, user=f"{__name__}:spy", objects=12)

    def check(percept):
        found.append(percept)
        raise KeyboardInterrupt

    monkeypatch.setattr(Spy, "check", check)
    assert session.run() == INTERRUPTED
    return found[0], world, *recorder.shown[0]


def numbers_in(value):
    """All arrays of numbers within a value."""
    if isinstance(value, np.ndarray):
        yield value.ravel()
    elif isinstance(value, dict):
        for part in value.values():
            yield from numbers_in(part)
    elif isinstance(value, (list, tuple)):
        for part in value:
            yield from numbers_in(part)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from numbers_in(getattr(value, field.name))


def told(percept):
    """All that a participant can read off a percept, but for regrets (models of compliance) and which bins it sees."""
    public = [n for n in dir(percept) if not n.startswith("_") and n not in ("choices", "look_for")]
    return [value() if callable(value) else value for value in (getattr(percept, n) for n in public)]


def test_nothing_in_a_percept_holds_the_position_of_an_unseen_object(house, monkeypatch):
    percept, world, observation, hud_state = percepts(house, "none", monkeypatch)
    eye = observation.eye, observation.heading, observation.pitch
    seen = set(visible_objects(world.scene, world.data, *eye))
    assert set(percept.look()) == seen
    assert percept.hud() is hud_state
    unseen = [n for n in observation.names_with(ObjectStatus.LOOSE) if n not in {*seen, *percept.nearby}]
    assert len(unseen) >= 6
    places = dict(zip(observation.object_names, observation.object_positions[:, :2], strict=True))
    numbers = np.concatenate([np.zeros(0), *numbers_in(told(percept))])
    for name in unseen:
        assert not np.isin(places[name], numbers).any(), name
        assert np.linalg.norm(places[name] - observation.position) >= 1.3


@pytest.mark.parametrize("assistance", ["highlight", "optimal"])
def test_flagpoles_are_those_of_the_picture(house, monkeypatch, assistance):
    """Every pole that has pixels in a frame drawn without the HUD's panels is perceived, and no other."""
    percept, world, observation, hud_state = percepts(house, assistance, monkeypatch)
    poles = {
        m.object: m.position[:2] for m in hud_state.markers if m.role == "flagpole" and m.shape == "sphere"
    }
    assert set(poles) == set(observation.names_with(ObjectStatus.LOOSE))
    with Renderer(world.scene.model) as renderer:
        plain = renderer.rgb(world.data)

        def is_drawn(name):
            markers = [m for m in hud_state.markers if m.object == name]
            return (renderer.rgb(world.data, markers=markers) != plain).any()

        drawn = set(filter(is_drawn, poles))
    assert 0 < len(drawn) < len(poles), "some are behind the person"
    assert set(percept.flagpoles) == drawn
    assert {name: tuple(place) for name, place in percept.flagpoles.items()} == {n: poles[n] for n in drawn}
