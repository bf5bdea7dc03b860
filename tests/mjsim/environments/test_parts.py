"""Actions, rewards and episodes: what an environment is put together from."""

import itertools
import math
from functools import partial
from importlib.metadata import EntryPoint

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_worlds import episode_of

import mjsim
from mjsim.environments.control import MOVES, Continuous, Discrete
from mjsim.environments.episodes import EpisodeCache, sample
from mjsim.environments.options import EnvironmentOptions, build
from mjsim.environments.rewards import TimeReward, potential
from mjsim.house.compiled import house
from mjsim.house.compiled.house import installed_builder
from mjsim.values.actions import IDLE, Move, Pick, Place
from mjsim.values.errors import ActionError, EnvironmentConfigError, PhysicsError, SamplingError
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.world import World
from planner.navmesh import NavMesh


@pytest.fixture(scope="module")
def open_floor(small_catalogue):
    """In the middle of the west room, nothing in the way; a cube lies in the east."""
    return episode_of(small_catalogue, (1.0, 2.0, 0.2), ("cube", 4.5, 1.0))


def core_of(episode, **options):
    return build(EnvironmentOptions(house=episode.house, episodes=(episode,), **options))


@pytest.fixture(scope="module")
def walker(open_floor):
    return core_of(open_floor, actions="discrete", time_limit=600.0)


@pytest.mark.parametrize(
    ("actions", "stride", "angle"),
    [("discrete", 0.25, 10), (Discrete(stride=0.5, angle=math.radians(30)), 0.5, 30)],
)
def test_strides_and_turns_are_as_long_as_asked(open_floor, actions, stride, angle):
    core = core_of(open_floor, actions=actions, time_limit=600.0)
    core.reset(0)
    for _ in range(2):
        before = core.state
        after = core.step(MOVES.index("forward")).steps[-1].observation
        walked = after.position - before.position
        ahead = np.array([math.cos(before.heading), math.sin(before.heading)])
        assert walked @ ahead == pytest.approx(stride, abs=0.005)
        assert abs(walked @ np.array([-ahead[1], ahead[0]])) < 0.002
        assert np.linalg.norm(after.velocity) < 0.02
    for move, sign in (("turn_left", 1), ("turn_right", -1)):
        start = core.state
        for _ in range(36):
            before = core.state.heading
            core.step(MOVES.index(move))
            assert math.degrees(core.state.heading - before) == pytest.approx(sign * angle, abs=0.2)
        turned = math.degrees(core.state.heading - start.heading)
        assert turned == pytest.approx(36 * sign * angle, abs=2.0)
        np.testing.assert_allclose(core.state.position, start.position, atol=0.01)


def test_a_blocked_stride_ends(small_catalogue):
    core = core_of(
        episode_of(small_catalogue, (0.3, 2.0, math.pi), ("cube", 4.5, 1.0)),
        actions="discrete",
    )
    core.reset(0)
    taken = core.step(MOVES.index("forward"))
    assert core.state.position[0] > 0.18
    assert 0.1 < core.state.time < 1.0
    assert not taken.terminated and not taken.truncated


WALK = Move(forward=1.4)


@pytest.mark.parametrize(
    ("repeat", "action", "asked"),
    [
        (1, [0.5, -0.25, 1.0, 0.4], [Move(forward=0.7, left=-0.35, turn=2.5)]),
        (1, [9.0, 0.0, -9.0, -0.4], [Move(forward=1.4, turn=-2.5)]),
        (3, [1.0, 0.0, 0.0, 0.6], [Pick(), WALK, WALK]),
        (2, [1.0, 0.0, 0.0, -0.6], [Place(), WALK]),
        (1, [0.0, 0.0, 0.0, 0.0], [IDLE]),
    ],
)
def test_continuous_actions_are_shares_of_the_limits_and_attempt_once(walker, repeat, action, asked):
    walker.reset(0)
    assert list(Continuous(repeat).steps(np.array(action), walker.state, walker.world)) == asked


@pytest.mark.parametrize("action", [5, -1, 1.0, "pick", None, [0, 1]])
def test_unusable_discrete_actions_are_refused(walker, action):
    walker.reset(0)
    with pytest.raises(ActionError, match="whole number"):
        walker.step(action)


