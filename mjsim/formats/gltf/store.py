"""Location and names of scene files on disk, apart from their writers so that servers import quickly."""

from pathlib import Path

from mjsim.support.kernels import cache_base

GZIP = ".gz"  # suffix of compressed files
SCENE = "scene.json"  # names the other files


def scenes_folder() -> Path:
    """Folder of all scenes: in `NUMBA_CACHE_DIR` if set, else in the user's cache folder."""
    return cache_base() / "scenes"
