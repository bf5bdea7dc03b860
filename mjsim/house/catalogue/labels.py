"""Labels of houses in other languages, from files `labels.LANGUAGE.toml`: English label = label."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated

import msgspec

from mjsim.support.files import is_file, read_text
from mjsim.values.errors import AssetError, brief

_SHOWN = r"[^\x00-\x1f\x7f-\x9f\u2028\u2029]*"
# A line of text, not blank
Label = Annotated[str, msgspec.Meta(pattern=rf"^{_SHOWN}\S{_SHOWN}\Z", max_length=80)]


def read_labels(language: str, folders: Iterable[Path]) -> Mapping[str, str]:
    """English label -> label in a language; later folders take precedence, and a folder may have no file.

    Raises:
        AssetError: A file cannot be read, or holds something other than labels.
    """
    found: dict[str, str] = {}
    for path in (folder / f"labels.{language}.toml" for folder in folders):
        if is_file(path):
            try:
                found |= msgspec.convert(tomllib.loads(read_text(path)), dict[str, Label])
            except (OSError, ValueError, RecursionError) as error:
                raise AssetError(brief(f"cannot read labels {path}: {error}")) from error
    return found
