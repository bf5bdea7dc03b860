"""The rearrangement environment with the Gymnasium interface."""

from typing import Any, cast

import gymnasium
import numpy as np
from dm_env import specs
from gymnasium import spaces
from numpy.typing import NDArray

from mjsim.environments.control import Continuous
from mjsim.environments.core import ObservationDict
from mjsim.environments.options import build, parse_options
from mjsim.environments.viewer import InteractiveViewer, can_open_window
from mjsim.values.errors import EnvironmentConfigError

RENDER_SIZE = (640, 480)  # width and height of rendered images, in pixels


class RearrangeEnv(gymnasium.Env[ObservationDict, Any]):
    """The rearrangement task as a Gymnasium environment.

    It is created by `gymnasium.make("mjsim.environments:mjsim/Rearrange-v0", objects=6)`. `reset(seed=s)`
    starts the episode with seed s, which `mjsim house --seed s` writes to a file. It also seeds the generator
    for later episodes.

    Args:
        render_mode: None, `rgb_array` for the first-person view, or `human` for dm_control's viewer.
        **options: Fields of `mjsim.environments.EnvironmentOptions`.

    Raises:
        EnvironmentConfigError: An option is unknown or invalid.
        AssetError: The house is malformed.
        ViewerError: The render mode is `human`, but no window can be opened.
    """

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 25}  # noqa: RUF012 - Gymnasium's own name

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise EnvironmentConfigError(f"no render mode {render_mode!r}; choose from {modes} or None")
        parsed = parse_options(options)
        self.core = build(parsed)
        self.render_mode = render_mode
        repeat = self.core.control.repeat if isinstance(self.core.control, Continuous) else 1
        fps = max(1, round(1 / (parsed.world.control_timestep * repeat)))
        # Environment checkers try every mode in this list.
        shown = [mode for mode in modes if mode != "human" or can_open_window()]
        self.metadata = {**self.metadata, "render_modes": shown, "render_fps": fps}
        arrays = {name: to_space(spec) for name, spec in self.core.observation_spec.items()}
        self.observation_space = cast("spaces.Space[ObservationDict]", spaces.Dict(arrays))
        self.action_space = to_space(self.core.action_spec)
        self._viewer = InteractiveViewer() if render_mode == "human" else None
        if self._viewer is not None:
            self.core.on_control_step = self._viewer.show

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObservationDict, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seed of the episode, which also seeds the generator for later episodes. Random by default.
            options: Must be empty.

        Raises:
            EnvironmentConfigError: `options` is not empty.
            ViewerError: The viewer is closed.
        """
        super().reset(seed=seed)
        if options:
            raise EnvironmentConfigError(f"reset has no option {sorted(options)[0]!r}; it has no options")
        first = self.core.reset_random(self.np_random) if seed is None else self.core.reset(seed)
        if self._viewer is not None:
            self._viewer.show(self.core.world)
        return first

    def step(self, action: Any) -> tuple[ObservationDict, float, bool, bool, dict[str, Any]]:
        """Execute an action.

        Raises:
            EnvironmentStateError: The episode is over or has not started.
            ActionError: The action does not conform to its space.
            PhysicsError: MuJoCo issued a warning. The episode is over.
        """
        taken = self.core.step(action)
        return taken.observation, taken.reward, taken.terminated, taken.truncated, taken.info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the first-person view, shape (480, 640, 3), or update the window in `human` mode.

        Raises:
            RenderError: No OpenGL context can be created.
            ViewerError: The viewer is closed.
        """
        if self._viewer is not None:
            self._viewer.show(self.core.world)
            return None
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render needs a render mode; make the environment with render_mode='rgb_array'"
            )
            return None
        return self.core.rgb(*RENDER_SIZE, self.core.layout.camera.profile)

    def close(self) -> None:
        if self._viewer is not None:
            self._viewer.close()
        self.core.close()


def to_space(spec: specs.Array) -> spaces.Space[Any]:
    """Convert a dm_env spec to a Gymnasium space. Raise an EnvironmentConfigError if it is unbounded."""
    if isinstance(spec, specs.DiscreteArray):
        return spaces.Discrete(spec.num_values)
    if isinstance(spec, specs.BoundedArray):
        low = np.broadcast_to(spec.minimum, spec.shape).astype(spec.dtype)
        high = np.broadcast_to(spec.maximum, spec.shape).astype(spec.dtype)
        return spaces.Box(low, high, spec.shape, spec.dtype.type)
    raise EnvironmentConfigError(f"sensor {spec.name!r} declares no bounds; give it a BoundedArray")
