"""Damaged copies of a good house: one file changed in one way, by a seed."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

Change = Callable[[str, np.random.Generator], str | bytes]

VALUES = (
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "1e300",
    "1e30",
    "1e9",
    "99999",
    "-1e-300",
    "",
    "x",
    "0x10",
    "1,5",
    "--1",
)
WORDS = re.compile(r"[A-Za-z_][\w:/.]*")
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
ELEMENT = re.compile(r"<[^<>]+>|^\[[^\]]*\]$|^\w+ = .*$|\{[^{}]*\}", re.MULTILINE)
ATTRIBUTE = re.compile(r' ?[\w:]+="[^"]*"|"\w+": [^,\n]*,?')


def damage(folder: Path, rng: np.random.Generator) -> str:
    """Change one file of a folder in one way; returns what was done."""
    names = sorted(p.name for p in folder.iterdir() if p.suffix in (".xml", ".toml", ".json"))
    path = folder / names[rng.integers(len(names))]
    name = list(CHANGES)[rng.integers(len(CHANGES))]
    changed = CHANGES[name](path.read_text(encoding="utf-8"), rng)
    path.write_bytes(changed if isinstance(changed, bytes) else changed.encode("utf-8"))
    return f"{name} in {path.name}"


def _replaced(
    pattern: re.Pattern[str], text: str, rng: np.random.Generator, new: Callable[[str], str]
) -> str:
    """The text with one match of a pattern, if there is any, turned into something new."""
    matches = list(pattern.finditer(text))
    if not matches:
        return text
    match = matches[rng.integers(len(matches))]
    return text[: match.start()] + new(match.group()) + text[match.end() :]


def _flip_bytes(text: str, rng: np.random.Generator) -> bytes:
    data = bytearray(text.encode())
    for _ in range(rng.integers(1, 4)):
        data[rng.integers(len(data))] = rng.integers(256)
    return bytes(data)


def _cut(text: str, rng: np.random.Generator) -> str:
    return text[: rng.integers(len(text))]


def _cut_out(text: str, rng: np.random.Generator) -> str:
    start, end = sorted(rng.integers(len(text), size=2).tolist())
    return text[:start] + text[end:]


def _double(text: str, rng: np.random.Generator) -> str:
    return _replaced(ELEMENT, text, rng, lambda element: element * 2)


def _delete(pattern: re.Pattern[str]) -> Change:
    return lambda text, rng: _replaced(pattern, text, rng, lambda _: "")


def _swap(pattern: re.Pattern[str]) -> Change:
    """Put one match in the place of another."""

    def change(text: str, rng: np.random.Generator) -> str:
        found = pattern.findall(text) or [""]
        return _replaced(pattern, text, rng, lambda _: str(rng.choice(found)))

    return change


def _number(text: str, rng: np.random.Generator) -> str:
    return _replaced(NUMBER, text, rng, lambda _: str(rng.choice(VALUES)))


def _scale(text: str, rng: np.random.Generator) -> str:
    factor = float(rng.choice([-1.0, 0.001, 0.1, 0.9, 1.1, 1.5, 10.0, 1000.0]))
    return _replaced(NUMBER, text, rng, lambda number: f"{float(number) * factor:g}")


def _nest(text: str, rng: np.random.Generator) -> str:
    depth = int(rng.choice([50, 600, 20_000]))
    at = int(rng.integers(len(text)))
    opening, closing = [("<body>", "</body>"), ("[", "]"), ('{"a":', "}")][rng.integers(3)]
    return text[:at] + opening * depth + closing * depth + text[at:]


CHANGES: dict[str, Change] = {
    "bytes flipped": _flip_bytes,
    "end cut off": _cut,
    "part cut out": _cut_out,
    "element deleted": _delete(ELEMENT),
    "element doubled": _double,
    "attribute deleted": _delete(ATTRIBUTE),
    "number replaced": _number,
    "number scaled": _scale,
    "numbers swapped": _swap(NUMBER),
    "words swapped": _swap(WORDS),
    "elements swapped": _swap(ELEMENT),
    "nested deeply": _nest,
    "other encoding": lambda text, rng: text.replace("o", "ö").encode(
        str(rng.choice(["latin-1", "utf-16", "utf-32"]))
    ),
    "zero byte": lambda text, rng: text[: (at := int(rng.integers(len(text))))] + "\0" + text[at:],
    "empty": lambda text, rng: "",  # noqa: ARG005
}