@pytest.mark.parametrize("action", [None, "x", {}, [], [math.nan] * 4, ["a"] * 4, [[0] * 4]])
def test_unusable_continuous_actions_are_refused(open_floor, action):
    core = core_of(open_floor)
    core.reset(0)
    with pytest.raises(ActionError, match="four finite numbers"):
        core.step(action)


@given(
    weight=st.floats(0.1, 3.0),
    discount=st.floats(0.5, 1.0),
    actions=st.lists(st.sampled_from([0, 1, 2, 3]), min_size=1, max_size=4),
)
def test_shaping_telescopes(walker, weight, discount, actions):
    """Discounted shaping adds up to a difference of potentials, so no way of walking can earn by it (Ng 1999)."""
    walker.reset(0)
    scene = walker.world.scene
    states = [walker.state]
    for action in actions:
        walker.step(action)
        states.append(walker.state)
    plain, shaped = TimeReward(), TimeReward(shaping=weight, discount=discount)
    bonus = sum(
        discount**k * (shaped(scene, a, b) - plain(scene, a, b))
        for k, (a, b) in enumerate(itertools.pairwise(states))
    )
    ends = discount ** len(actions) * potential(scene, states[-1]) - potential(scene, states[0])
    assert bonus == pytest.approx(weight * ends, abs=1e-6)


def test_the_potential_is_the_time_to_the_end(small_catalogue):
    """By hand: the way to the cube, from there to the crate, and two handlings; less after each, 0 at the end."""
    core = core_of(
        episode_of(small_catalogue, (1.0, 3.2, 0.3), ("cube", 1.6, 3.1)),
        actions="discrete",
        reward="shaped",
    )
    core.reset(0)
    at_start = potential(core.world.scene, core.state)
    by_hand = -((math.dist((1.0, 3.2), (1.6, 3.1)) + math.dist((1.6, 3.1), (0.3, 3.7))) / 1.3 + 2 * 2.0)
    assert at_start == pytest.approx(by_hand, abs=0.02)
    rewards = [core.step(MOVES.index("pick")).reward]
    assert at_start < potential(core.world.scene, core.state) < 0
    last = core.step(MOVES.index("place"))
    assert last.terminated
    assert potential(core.world.scene, core.state) == 0.0
    assert sum(rewards) + last.reward == pytest.approx(-core.state.time - at_start)


@pytest.mark.parametrize(
    ("made", "values"),
    [
        (Continuous, {"repeat": 0}), (Discrete, {"stride": 0}), (Discrete, {"angle": -1}),
        (TimeReward, {"discount": 1.5}), (TimeReward, {"shaping": math.nan}), (TimeReward, {"per_second": math.inf}),
    ],
)  # fmt: skip
def test_unusable_controls_and_rewards_are_refused(made, values):
    with pytest.raises(EnvironmentConfigError):
        made(**values)


def test_a_reward_of_your_own(open_floor):
    core = core_of(open_floor, reward=lambda scene, *_: 7.0 * len(scene.index.names))
    core.reset(0)
    assert core.step(np.zeros(4)).reward == 7.0


@pytest.mark.parametrize("reward", [math.nan, math.inf, None, "1", np.zeros(2)])
def test_a_reward_is_a_finite_number(open_floor, reward):
    core = core_of(open_floor, reward=lambda *_: reward)
    core.reset(0)
    with pytest.raises(EnvironmentConfigError, match=r"the reward is .*test_parts.py, line"):
        core.step(np.zeros(4))


@pytest.fixture(scope="module")
def draw(catalogue, navmesh):
    """Seed -> episode of one object in the apartment."""
    return partial(sample, catalogue, navmesh, (1, 1))


def cache(catalogue, draw, count=None):
    return EpisodeCache(
        catalogue, draw, count=count, options=WorldOptions(), person=PersonParameters(), size=2
    )


