"""Paths of scene files on disk. This module is separate from the writers so that its import is fast."""

from pathlib import Path

from mjsim.support.kernels import cache_base

GZIP = ".gz"
SCENE = "scene.json"  # JSON file that describes the other files


def scenes_folder() -> Path:
    """Return the folder of all scenes, which is in `NUMBA_CACHE_DIR` or in the user's cache folder."""
    return cache_base() / "scenes"
