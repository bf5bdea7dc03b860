"""Comparison of rendered frames with stored ones, for tests of this project and of others (docs/hud.md)."""

from mjsim.testing.frames import (
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
    "psnr",
]
