"""Trials that several sentences look at: real runs in the apartment, with as little physics as possible."""

import pytest
from sessions import play

from mjsim.render import render_pictures


@pytest.fixture(scope="session")
def pictures(house):
    """The pictures of the lists, drawn once for all frames of these tests."""
    found = render_pictures(house.catalogue)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("experiments.session.first_person.render_pictures", lambda _: dict(found))
        yield found


@pytest.fixture(scope="session")
def followed(house):
    """Somebody who does what `optimal` suggests."""
    return play(house, "optimal")


@pytest.fixture(scope="session")
def own_way(house):
    """Somebody who is shown the plan and often does something else."""
    return play(house, "optimal", user="boltzmann:30")
