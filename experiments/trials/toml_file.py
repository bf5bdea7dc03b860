"""Read TOML files, and describe their faults by line, key, value and choices."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from msgspec import inspect

from experiments.errors import ConfigError, shown
from mjsim.support.files import read_bytes
from mjsim.support.toml import TomlError, decode_toml, joined_key, line_of

_AT = re.compile(r" - at `(?:key` in `)?\$\.?([^`]*)`$")  # the path in an error message of msgspec
_UNKNOWN = re.compile(r"unknown field `([^`]+)`")
_WORD = re.compile(r"\w+(?:[.-]\w+)*")
_CELL = re.compile(r"^cells\[\d+\]")
_MISSING = object()


@dataclass(frozen=True)
class TomlFile:
    """A parsed TOML file. Keys are written like `study.pay.reward` or `cells[0].objects`."""

    path: Path
    text: str
    content: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path, what: str) -> Self:
        """Read a file. Raises `ConfigError` if it is not TOML. `what` names its content in the message."""
        try:
            content = read_bytes(path)
            return cls(path, content.decode("utf-8-sig", "replace"), decode_toml(content))
        except OSError as error:
            raise ConfigError(f"cannot read {what} {path}: {error.strerror}") from error
        except TomlError as error:
            raise ConfigError(f"{path} is not TOML: {error}") from error

    def fault(self, error: Exception, table: str = "", kind: Any = None) -> ConfigError:
        """Describe an error that the content of a table has caused.

        The key comes from the path in a message of msgspec, or is the first key of the table in the message.

        Args:
            kind: Type of the whole file, from which the choices are taken.
        """
        message, key = str(error), table
        if found := _AT.search(message):
            key, message = joined_key(table, found[1]), message[: found.start()]
        if unknown := _UNKNOWN.search(message):
            key = joined_key(key, unknown[1])
        elif table and message.startswith(f"{table}."):
            key = message.partition(" ")[0]
        elif isinstance(values := self.value(key), Mapping):
            key = joined_key(key, _named(values, message))
        line, value, told = self.line(key), self.value(key), _in_a_sentence(message, kind, key)
        where = f"{self.path}, line {line}" if line else str(self.path)
        if value is _MISSING or isinstance(value, Mapping):
            return ConfigError(f"{where}: {'' if told.startswith(key) else f'{key}: '}{told}")
        is_told = key.rpartition(".")[2] in told and str(value) in told
        return ConfigError(f"{where}: {'' if is_told else f'{key} is {shown(value)}; '}{told}")

    def value(self, key: str) -> Any:
        """Return the value of a key. The value of a cell includes the table `all_cells`."""
        found: Any = self.content
        for part in re.findall(r"[^.\[\]]+", key):
            try:
                found = found[int(part)] if isinstance(found, list) else found[part]
            except (KeyError, IndexError, TypeError, ValueError):
                return _MISSING
            if isinstance(found, Mapping) and part.isdecimal() and _CELL.match(key):
                found = {**self.content.get("all_cells", {}), **found}
        return found

    def line(self, key: str) -> int | None:
        """Return the line number of a key, or of the innermost table that should contain the key."""
        return line_of(self.text, key, *([_CELL.sub("all_cells", key)] if "." in key else []))


def _named(values: Mapping[str, Any], message: str) -> str:
    """Return the first key of a table whose singular or plural occurs in a message, or an empty string."""
    keys = {key.rpartition(".")[2]: key for key in reversed(list(_keys(values)))}
    keys |= {key: key for key in _keys(values)}
    words = (form for word in _WORD.findall(message) for form in (word, f"{word}s"))
    return next((keys[word] for word in words if word in keys), "")


def _keys(values: Mapping[str, Any]) -> Iterator[str]:
    for name, value in values.items():
        yield name
        if isinstance(value, Mapping):
            yield from (f"{name}.{key}" for key in _keys(value))


def _in_a_sentence(message: str, kind: Any, key: str) -> str:
    told = message.removeprefix("Object contains ").removeprefix("Object is ").removeprefix("Object ")
    told = told[:1].lower() + told[1:] if message.startswith(("Object", "Expected")) else told
    if kind is None:
        return told
    if "unknown field" in message:
        fields = getattr(_type(kind, key.rpartition(".")[0]), "fields", ())
        return f"{told}; there are {', '.join(field.encode_name for field in fields)}" if fields else told
    if isinstance(found := _type(kind, key), inspect.LiteralType):
        return f"choose one of {', '.join(map(str, found.values))}"
    return told


def _type(kind: Any, key: str) -> Any:
    """Return the type of a key in a file of type `kind`, as described by `msgspec.inspect`."""
    found: Any = inspect.type_info(kind)
    for part in [*re.findall(r"[^.\[\]]+", key), None]:
        if isinstance(found, inspect.UnionType):
            found = next(one for one in found.types if not isinstance(one, inspect.NoneType))
        if isinstance(found, inspect.StructType) and part is not None:
            found = next((field.type for field in found.fields if field.encode_name == part), None)
        elif part is not None:
            found = getattr(found, "item_type", getattr(found, "value_type", None))
    return found
