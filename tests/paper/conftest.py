"""Trials that several sentences look at: real runs in the apartment, with as little physics as possible."""

import pytest

from experiments.house import House
from mjsim.render import render_pictures
from paper.sessions import Played, play


@pytest.fixture(scope="session")
def house() -> House:
    return House.load()


@pytest.fixture(scope="session")
def pictures(house: House):
    """The pictures of the lists, drawn once for all frames of these tests."""
    found = render_pictures(house.catalogue)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("experiments.session.first_person.render_pictures", lambda _: dict(found))
        yield found


@pytest.fixture(scope="session")
def followed(house: House) -> Played:
    """Somebody who does what `optimal` suggests."""
    return play(house, "optimal")


@pytest.fixture(scope="session")
def own_way(house: House) -> Played:
    """Somebody who is shown the plan and often does something else."""
    return play(house, "optimal", user="boltzmann:30")
