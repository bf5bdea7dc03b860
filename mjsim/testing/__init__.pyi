from .fixtures import golden_frame as golden_frame
from .frames import (
    Comparison as Comparison,
    FrameMismatchError as FrameMismatchError,
    compare_frame as compare_frame,
    difference_image as difference_image,
    drawing_key as drawing_key,
    driver_key as driver_key,
    psnr as psnr,
)
