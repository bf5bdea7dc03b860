"""Golden frames, which are stored images that tests compare with rendered frames.

The file `name.json` next to `name.png` contains a SHA-256 hash of the frame for each known OpenGL driver. On
a known driver, all pixels must be equal. On other drivers, the PSNR must exceed a limit.
"""

import hashlib
import json
import os
import platform
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from mjsim.render import gl_info
from mjsim.support.files import replacing
from mjsim.values.errors import MjsimError

UPDATE_VARIABLE = "MJSIM_UPDATE_GOLDEN"
CLOSE_ENOUGH = 45.0  # default minimum PSNR in dB
_GAIN = 4  # contrast factor of difference images

Image = NDArray[np.uint8]


class FrameMismatchError(MjsimError, AssertionError):
    """Raised if a frame differs from its golden frame, or if the golden frame is missing."""


@dataclass(frozen=True)
class Comparison:
    """The result of comparing a frame with its golden frame.

    Attributes:
        exact: True if all pixels are equal.
        known_driver: True if a hash is stored for this driver.
        psnr: Peak signal-to-noise ratio in dB, which is inf if all pixels are equal.
        updated: True if the frame was stored as the golden frame.
    """

    exact: bool
    known_driver: bool
    psnr: float
    updated: bool = False


def compare_frame(
    frame: Image,
    golden: str | Path,
    *,
    key: str | None = None,
    update: bool | None = None,
    output: str | Path | None = None,
    close_enough: float = CLOSE_ENOUGH,
) -> Comparison:
    """Compare a frame with a golden frame.

    Args:
        frame: RGB image, uint8, shape (height, width, 3).
        golden: Path of the golden frame, a PNG file. Its hashes are stored next to it as JSON.
        key: Identifier of the driver and libraries that drew the frame. The default is `driver_key()`. Use
            `drawing_key()` for frames that were drawn without OpenGL.
        update: True to store the frame as the golden frame. By default, True if the environment variable
            `MJSIM_UPDATE_GOLDEN` is set and not 0. Review stored frames before you commit them.
        output: Folder for the actual, expected and difference images of a failure, by default a temporary
            one.
        close_enough: Minimum PSNR in dB if no hash is stored for `key`.

    Raises:
        FrameMismatchError: The frame differs, or the golden frame is missing. The message lists the images.
        RenderError: `key` is None, and no OpenGL context can be created.
    """
    if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3:
        raise FrameMismatchError(
            f"a frame must be uint8 (height, width, 3), got {frame.dtype} {frame.shape}; golden frames are RGB"
        )
    path = Path(golden)
    key = driver_key() if key is None else key
    if update is None:
        update = os.environ.get(UPDATE_VARIABLE, "0") not in ("", "0")
    if update:
        _store(frame, path, key)
        return Comparison(True, True, float("inf"), updated=True)
    folder = Path(tempfile.mkdtemp(prefix="frames-")) if output is None else Path(output)
    if not path.is_file():
        actual = _write(folder / f"{path.stem}.actual.png", frame)
        raise FrameMismatchError(
            f"no golden frame {path}; look at {actual} and store it with {UPDATE_VARIABLE}=1"
        )
    expected = _read(path)
    known = _hashes(path).get(key)
    exact = known == _digest(frame) if known is not None else np.array_equal(frame, expected)
    ratio = float("inf") if exact else psnr(frame, expected)
    if not exact and (known is not None or ratio <= close_enough):
        raise FrameMismatchError(_report(frame, expected, path, folder, key, known is not None, ratio))
    return Comparison(exact, known is not None, ratio)


def driver_key() -> str:
    """Return an identifier of the OpenGL driver, OpenCV and the CPU, which affect the pixels of a frame."""
    gl = gl_info()
    return f"{gl.renderer} | {gl.version} | {drawing_key()}"


def drawing_key() -> str:
    """Return an identifier of OpenCV and the CPU, which affect the rounding of drawn text and images."""
    return f"OpenCV {cv2.__version__} | {platform.machine()} {cv2.getCPUFeaturesLine()}"


def psnr(a: Image, b: Image) -> float:
    """Return the peak signal-to-noise ratio of two images in dB, or -inf if their shapes differ."""
    if a.shape != b.shape:
        return float("-inf")
    return float("inf") if np.array_equal(a, b) else cv2.PSNR(a, b)


def difference_image(a: Image, b: Image) -> Image:
    """Return the absolute difference of two images with the same shape, multiplied by four."""
    return np.asarray(cv2.convertScaleAbs(cv2.absdiff(a, b), alpha=_GAIN), dtype=np.uint8)


def _report(
    frame: Image, expected: Image, path: Path, folder: Path, key: str, known: bool, ratio: float
) -> str:
    written = [
        _write(folder / f"{path.stem}.actual.png", frame),
        _write(folder / f"{path.stem}.expected.png", expected),
    ]
    if frame.shape == expected.shape:
        written.append(_write(folder / f"{path.stem}.difference.png", difference_image(frame, expected)))
        apart = cv2.absdiff(frame, expected).max(axis=2)
        what = f"{int((apart > 0).sum())} pixels differ by up to {int(apart.max())}, PSNR {ratio:.1f} dB"
    else:
        what = f"its shape is {frame.shape} instead of {expected.shape}"
    rule = "every pixel must be the same on this driver" if known else f"{CLOSE_ENOUGH:g} dB are asked for"
    return (
        f"frame {path.name} has changed: {what} ({rule}: {key}). Look at {', '.join(map(str, written))}. "
        f"If the change is meant, store it with {UPDATE_VARIABLE}=1"
    )


def _digest(frame: Image) -> str:
    return hashlib.sha256(repr(frame.shape).encode() + np.ascontiguousarray(frame).tobytes()).hexdigest()


def _hashes(golden: Path) -> Mapping[str, str]:
    path = golden.with_suffix(".json")
    if not path.is_file():
        return {}
    stored: dict[str, str] = json.loads(path.read_text(encoding="utf-8"))
    return stored


def _store(frame: Image, path: Path, key: str) -> None:
    # If the image has changed, the hashes of other drivers are no longer valid.
    same = path.is_file() and np.array_equal(_read(path), frame)
    hashes = {**(_hashes(path) if same else {}), key: _digest(frame)}
    if not same:
        _write(path, frame)
    with replacing(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(hashes, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _read(path: Path) -> Image:
    image = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    if image is None:
        raise FrameMismatchError(f"cannot read the image {path}; store it again with {UPDATE_VARIABLE}=1")
    return np.asarray(image, dtype=np.uint8)


def _write(path: Path, frame: Image) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(frame, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    return path
