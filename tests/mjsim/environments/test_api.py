"""Both public interfaces: conformance, seeding, ends of episodes, vectors, rendering, and errors."""

import copy
import math
import pickle
import warnings
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from absl.testing import absltest
from dm_env import specs, test_utils
from gymnasium.utils.env_checker import check_env
from small_worlds import episode_of

import mjsim
from mjsim.environments import gymnasium_environment, viewer
from mjsim.environments.control import MOVES
from mjsim.values.errors import (
    ActionError,
    EnvironmentConfigError,
    EnvironmentStateError,
    PhysicsError,
    ViewerError,
)
from mjsim.world.world import World

FORWARD, PICK, PLACE = MOVES.index("forward"), MOVES.index("pick"), MOVES.index("place")
ID = "mjsim.environments:mjsim/Rearrange-v0"


@pytest.fixture(scope="module")
def easy(small_catalogue):
    """A cube and its crate, both within reach of the start, so that two actions finish the task."""
    cube = episode_of(small_catalogue, (1.0, 3.2, 0.3), ("cube", 1.6, 3.1))
    return {"house": small_catalogue.name, "episodes": (cube,), "time_limit": 20.0}


@pytest.fixture
def discrete(easy):
    made = mjsim.make(seed=0, actions="discrete", **easy)
    yield made
    made.close()


class _Conformance(test_utils.EnvironmentTestMixin):
    options: dict[str, Any]

    @pytest.fixture(autouse=True)
    def _options(self, easy):
        self.options = easy


class DiscreteConformance(_Conformance, absltest.TestCase):
    """dm_env's own contract, over the end of an episode."""

    def make_object_under_test(self):
        return mjsim.make(
            seed=0, actions="discrete", observations=("state", "map", "in_view"), **self.options
        )

    def make_action_sequence(self):
        return iter([FORWARD, PICK, PLACE, PICK, FORWARD])


class ContinuousConformance(_Conformance, absltest.TestCase):
    """dm_env's own contract, with images, over a cut-off."""

    def make_object_under_test(self):
        seen = ("state", "rgb", "depth", "segmentation", "visible_pixels")
        return mjsim.make(seed=0, observations=seen, **{**self.options, "time_limit": 0.2})


def test_delivering_everything_terminates(discrete):
    discrete.reset()
    picked = discrete.step(PICK)
    assert picked.mid() and picked.discount == 1.0
    last = discrete.step(PLACE)
    assert last.last() and last.discount == 0.0
    assert last.observation["object_status"].tolist() == [[0.0, 0.0, 1.0]]
    assert last.observation["remaining"] == 0.0
    assert discrete.step(FORWARD).first()


def test_time_limit_truncates(easy):
    """A cut-off episode keeps discount 1, and ends within a control step of its limit even amid an action."""
    env = mjsim.make(seed=0, actions="discrete", **{**easy, "time_limit": 0.5})
    env.reset()
    last = env.step(PICK)
    assert last.last() and last.discount == 1.0
    assert env.core.state.time == pytest.approx(0.52, abs=0.021)
    assert env.core.state.busy
    env.close()


def test_reward_is_minus_time(discrete):
    discrete.reset()
    total = sum(discrete.step(a).reward for a in (FORWARD, PICK, PLACE))
    assert total == pytest.approx(-discrete.core.state.time, abs=1e-9)


def test_physics_is_the_state_that_runs(discrete):
    """dm_control's view is of the episode to come, then of the running one, without a copy."""
    physics = discrete.physics
    discrete.reset()
    discrete.step(FORWARD)
    assert discrete.physics is physics
    assert physics.time() == discrete.core.state.time > 0.0
    np.testing.assert_array_equal(physics.named.data.qpos["avatar/x"], discrete.core.state.position[0])


def test_make_is_seeded():
    """The same seed gives the same houses, the first one being the seed's own; another seed gives others."""
    starts = []
    for seed in (4, 4, 5):
        env = mjsim.make(objects=2, seed=seed)
        env.reset()
        first = env.core.world.scene.episode
        env.reset()
        starts.append((first.seed, env.core.world.scene.episode))
        env.close()
    assert starts[0] == starts[1]
    assert starts[0][0] == 4
    assert starts[2] != starts[0]


@pytest.fixture
def windows(monkeypatch):
    """Stand-ins for the windows that are opened."""
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    opened = []

    def open_fake():
        window = SimpleNamespace(times=[], closed=False, close=lambda: setattr(window, "closed", True))
        window.show = lambda world: window.times.append(float(world.data.time))
        opened.append(window)
        return window

    monkeypatch.setattr(gymnasium_environment, "InteractiveViewer", open_fake)
    return opened