def test_compiled_episodes_are_reused_and_freed(catalogue, draw):
    episodes = cache(catalogue, draw)
    first, second = episodes.get(1), episodes.get(2)
    assert episodes.get(1) is first
    third = episodes.get(3)
    assert episodes.get(1) is first and episodes.get(3) is third
    again = episodes.get(2)
    assert again is not second
    assert again.world.scene.episode == second.world.scene.episode


def test_a_number_of_episodes_come_again_and_again(catalogue, draw):
    episodes = cache(catalogue, draw, count=3)
    assert [episodes.get(s).world.scene.episode.seed for s in (0, 1, 2, 3, 7)] == [0, 1, 2, 0, 1]
    assert episodes.get(1) is episodes.get(4)


def test_the_number_of_objects_is_drawn_by_the_seed(catalogue, navmesh):
    counts = [len(sample(catalogue, navmesh, (1, 3), seed).objects) for seed in range(12)]
    assert set(counts) == {1, 2, 3}
    assert counts == [len(sample(catalogue, navmesh, (1, 3), seed).objects) for seed in range(12)]


def test_given_episodes_need_no_navigable_floor(open_floor, monkeypatch):
    core_of(open_floor).reset(5)  # the house is checked, which needs one, and only once
    monkeypatch.setattr(house, "entry_points", lambda **_: ())
    core = core_of(open_floor)
    core.reset(5)
    assert core.world.scene.episode is open_floor
    assert core.layout.slots == 1


def test_a_jammed_house_is_drawn_anew(navmesh, monkeypatch):
    """A drawn seed that cannot be sampled gives way to the next; a seed that was asked for does not."""
    core = build(EnvironmentOptions(objects=1, navigable=lambda *_: navmesh))
    get, refused = EpisodeCache.get, []

    def refuse_the_first(self, seed):
        if not refused:
            refused.append(seed)
            raise SamplingError("as if jammed")
        return get(self, seed)

    monkeypatch.setattr(EpisodeCache, "get", refuse_the_first)
    _, info = core.reset_random(np.random.default_rng(0))
    assert refused and info["episode_seed"] not in refused
    refused.clear()
    with pytest.raises(SamplingError):
        core.reset(3)


def test_the_installed_builder_is_the_planners():
    assert installed_builder() == NavMesh.build


@pytest.mark.parametrize(
    ("offers", "said"),
    [
        ([], "no installed package"),
        ([EntryPoint("broken", "mjsim_nowhere:build", house.GROUP)], "mjsim_nowhere"),
        ([EntryPoint("broken", "math:tangent", house.GROUP)], "tangent"),
    ],
)
def test_a_missing_builder_is_named(offers, said, monkeypatch):
    monkeypatch.setattr(house, "entry_points", lambda **_: offers)
    with pytest.raises(SamplingError, match=said):
        installed_builder()


def test_physics_errors_can_cut_an_episode_off(open_floor, monkeypatch):
    """Where training should continue, the step that failed truncates with the last state that was sound."""
    core = core_of(open_floor, physics_errors="truncate")
    core.reset(0)
    core.step(np.ones(4))
    sound = core.state
    step, calls = World.step, []

    def fail_at_the_second(self, action):
        calls.append(action)
        if len(calls) == 2:
            self.data.qpos[:] = np.nan
            raise PhysicsError("as if MuJoCo had warned")
        return step(self, action)

    with monkeypatch.context() as broken:
        broken.setattr(World, "step", fail_at_the_second)
        core.step(np.zeros(4))
        sound = core.state
        failed = core.step(np.zeros(4))
    assert failed.truncated and not failed.terminated
    assert failed.reward == 0.0 and "warned" in failed.info["physics_error"]
    np.testing.assert_allclose(
        failed.observation["pose"][2:], [math.cos(sound.heading), math.sin(sound.heading)], atol=1e-6
    )
    core.reset(0)
    assert np.isfinite(core.step(np.zeros(4)).observation["gps"]).all()


def test_closing_lets_go_and_resetting_makes_anew(open_floor):
    env = mjsim.make(house=open_floor.house, episodes=(open_floor,), seed=0)
    one = env.reset().observation
    env.close()
    env.close()
    two = env.step(np.zeros(4)).observation
    assert {k: v.tobytes() for k, v in one.items()} == {k: v.tobytes() for k, v in two.items()}
