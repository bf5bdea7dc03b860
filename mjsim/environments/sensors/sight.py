"""What the person sees: images from the eye, and which objects are in them."""

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.errors import EnvironmentConfigError
from mjsim.environments.layout import Layout
from mjsim.environments.sensors.base import Moment, Sensor, unit_spec
from mjsim.visibility import visible_objects

# Numbers of `mjsim.render.Labels`: background -1, house 0, person 1, then receptacles, then the objects by slot.
LOWEST = -1
FIRST_RECEPTACLE = 2


def first_object(layout: Layout) -> int:
    """Number of the object in slot 0 in a segmentation, the same in every episode."""
    return FIRST_RECEPTACLE + len(layout.receptacles)


def visible_pixels(moment: Moment) -> dict[str, int]:
    """Instance name -> how many pixels of it the eye sees, in the episode's order; hidden ones are left out."""
    counts = _pixels(moment)
    return {n: int(c) for n, c in zip(moment.observation.object_names, counts, strict=False) if c}


def _image_spec(layout: Layout, dtype: type, low: float, high: float, *depth: int) -> specs.BoundedArray:
    return specs.BoundedArray((layout.camera.height, layout.camera.width, *depth), dtype, low, high)


def _rgb(moment: Moment) -> NDArray[np.uint8]:
    image = moment.frame().rgb
    if image is None:
        raise _undrawn("rgb")
    return image.copy()


def _depth(moment: Moment) -> NDArray[np.float32]:
    image = moment.frame().depth
    if image is None:
        raise _undrawn("depth")
    return np.minimum(image, np.float32(moment.layout.camera.far))


def _segmentation(moment: Moment) -> NDArray[np.int32]:
    ids = moment.frame().segmentation
    if ids is None:
        raise _undrawn("segmentation")
    return moment.labels().instance_map(ids)


def _undrawn(channel: str) -> EnvironmentConfigError:
    return EnvironmentConfigError(f"{channel!r} was not drawn; name it in the sensor's images")


def _pixels(moment: Moment) -> NDArray[np.int32]:
    slots, first = moment.layout.slots, first_object(moment.layout)
    numbers = _segmentation(moment).ravel()
    counts = np.bincount(numbers[numbers >= 0], minlength=first + slots)
    return counts[first : first + slots].astype(np.int32)


def _in_view(moment: Moment) -> NDArray[np.float32]:
    seen, world = moment.observation, moment.world
    names = visible_objects(world.scene, world.data, seen.eye, seen.heading, seen.pitch)
    flags = np.zeros(moment.layout.slots, np.float32)
    flags[[seen.object_names.index(n) for n in names]] = 1.0
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
    lambda layout: _image_spec(layout, np.int32, LOWEST, first_object(layout) + layout.slots - 1),
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
