"""Read and format TOML files, and find the line numbers of their keys."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from mjsim.support.files import read_bytes

# Maximum number of dots in a key. The time that `tomllib` takes for a key grows with the square of this number.
MAX_DOTS = 100
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MAX_DOTS + 1}}}")
_NAME = r"""((?:[\w.-]|"[^"\n]*")+)"""
_HEADER = re.compile(rf"\s*\[(\[?)\s*{_NAME}\s*\]")
_KEY = re.compile(rf"\s*{_NAME}\s*=")


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


def line_of(text: str, *keys: str) -> int | None:
    """Return the line number of the first of some keys, or of the innermost table that should contain one of them.

    Keys are written like `study.pay.reward` or `cells[0].objects`. Return None if no table of the keys exists.
    """
    lines = dict(reversed(list(_key_lines(text))))
    while any(keys):
        if found := [lines[key] for key in keys if key in lines]:
            return found[0]
        keys = tuple(key[: max(key.rfind("."), key.rfind("["), 0)] for key in keys)
    return None


def toml_tables(tables: Mapping[str, Mapping[str, object]]) -> str:
    """Format named tables as TOML. Their values are texts, whole numbers, and lists of these."""
    lines = []
    for name, table in tables.items():
        values = (f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in table.items())
        lines += [f"[{name}]", *values, ""]
    return "\n".join(lines)


def joined_key(table: str, key: str) -> str:
    """Return the full name of a key in a table. If the key is empty, return the name of the table."""
    return f"{table}{'' if key.startswith('[') else '.'}{key}".strip(".") if key else table


def _key_lines(text: str) -> Iterator[tuple[str, int]]:
    table, counts = "", dict[str, int]()
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            table = header[2].replace('"', "")
            if header[1]:
                counts[table] = counts.get(table, -1) + 1
            for name, index in counts.items():
                if f"{table}.".startswith(f"{name}."):
                    table = f"{name}[{index}]{table[len(name) :]}"
            yield table, number
        elif key := _KEY.match(line):
            yield joined_key(table, key[1].replace('"', "")), number
