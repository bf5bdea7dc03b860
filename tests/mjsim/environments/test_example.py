"""Gathering demonstrations, the part of the worked example that needs no learning library."""

import numpy as np
import pytest

from mjsim.environments.control import Continuous
from mjsim.environments.options import EnvironmentOptions, build
from studies.examples.breadcrumbs import breadcrumb_sensor
from studies.examples.demonstrations import demonstrate


@pytest.fixture(scope="module")
def core(house):
    return build(
        EnvironmentOptions(
            objects=1, actions=Continuous(repeat=3), time_limit=60.0, navigable=lambda *_: house.navmesh
        )
    )


def test_the_demonstrator_does_the_task(core, house):
    shown = demonstrate(core, house, seeds=range(2), rng=np.random.default_rng(0))
    assert shown.delivered == 1.0
    assert {len(v) for v in shown.observations.values()} == {len(shown.actions)}
    assert np.abs(shown.actions).max() <= 1.0
    trigger = shown.actions[:, 3]
    assert (trigger == 1.0).sum() >= 2 <= (trigger == -1.0).sum()
    assert (shown.observations["motion"][:, 3] == 0.0).all()  # never while the hands are busy


def test_replayed_demonstrations_do_it_again(core, house):
    shown = demonstrate(core, house, seeds=range(3, 4), rng=np.random.default_rng(0))
    core.reset(3)
    rows, over = iter(shown.actions), False
    while not over:
        action = np.zeros(4, np.float32) if core.world.busy else next(rows)
        taken = core.step(action)
        over = taken.terminated or taken.truncated
    assert taken.terminated


def test_the_learner_drives_and_the_demonstrator_corrects(core, house):
    """A driver that turns on the spot gets advice that is not its own action."""

    def spin(_):
        return np.array([0.0, 0.0, 1.0, 0.0], np.float32)

    shown = demonstrate(core, house, seeds=range(1), rng=np.random.default_rng(0), driver=spin)
    assert shown.delivered == 0.0
    assert len(shown.actions) == 500
    assert np.abs(shown.actions[:, 2]).min() < 0.9
    np.testing.assert_allclose(shown.observations["gps"], 0.0, atol=0.001)


def test_demonstrations_are_repeatable(core, house):
    one, two, other = (
        demonstrate(core, house, seeds=range(1), rng=np.random.default_rng(s), noise=0.2) for s in (0, 0, 1)
    )
    assert one.actions.tobytes() == two.actions.tobytes()
    assert one.actions.tobytes() != other.actions.tobytes()


def test_following_the_breadcrumbs_leads_around_the_walls_to_the_nearest_object(house):
    """Walking where the sensor points, and nothing else, arrives; what is left shrinks by what was walked."""
    core = build(
        EnvironmentOptions(
            objects=2,
            actions=Continuous(repeat=3),
            observations=(breadcrumb_sensor(house),),
            time_limit=30.0,
            navigable=lambda *_: house.navmesh,
        )
    )
    seen, _ = core.reset(0)

    def metres_left():
        return float(seen["breadcrumbs"][2]) * core.layout.scale

    def straight():
        gaps = core.state.object_positions[:, :2] - core.state.position
        return float(np.linalg.norm(gaps, axis=1).min())

    first, walked = metres_left(), 0.0
    assert first > 1.5 * straight() > 3.0, "a wall is in between"
    while metres_left() > 0.8:
        forward, aside, _ = seen["breadcrumbs"]
        turn = np.clip(2.0 * np.arctan2(aside, forward), -1.0, 1.0)
        before = core.state.position.copy()
        taken = core.step(np.array([0.8 if abs(turn) < 0.5 else 0.0, 0.0, turn, 0.0], np.float32))
        assert not taken.truncated
        seen = taken.observation
        walked += float(np.linalg.norm(core.state.position - before))
    assert walked + metres_left() == pytest.approx(first, rel=0.1)
    assert straight() < 1.3
    core.close()
