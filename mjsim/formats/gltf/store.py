"""Paths of scene files on disk. They are separate from the writers so that servers import them quickly."""

from pathlib import Path

from mjsim.support.kernels import cache_base

GZIP = ".gz"
SCENE = "scene.json"  # file that lists the others


def scenes_folder() -> Path:
    """Return the folder of all scenes. It is in `NUMBA_CACHE_DIR` if set, otherwise in the user's cache folder."""
    return cache_base() / "scenes"
