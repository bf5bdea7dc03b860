"""Comparison of rendered frames with stored ones, for tests of this project and of others (docs/hud.md)."""

from typing import TYPE_CHECKING

from mjsim.support.lazy_names import lazy_names
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
    "golden_frame",
    "psnr",
]

if TYPE_CHECKING:  # needs pytest
    from mjsim.testing.fixtures import golden_frame
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(__name__, {"fixtures": ("golden_frame",)})
