"""Where scene files lie on disk, for those who serve them; light to import."""

from pathlib import Path

from mjsim.support.kernels import cache_base

GZIP = ".gz"  # ending of files that are stored compressed
SCENE = "scene.json"  # the file that names the others


def scenes_folder() -> Path:
    """Folder of all scenes: in `NUMBA_CACHE_DIR`, else in the user's cache folder."""
    return cache_base() / "scenes"