@pytest.mark.parametrize("actions", ["continuous", "discrete"])
@pytest.mark.parametrize("observations", [("state",), ("rgb", "depth", "segmentation", "map")])
def test_gymnasium_checks_pass_without_a_warning(easy, actions, observations, windows):
    env = gymnasium.make(ID, actions=actions, observations=observations, **easy)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()
    assert windows and windows[0].closed


def test_gymnasium_checks_pass_where_there_is_no_display(easy, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    env = gymnasium.make(ID, **easy)
    check_env(env.unwrapped)
    env.close()


def test_human_mode_shows_every_control_step(easy, windows):
    env = gymnasium.make(ID, actions="discrete", render_mode="human", **easy)
    env.reset(seed=0)
    env.step(FORWARD)
    times = windows[0].times
    assert times[0] == 0.0 and times[-1] > 0.3
    np.testing.assert_allclose(np.diff(times), 0.04, atol=1e-9)
    env.close()


def test_a_missing_display_is_named(easy, monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    import glfw

    monkeypatch.setattr(glfw, "init", lambda: False)
    with pytest.raises(ViewerError, match="rgb_array"):
        gymnasium.make(ID, render_mode="human", **easy)
    env = gymnasium.make(ID, render_mode="rgb_array", **easy)
    env.reset(seed=0)
    frame = env.render()
    assert frame.shape == (480, 640, 3) and frame.dtype == np.uint8 and frame.std() > 5.0
    env.close()


def test_a_window_needs_its_own_backend(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "egl")
    with pytest.raises(ViewerError, match="MUJOCO_GL=glfw"):
        viewer.InteractiveViewer()


def test_reset_with_a_seed_repeats_the_episode_bit_for_bit():
    env = gymnasium.make(ID, objects=2)
    runs = []
    for disturb in (False, True):
        if disturb:
            env.reset(seed=99)
            env.step(env.action_space.sample())
        seen, info = env.reset(seed=7)
        env.action_space.seed(1)
        log = [*seen.values()]
        for _ in range(25):
            seen, reward, *_ = env.step(env.action_space.sample())
            log += [*seen.values(), np.array(reward)]
        _, later = env.reset()
        runs.append((info["episode_seed"], later["episode_seed"], [x.tobytes() for x in log]))
    env.close()
    assert runs[0] == runs[1]
    assert runs[0][0] == 7 != runs[0][1]


@pytest.mark.slow
@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_of_an_environment_continues_as_the_original_does(easy, duplicate):
    env = gymnasium.make(ID, **easy)
    assert duplicate(env).reset(seed=0)[1] == env.reset(seed=0)[1]
    actions = np.random.default_rng(0).uniform(-1, 1, (12, 4))
    for action in actions[:6]:  # a pick is under way by then
        env.step(action)
    other = duplicate(env)
    for action in actions[6:]:
        (one, *outcome), (two, *same) = env.step(action), other.step(action)
        assert outcome == same
        assert {k: v.tobytes() for k, v in one.items()} == {k: v.tobytes() for k, v in two.items()}
    assert env.unwrapped.core.world.state_hash() == other.unwrapped.core.world.state_hash()
    dm = mjsim.make(actions="discrete", **easy)
    dm.reset()
    dm.step(FORWARD)
    assert duplicate(dm).step(PICK).observation["gps"].tolist() == dm.step(PICK).observation["gps"].tolist()


@pytest.mark.slow
def test_vectors_agree(easy):
    """The second of two environments in this process does as one in another process, with the next seed."""
    logs, plans = [], np.array([[FORWARD, PICK], [PICK, PLACE], [PLACE, FORWARD]])
    for mode, extra, number in (("sync", {}, 2), ("async", {"context": "spawn"}, 1)):
        envs = gymnasium.make_vec(
            ID, num_envs=number, vectorization_mode=mode, vector_kwargs=extra, actions="discrete", **easy
        )
        seen, _ = envs.reset(seed=5 - number)
        log = [seen]
        for actions in plans[:, 2 - number :]:
            seen, rewards, ended, cut, _ = envs.step(actions)
            log.append({**seen, "reward": rewards, "ended": ended, "cut": cut})
        envs.close()
        logs.append(log)
    assert logs[0][0]["goals"].shape == (2, 1, 2)
    assert [bool(step["ended"][1]) for step in logs[0][1:]] == [False, True, False]
    for one, other in zip(*logs, strict=True):
        assert one.keys() == other.keys()
        for name in one:
            np.testing.assert_array_equal(one[name][1:], other[name], err_msg=name)


def test_info_tells_what_happened(easy):
    env = gymnasium.make(ID, actions="discrete", **easy)
    env.reset(seed=0)
    *_, refused = env.step(PLACE)
    assert env.unwrapped.core.state.time == pytest.approx(0.04), "nothing to wait for"
    *_, picked = env.step(PICK)
    *_, terminated, _, placed = env.step(PLACE)
    env.close()
    assert refused["refusal"] == "hands_empty" and refused["picked"] == 0
    assert (picked["refusal"], picked["picked"], picked["is_success"]) == ("", 1, False)
    assert terminated and placed["placed"] == placed["delivered"] == 1 and placed["is_success"]


def test_steps_out_of_turn_are_refused(easy):
    env = gymnasium.make(ID, actions="discrete", disable_env_checker=True, **easy).unwrapped
    with pytest.raises(EnvironmentStateError, match="reset"):
        env.step(PICK)
    env.reset(seed=0)
    env.step(PICK)
    assert env.step(PLACE)[2]
    with pytest.raises(EnvironmentStateError, match="over"):
        env.step(FORWARD)
    env.close()


def test_an_unusable_action_changes_nothing(easy):
    env = gymnasium.make(ID, disable_env_checker=True, **easy).unwrapped
    env.reset(seed=0)
    for wrong in ([0.0, 0.0, 0.0], [math.nan, 0.0, 0.0, 0.0], "forward"):
        with pytest.raises((ActionError, ValueError)):
            env.step(wrong)
    assert env.core.state.time == 0.0
    env.step([0.0, 0.0, 0.0, 0.0])
    assert env.core.state.time == pytest.approx(0.04)
    env.close()


def test_failed_physics_ends_the_episode(easy, monkeypatch):
    """No step is taken from a state that cannot be trusted; a reset makes all well."""
    env = mjsim.make(seed=0, **easy)
    env.reset()

    def fail(*_):
        raise PhysicsError("as if MuJoCo had warned")

    with monkeypatch.context() as broken:
        broken.setattr(World, "step", fail)
        with pytest.raises(PhysicsError):
            env.step(np.zeros(4))
    assert env.step(np.zeros(4)).first()
    env.close()


def test_a_navigable_floor_that_is_none_is_named():
    with pytest.raises(EnvironmentConfigError, match="navigable returned 5"):
        gymnasium.make(ID, navigable=lambda *_: 5)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"objets": 3}, "objets"),
        ({"objects": 0}, "objects"),
        ({"objects": (5, 2)}, "objects"),
        ({"objects": "six"}, "objects must be a whole number"),
        ({"objects": (1, 2, 3)}, "objects must be a whole number"),
        ({"objects": 1.5}, "objects must be a whole number"),
        ({"time_limit": "long"}, "time_limit"),
        ({"observations": ("state", "smell")}, "smell"),
        ({"observations": ()}, "empty"),
        ({"actions": "telepathy"}, "telepathy"),
        ({"reward": "fame"}, "fame"),
        ({"time_limit": 0.0}, "time_limit"),
        ({"episodes": 0}, "episodes"),
        ({"episodes": "x"}, "episodes must be None, a number or Episodes; got 'x'"),
        ({"keep": ()}, "keep numbers or None"),
        ({"world": "event"}, "world must be WorldOptions"),
        ({"person": None}, "person must be PersonParameters"),
        ({"camera": {}}, "camera must be CameraOptions"),
        ({"reward": 5}, "reward must be a name or a function"),
        ({"actions": 5}, "actions must be a name or a Control"),
        ({"observations": 5}, "observations must be"),
        ({"house": 5}, "house must be a name"),
        ({"navigable": "x"}, "navigable must be None or a function"),
        ({"episodes": ()}, "episodes"),
        ({"objects": 6, "slots": 4}, "slots"),
        ({"objects": 10**9}, "a house has 40 points"),
        ({"slots": 10**9}, "at most 1000"),
        ({"keep": 0}, "keep"),
        ({"physics_errors": "ignore"}, "physics_errors"),
        ({"render_mode": "ansi"}, "ansi"),
    ],
)
def test_unusable_options_are_named(given, said):
    with pytest.raises(EnvironmentConfigError, match=said):
        gymnasium_environment.RearrangeEnv(**given)


def test_unknown_reset_options_are_refused(easy):
    env = gymnasium.make(ID, **easy)
    with pytest.raises(EnvironmentConfigError, match="weather"):
        env.reset(options={"weather": "rain"})
    env.close()


def test_a_sensor_without_bounds_has_no_space():
    with pytest.raises(EnvironmentConfigError, match="bounds"):
        gymnasium_environment.to_space(specs.Array((2,), np.float32, name="endless"))
