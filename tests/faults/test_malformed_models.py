"""Damaged houses, objects and episodes are used or refused in one line: no traceback, no crash, no hang.

`--hypothesis-profile thorough` tries thousands.
"""

import faulthandler
import sys

import numpy as np
import pytest
from example_house import FILES, write_example_house
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.support.hostile_files import damage_text, pick
from experiments.cli.failures import exit_code
from experiments.house import House
from mjsim.actions import Move
from mjsim.episode import Episode
from mjsim.errors import PhysicsError
from mjsim.model.scene import compose
from mjsim.world import World

LIMIT = 60.0  # s for one case
EPISODE = "episode.json"


@pytest.fixture(scope="module")
def episode(tmp_path_factory):
    """An episode of the good house, whose folder it calls HOUSE."""
    folder = tmp_path_factory.mktemp("good")
    house = House.load(str(write_example_house(folder)))
    return house.sample_episode(objects=3, seed=0, points=5).to_json().replace(str(folder), "HOUSE")


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(seed=st.integers(0, 2**32 - 1))
def test_damaged_files_are_used_or_refused_in_one_line(seed, episode, tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("damaged"), np.random.default_rng(seed)
    catalogue = write_example_house(folder)
    (folder / EPISODE).write_text(episode.replace("HOUSE", str(folder)))
    name = pick([*FILES, EPISODE], rng)
    damage_text(folder / name, rng)
    faulthandler.dump_traceback_later(LIMIT, exit=True, file=sys.__stderr__)
    try:
        use(catalogue, folder / EPISODE if name == EPISODE else None)
    except Exception as error:
        if exit_code(error) is None:
            raise
        assert "\n" not in str(error)
        assert 10 <= len(str(error)) <= 2000
    finally:
        faulthandler.cancel_dump_traceback_later()


def use(catalogue, episode_file):
    """Load, sample or read an episode, and walk a few steps; what is accepted must work."""
    house = House.load(str(catalogue))
    episode = (
        house.sample_episode(objects=3, seed=0, points=5)
        if episode_file is None
        else Episode.load(episode_file)
    )
    world = World(compose(episode, house.catalogue))
    try:
        seen = [world.step(Move(forward=1.0, turn=0.5)).observation for _ in range(10)][-1]
    except PhysicsError as error:
        raise AssertionError("accepted, but the physics failed") from error
    assert np.isfinite(seen.position).all() and np.isfinite(seen.object_positions).all()
