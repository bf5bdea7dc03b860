"""Trials that several sentences look at: real runs in the apartment, with as little physics as possible."""

import pytest

from experiments.house import House
from paper.sessions import Played, play


@pytest.fixture(scope="session")
def house() -> House:
    return House.load()


@pytest.fixture(scope="session")
def followed(house: House) -> Played:
    """Somebody who does what `optimal` suggests."""
    return play(house, "optimal")


@pytest.fixture(scope="session")
def own_way(house: House) -> Played:
    """Somebody who is shown the plan and often does something else."""
    return play(house, "optimal", user="boltzmann:30")
