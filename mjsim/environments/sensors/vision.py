"""Sensors for first-person images and for the objects in view."""

from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.sensors.base import ObservationLayout, Sensor, SensorInput, unit_spec
from mjsim.house.sight.sight import visible_objects
from mjsim.values.errors import EnvironmentConfigError

# Segmentation labels: -1 is the background, 0 the house, 1 the person. Receptacles and objects follow.
MIN_LABEL = -1
FIRST_RECEPTACLE = 2


def first_object(layout: ObservationLayout) -> int:
    """Return the segmentation label of the first object, which is the same in every episode."""
    return FIRST_RECEPTACLE + len(layout.receptacles)


def visible_pixels(inputs: SensorInput) -> dict[str, int]:
    counts = inputs.episode.labels.pixel_counts(_rendered(inputs.frame.segmentation, "segmentation"))
    return {name: counts[name] for name in inputs.state.object_names if name in counts}


def _image_spec(
    layout: ObservationLayout, dtype: type, low: float, high: float, *channels: int
) -> specs.BoundedArray:
    return specs.BoundedArray((layout.camera.height, layout.camera.width, *channels), dtype, low, high)


def _rgb(inputs: SensorInput) -> NDArray[np.uint8]:
    return _rendered(inputs.frame.rgb, "rgb").copy()


def _depth(inputs: SensorInput) -> NDArray[np.float32]:
    image = _rendered(inputs.frame.depth, "depth")
    return np.asarray(np.minimum(image, np.float32(inputs.layout.camera.far)))


def _segmentation(inputs: SensorInput) -> NDArray[np.int32]:
    return inputs.episode.labels.instance_map(_rendered(inputs.frame.segmentation, "segmentation"))


def _rendered(image: NDArray[Any] | None, channel: str) -> NDArray[Any]:
    if image is None:
        raise EnvironmentConfigError(f"{channel!r} was not rendered; name it in the sensor's images")
    return image


def _pixels(inputs: SensorInput) -> NDArray[np.int32]:
    slots, first = inputs.layout.slots, first_object(inputs.layout)
    labels = _segmentation(inputs).ravel()
    counts = np.bincount(labels[labels >= 0], minlength=first + slots)
    return counts[first : first + slots].astype(np.int32)


def _in_view(inputs: SensorInput) -> NDArray[np.float32]:
    state, world = inputs.state, inputs.world
    names = visible_objects(world.scene, world.data, state.eye, state.heading, state.pitch)
    flags = np.zeros(inputs.layout.slots, np.float32)
    flags[[state.object_names.index(n) for n in names]] = 1.0
    return flags


RGB = Sensor("rgb", lambda layout: _image_spec(layout, np.uint8, 0, 255, 3), _rgb, frozenset({"rgb"}))
DEPTH = Sensor(
    "depth",
    lambda layout: _image_spec(layout, np.float32, 0.0, layout.camera.far),
    _depth,
    frozenset({"depth"}),
)
SEGMENTATION = Sensor(
    "segmentation",
    lambda layout: _image_spec(layout, np.int32, MIN_LABEL, first_object(layout) + layout.slots - 1),
    _segmentation,
    frozenset({"segmentation"}),
)
VISIBLE_PIXELS = Sensor(
    "visible_pixels",
    lambda layout: specs.BoundedArray(
        (layout.slots,), np.int32, 0, layout.camera.width * layout.camera.height
    ),
    _pixels,
    frozenset({"segmentation"}),
)
IN_VIEW = Sensor("in_view", lambda layout: unit_spec(layout.slots, low=0.0), _in_view)
