"""Textures of a model as WebP files."""

from typing import Any

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

_QUALITY = 90
_LOSSLESS = 101  # of OpenCV's parameter


def pixels(model: Any, texture: int) -> NDArray[np.uint8]:
    """The image of a texture, uint8, (height, width, channels).

    Of cubes and skies it holds six faces below each other, or one that shows on all sides.
    """
    shape = (
        int(model.tex_height[texture]),
        int(model.tex_width[texture]),
        int(model.tex_nchannel[texture]),
    )
    first = int(model.tex_adr[texture])
    image: NDArray[np.uint8] = model.tex_data[first : first + int(np.prod(shape))].reshape(shape)
    return image


class Images:
    """The textures of a model as WebP, each encoded once."""

    def __init__(self, model: Any) -> None:
        self._model = model
        self._encoded: dict[tuple[int, bool], tuple[str, bytes]] = {}

    def __call__(self, texture: int, alpha: bool) -> tuple[str, bytes]:
        """Name and WebP file of a texture, with or without its alpha."""
        key = (texture, alpha)
        if key not in self._encoded:
            name = mujoco.mj_id2name(self._model, mujoco.mjtObj.mjOBJ_TEXTURE, texture)
            encoded = webp(pixels(self._model, texture), alpha=alpha)
            self._encoded[key] = str(name or f"texture {texture}"), encoded
        return self._encoded[key]


def webp(image: NDArray[np.uint8], *, alpha: bool = False, lossless: bool = False) -> bytes:
    """Encode RGB or RGBA; the alpha of RGBA is left out unless `alpha`."""
    keep = alpha and image.shape[2] == 4
    conversion = cv2.COLOR_RGBA2BGRA if keep else cv2.COLOR_RGB2BGR
    bgr = cv2.cvtColor(np.ascontiguousarray(image if keep else image[..., :3]), conversion)
    quality = _LOSSLESS if lossless else _QUALITY
    _, encoded = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, quality])
    return encoded.tobytes()
