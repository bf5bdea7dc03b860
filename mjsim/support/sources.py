"""One hash of the source code, by which files that were made from it are kept apart."""

import functools
import hashlib
from pathlib import Path

ROOT = Path(__file__).parents[2]  # folder of the packages
PACKAGES = ("experiments", "hud", "mjsim", "planner")


@functools.cache
def source_digest(*places: str) -> str:
    """16 hex digits over Python sources, given by modules and folders in that of the packages; all if none is given."""
    return digest_of(*(ROOT / place for place in places or PACKAGES))


def digest_of(*places: Path) -> str:
    """16 hex digits over Python files and the names under which they lie in `places`, which are files or folders."""
    digest = hashlib.sha256()
    for place in places:
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(place.parent).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]
