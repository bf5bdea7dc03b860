"""Section 3, the simulator: each test is a sentence of docs/paper.md."""

import dataclasses

import numpy as np
import pytest
from sessions import SIZES, opened

from experiments.participants.follower import Follower
from experiments.record.records import EventLog
from experiments.session.film_config import FilmConfig
from experiments.session.first_person import FirstPersonRenderer
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from hud.compose import Compositor
from hud.messages import message
from mjsim.house.scene.scene import compose
from mjsim.values.actions import IDLE, ActionResult, Move, Pick, Place, Refusal
from mjsim.values.observation import ObjectStatus

UNKNOWN = "object_99"


class Clumsy:
    """Tidies up as a follower does, and tries everything infeasible once, as soon as the world would refuse it."""

    needs = frozenset()

    def __init__(self, house):
        self._follower = Follower(house, np.random.default_rng(0))
        self.world = None
        self.tried: dict[Refusal, ActionResult] = {}
        self._pause = False

    def act(self, percept):
        if self._pause:  # the picture is taken before anything else happens
            self._pause = False
            return IDLE
        names = [*self.world.scene.index.names, UNKNOWN]
        for action in (Pick(), Place(), *(kind(name) for kind in (Pick, Place) for name in names)):
            answer = self.world.answer(action)
            if answer.refusal is not None and answer.refusal not in self.tried:
                self.tried[answer.refusal] = answer
                self._pause = True
                return action
        return self._follower.act(percept)


class Photographer:
    """A viewer that draws what is shown right after each refusal, with and without the message."""

    def __init__(self, scene, house):
        self._renderer = FirstPersonRenderer(scene, house, FilmConfig(*SIZES[0], "draft"))
        self.close = self._renderer.close
        self.user = None
        self.pictures: dict[Refusal, tuple] = {}

    def camera(self, world):  # noqa: ARG002 - a viewer
        return None  # no pointer

    def show(self, world, observation, hud_state):  # noqa: ARG002 - a viewer
        states = hud_state, dataclasses.replace(hud_state, message=None)
        for refusal in self.user.tried.keys() - self.pictures.keys():
            frames = [self._renderer.frame(world.data, state) for state in states]
            self.pictures[refusal] = hud_state, *frames


@pytest.fixture(scope="module")
def refused(house, pictures):  # noqa: ARG001 - drawn once
    """A session in which everything infeasible was tried, with a picture of each refusal."""
    config = TrialConfig(objects=6, assistance="none", seed=3, fidelity="event", regret=False)
    scene = compose(trial_episode(config, house), house.catalogue)
    photographer, user, log = Photographer(scene, house), Clumsy(house), EventLog()
    session, world = prepare_session(config, house, scene, log, photographer, user=user)
    user.world, photographer.user = world, user
    session.run()
    photographer.close()
    return user.tried, photographer.pictures, log.events


@pytest.mark.slow
def test_every_refusal_is_caused_in_a_session(refused):
    tried, _, events = refused
    assert set(tried) == set(Refusal)
    assert {e["refusal"] for e in events if e["event"] == "attempt" and not e["applied"]} == {
        refusal.value for refusal in Refusal
    }
    assert events[-1]["reason"] == "all delivered"


@pytest.mark.slow
@pytest.mark.parametrize("refusal", list(Refusal), ids=lambda refusal: refusal.value)
def test_the_message_bar_says_why_an_attempt_is_infeasible(refused, refusal, house, pictures):
    """Its pixels are those of this refusal's text over the same frame; without it, and for others, they differ."""
    tried, pictured, _ = refused
    result, compositor = tried[refusal], Compositor(pictures, house.texts)
    state, frame, without = pictured[refusal]
    rect = compositor.layout(state, *SIZES[0]).panels["message"]
    bar = slice(rect.y, rect.bottom), slice(rect.x, rect.right)
    labels = _labels(house, result)

    def saying(other):
        words = dataclasses.replace(state, message=message(other.value, house.texts, **labels))
        return compositor.compose(without, words)[bar]

    assert (frame[bar] != without[bar]).any()
    for other in Refusal:
        assert (saying(other) == frame[bar]).all() == (other is refusal), (state.message, other)


def _labels(house, result):
    """What a message about a refusal names, from the catalogue."""
    if result.object is None or result.object == UNKNOWN:
        return {}
    (placed,) = [o for o in house.sample_episode(objects=6, seed=3).objects if o.name == result.object]
    target = house.catalogue.categories[placed.category].receptacle
    return {
        "object": house.catalogue.objects[placed.model].label,
        "receptacle": house.catalogue.receptacles[target].label,
    }


def test_the_message_bar_tells_successes(followed):
    for event in followed.of("picked", "placed")[:-1]:  # at the end, all is done
        _, state = followed.at(event["t"] + 0.04)
        assert state.message is not None
        assert state.message.text.startswith("You picked up" if event["event"] == "picked" else "You put the")
        assert state.message.kind.value == "success"


def test_the_knapsack_holds_two_and_shows_what(own_way, house):
    """The two hands show name and picture of what they hold, and nothing else."""
    placed = {o.name: o for o in own_way.world.scene.episode.objects}
    catalogue = house.catalogue
    most = 0
    for observation, state in own_way.shown[::25]:
        held = [
            None if name is None else catalogue.objects[placed[name].model].label
            for name in observation.hands
        ]
        assert [slot.label for slot in state.inventory] == held
        most = max(most, len(observation.carried))
    assert most == 2


def test_an_object_beyond_a_set_distance_is_not_picked(house):
    """The set distance is the reach, 1 m from the body's axis."""
    _, world, _ = opened(house, "none", objects=24)
    observation = world.reset()
    assert world.scene.person.reach == 1.0
    gaps = np.linalg.norm(observation.object_positions[:, :2] - observation.position, axis=1)
    answers = [world.answer(Pick(name)).refusal for name in observation.object_names]
    assert (gaps > 1.0).sum() > 20
    assert {answer for answer, gap in zip(answers, gaps, strict=True) if gap > 1.0} == {Refusal.OUT_OF_REACH}


def test_what_is_picked_or_placed_was_within_the_set_distance(followed, own_way, house):
    for played in (followed, own_way):
        targets = played.world.scene.episode.targets
        for visit in played.of("visit"):
            stood = np.array(visit["position"])
            if visit["kind"] == "place":
                assert house.receptacles[targets[visit["object"]]].distance(stood) <= 1.0 + 1e-6
            else:
                # While it is lifted it comes nearer.
                assert np.linalg.norm(played.lay(visit) - stood) <= 1.0 + 0.3


def test_an_object_is_placed_only_into_its_own_bin(refused, own_way):
    assert Refusal.NOT_THE_RECEPTACLE in refused[0]
    targets = own_way.world.scene.episode.targets
    assert all(event["receptacle"] == targets[event["object"]] for event in own_way.of("placed"))
    assert own_way.shown[-1][0].object_status == (ObjectStatus.DELIVERED,) * 6


def test_markers_stay_where_they_are_in_the_world_while_the_head_turns(house):
    session, world, _ = opened(house, "highlight", objects=6)
    observation, assistant = world.reset(), session.assistant
    assistant.begin(observation)
    before = assistant.hud_state(observation).markers
    for _ in range(20):
        observation = world.step(Move(turn=2.0)).observation
    assert assistant.hud_state(observation).markers == before
