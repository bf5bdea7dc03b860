"""The client's modules: which ones a page needs, and their imports."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path

STATIC = Path(__file__).parent / "client" / "static"
_IMPORT = re.compile(r"(\bfrom\s*|\bimport\s*)\"(\.{1,2}/[^\"]+)\"")


def modules_of(entry: str) -> Mapping[str, str]:
    """Sources of the module `entry` and of all that it imports, by their paths; imports name those paths."""
    found: dict[str, str] = {}
    waiting = [entry]
    while waiting:
        path = waiting.pop()
        if path not in found:
            needs: list[str] = []
            found[path] = _IMPORT.sub(_named_from(path, needs), (STATIC / path).read_text("utf-8"))
            waiting += needs
    return found


def _named_from(path: str, needs: list[str]) -> Callable[[re.Match[str]], str]:
    """Replaces relative imports of the module at `path` by paths, and appends these to `needs`."""

    def named(match: re.Match[str]) -> str:
        target = ((STATIC / path).parent / match[2]).resolve()
        needs.append(target.relative_to(STATIC.resolve()).as_posix())
        return f'{match[1]}"{needs[-1]}"'

    return named
