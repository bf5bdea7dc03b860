"""The line of a TOML file that an error is about."""

import re
from pathlib import Path

_PATH = re.compile(r"`\$\.?([\w.\[\]-]*)`")
_HEADER = re.compile(r"\s*\[\[?\s*([\w.\"-]+)\s*\]\]?")
_KEY = re.compile(r"\s*([\w.\"-]+)\s*=")


def at_line(path: Path, text: str, message: str) -> str:
    """A message of msgspec about a value, with file and line where they can be told."""
    found = _PATH.search(message)
    wanted = re.sub(r"\[[^\]]*\]", "", found[1]) if found else ""
    if unknown := re.search(r"unknown field `([^`]+)`", message):
        wanted = f"{wanted}.{unknown[1]}".strip(".")
    line = line_of(text, wanted)
    return f"{path}, line {line}: {message}" if line else f"{path}: {message}"


def line_of(text: str, wanted: str) -> int | None:
    """The line of a key such as `study.pay.reward`, or of the innermost table around it that the file names."""
    table, best, depth = "", None, 0
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            table = name = header[1].replace('"', "")
        elif key := _KEY.match(line):
            name = f"{table}.{key[1]}".strip(".").replace('"', "")
        else:
            continue
        if f"{wanted}.".startswith(f"{name}.") and name.count(".") + 1 > depth:
            best, depth = number, name.count(".") + 1
    return best
