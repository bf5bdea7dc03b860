"""Pytest fixtures that can be imported in a `conftest.py` file."""

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
    """Return a function that compares a frame with the golden image `golden/<name>.png`.

    The folder `golden` is next to the test file or in a parent folder. `golden_frame(frame)` uses the name of
    the test, and `golden_frame(frame, "hall")` uses the name `hall`. Keyword arguments are passed to
    `mjsim.testing.compare_frame`. Images of a failed comparison are written to `tmp_path`.
    """

    def compare(frame: NDArray[np.uint8], name: str | None = None, **options: object) -> Comparison:
        stem = name or re.sub(r"[^\w.-]+", "_", request.node.name).strip("_")
        parents = [parent / "golden" for parent in request.path.parents]
        folder = next((golden for golden in parents if golden.is_dir()), parents[0])
        return compare_frame(frame, folder / f"{stem}.png", **{"output": tmp_path, **options})  # type: ignore[arg-type]

    return compare
