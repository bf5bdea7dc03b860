"""Pytest fixtures, to be imported into a `conftest.py`. Only this module needs pytest."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mjsim.testing.frames import Comparison, compare_frame

GoldenFrame = Callable[..., Comparison]


@pytest.fixture
def golden_frame(request: pytest.FixtureRequest, tmp_path: Path) -> GoldenFrame:
    """Compare frames with `golden/<name>.png` in the folder of the test file, or in the nearest one above it.

    `golden_frame(frame)` uses the name of the test, `golden_frame(frame, "hall")` another one. Keyword arguments are
    those of `mjsim.testing.compare_frame`. Images of a failed comparison are written to `tmp_path`.
    """

    def compare(frame: NDArray[np.uint8], name: str | None = None, **options: object) -> Comparison:
        stem = name or re.sub(r"[^\w.-]+", "_", request.node.name).strip("_")
        parents = [parent / "golden" for parent in request.path.parents]
        folder = next((golden for golden in parents if golden.is_dir()), parents[0])
        return compare_frame(frame, folder / f"{stem}.png", **{"output": tmp_path, **options})  # type: ignore[arg-type]

    return compare
