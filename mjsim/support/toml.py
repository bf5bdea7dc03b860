"""Read TOML files."""

import re
import tomllib
from pathlib import Path
from typing import Any

from mjsim.support.files import read_bytes

# Maximum number of dots in a key. The time that `tomllib` takes for a key grows with the square of this number.
MAX_DOTS = 100
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MAX_DOTS + 1}}}")


class TomlError(ValueError):
    """Raised if a text is not TOML. The message gives the reason and the line, but not the name of the file."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file. Raise an OSError or a TomlError if that fails."""
    return decode_toml(read_bytes(path))


def decode_toml(content: bytes) -> dict[str, Any]:
    """Parse the content of a TOML file, which may begin with a byte order mark."""
    try:
        return parse_toml(content.decode("utf-8-sig").replace("\r\n", "\n"))
    except UnicodeDecodeError as error:
        raise TomlError(f"byte {error.start} is not UTF-8; save the file as UTF-8") from error


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a TOML document. Raise a TomlError if it is not valid, or nested too deep."""
    if _LONG_KEY.search(text):
        raise TomlError(f"a key has more than {MAX_DOTS} dots")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise TomlError("tables or lists are nested too deep") from None
    except ValueError as error:  # includes numbers with too many digits
        raise TomlError(str(error)) from error
