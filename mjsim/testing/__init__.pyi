from .fixtures import golden_frame
from .frames import (
    Comparison,
    FrameMismatchError,
    compare_frame,
    difference_image,
    drawing_key,
    driver_key,
    psnr,
)

__all__ = [
    "Comparison",
    "FrameMismatchError",
    "compare_frame",
    "difference_image",
    "drawing_key",
    "driver_key",
    "golden_frame",
    "psnr",
]
