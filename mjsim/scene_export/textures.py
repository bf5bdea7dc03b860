"""Textures of a model as WebP files."""

from typing import Any

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

_QUALITY = 90
_LOSSLESS = 101  # of OpenCV's parameter


def pixels(model: Any, texture: int) -> NDArray[np.uint8]:
    """The image of a texture, uint8, (height, width, channels); six faces below each other for cubes and skies."""
    shape = (
        int(model.tex_height[texture]),
        int(model.tex_width[texture]),
        int(model.tex_nchannel[texture]),
    )
    first = int(model.tex_adr[texture])
    image: NDArray[np.uint8] = model.tex_data[first : first + int(np.prod(shape))].reshape(shape)
    return image


def name_of(model: Any, texture: int) -> str:
    """The name of a texture."""
    return str(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXTURE, texture) or f"texture {texture}")


def webp(image: NDArray[np.uint8], *, alpha: bool = False, lossless: bool = False) -> bytes:
    """Encode RGB or RGBA; the alpha of RGBA is left out unless `alpha`."""
    keep = alpha and image.shape[2] == 4
    conversion = cv2.COLOR_RGBA2BGRA if keep else cv2.COLOR_RGB2BGR
    bgr = cv2.cvtColor(np.ascontiguousarray(image if keep else image[..., :3]), conversion)
    quality = _LOSSLESS if lossless else _QUALITY
    _, encoded = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, quality])
    return encoded.tobytes()
