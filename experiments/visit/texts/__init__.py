"""Texts that participants read. The folder `experiments/texts` has a text file and a story per language."""

import functools
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec

from experiments.errors import ConfigError
from experiments.visit.texts.items import Item
from mjsim.support.toml import line_of, read_toml

FOLDER = Path(__file__).parents[2] / "texts"
_ITEM = re.compile(r"`\$\.item\[(\d+)\](?:\.(\w+))?")
_PLACE = re.compile(r"\{(\w+)\}")


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The texts of a page, by name, and the items of its form."""

    words: dict[str, str]
    items: tuple[Item, ...] = ()
    scale: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> str:
        return self.words[name]

    def paragraphs(self, name: str = "text") -> list[str]:
        return [part.strip() for part in self.words.get(name, "").split("\n\n") if part.strip()]


class _Items(msgspec.Struct):
    item: list[Item] = []
    scale: Annotated[list[str], msgspec.Meta(min_length=2)] | None = None


Texts = Mapping[str, Section]


def words_of(texts: Texts) -> Mapping[str, Mapping[str, str]]:
    """Return all texts by section and name, without the items of forms."""
    return {name: section.words for name, section in texts.items()}


def languages() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def read_texts(language: str, path: Path | None, values: Mapping[str, str]) -> Texts:
    """Read the text of all pages in a language. A study's own file may replace some of it.

    Args:
        language: Language tag. If the project has no file for the language, `path` must contain all texts.
        path: The study's own file, or None. The items of a section replace all its default items.
        values: Values of placeholders such as `{name}`, by name. `keep_days` and `partial` also choose between texts
            of the consent form.

    Raises:
        ConfigError: A file cannot be read, or has an unknown section, text or placeholder.
    """
    known = language in languages()
    if not known and path is None:
        raise ConfigError(
            f"no texts in language {language!r}; there are {', '.join(languages())}, or name a file with all `texts`"
        )
    english = _shipped("en")
    usual = _shipped(language) if known else english
    own = _tables(path) if path else {}
    custom = {name: table for name, table in own.items() if ":" in name}  # texts of custom phases
    if untitled := [name for name, table in custom.items() if "title" not in table]:
        raise ConfigError(f"{path}: [{untitled[0]}] has no title; add one, which is the heading of the page")
    usual, english = {**usual, **custom}, {**english, **{name: {} for name in custom}}
    for name, table in {} if known else usual.items():
        if missing := sorted(set(table) - set(own.get(name, {}))):
            raise ConfigError(f"{path}: [{name}] lacks {missing[0]!r} in language {language!r}")
    for name, table in own.items():
        if name not in usual:
            raise ConfigError(f"{_at(path, name)}: no section [{name}]; there are {', '.join(usual)}")
        if unknown := sorted(set(table) - set(usual[name]) - {"item", "scale"}):
            where = _at(path, name, unknown[0])
            raise ConfigError(
                f"{where}: no text {unknown[0]!r} in [{name}]; there are {', '.join(usual[name])}"
            )
    tables = {name: {**table, **own.get(name, {})} for name, table in usual.items()}
    consent, unpaid, days = tables["consent"], tables["common"]["no_payment"], values.get("keep_days", "")
    retention = str(consent["kept_days" if days else "kept"]).replace("{keep_days}", days)
    stopping = consent["stop_partial" if "partial" in values else "stop_unpaid"]
    chosen = {"pay": unpaid, "screen_out": unpaid, "retention": retention, "stopping": stopping}
    values = {**chosen, **values}
    return {name: _section(name, table, english[name], values, path) for name, table in tables.items()}


def story_file(language: str, *, several_homes: bool = False) -> Path | None:
    """Return the path of a language's story, or None for English. Raises ConfigError if it is missing.

    The story for `several_homes` does not name the bins, because they differ between homes.
    """
    if language == "en" and not several_homes:
        return None
    path = FOLDER / f"story{'_homes' if several_homes else ''}.{language}.md"
    if not path.is_file():
        raise ConfigError(
            f"there is no story in language {language!r}; name a file with `story` in [all_cells]"
        )
    return path


@functools.cache
def _shipped(language: str) -> dict[str, dict[str, Any]]:
    return _tables(FOLDER / f"{language}.toml")


def _tables(path: Path) -> dict[str, dict[str, Any]]:
    try:
        return msgspec.convert(read_toml(path), dict[str, dict[str, Any]])
    except OSError as error:
        raise ConfigError(f"cannot read texts {path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from error


def _section(
    name: str, table: dict[str, Any], english: dict[str, Any], values: Mapping[str, str], path: Path | None
) -> Section:
    words = {key: value for key, value in table.items() if key not in ("item", "scale")}
    for key, value in words.items():
        if not isinstance(value, str):
            raise ConfigError(f"{_at(path, name, key)}: [{name}] {key} is {value!r}; write a text in quotes")
    try:
        form = msgspec.convert({key: table[key] for key in ("item", "scale") if key in table}, _Items)
    except msgspec.ValidationError as error:
        raise ConfigError(_item_fault(path, name, table, str(error))) from error
    names = [item.name for item in form.item]
    for number, item in enumerate(form.item):
        if item.name in names[:number]:
            where = _at(path, name, f"item[{number}]", "name")
            raise ConfigError(f"{where}: [{name}] has two items with the name {item.name!r}; rename one")
        points = range(1, len(form.scale or ()) + 1)
        if item.kind == "scale" and item.right is not None and item.right not in points:
            where = _at(path, name, f"item[{number}]", "right")
            raise ConfigError(
                f"{where}: [{name}] item {item.name}: right is {item.right!r}, no point of the scale"
            )
    filled = {
        key: _filled(text, values, str(english.get(key, "")), (path, name, key))
        for key, text in words.items()
    }
    return Section(filled, tuple(form.item), tuple(form.scale or ()))


def _item_fault(path: Path | None, section: str, table: dict[str, Any], message: str) -> str:
    """Add the line and the value to an error message of msgspec about the items of a section."""
    if (found := _ITEM.search(message)) is None:
        return f"{_at(path, section)}: [{section}]: {message}"
    number, key = int(found[1]), found[2] or ""
    value = f"{key} is {table['item'][number].get(key)!r}; " if key else ""
    return f"{_at(path, section, f'item[{number}]', key)}: [{section}] item {number + 1}: {value}{message}"


def _at(path: Path | None, *key: str) -> str:
    """Return the path of a study's texts with the line of a key, which is given by its parts."""
    if path is None:
        return "texts"
    line = line_of(path.read_text("utf-8", "replace"), ".".join(filter(None, key)))
    return f"{path}, line {line}" if line else str(path)


def _filled(text: str, values: Mapping[str, str], english: str, place: tuple[Path | None, str, str]) -> str:
    places = _PLACE.findall(english)
    later = {*places, *(name.capitalize() for name in places if name.islower())} - set(values)

    def value(found: re.Match[str]) -> str:
        if found[1] in values or found[1] in later:
            return values.get(found[1], found[0])
        names, (_, section, key) = ", ".join(sorted({*values, *later})), place
        raise ConfigError(f"{_at(*place)}: [{section}] {key} has a place {found[0]}; there are {names}")

    return _PLACE.sub(value, text)
