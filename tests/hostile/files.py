"""Files damaged in one way each, by a generator of random numbers: texts, bytes, values of JSON and TOML, tables."""

import json
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from hostile.warm_commands import REFUSED

Rng = np.random.Generator
Change = Callable[[str, Rng], str | bytes]

NUMBERS = (
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
)
WORDS = re.compile(r"[A-Za-z_][\w:/.]*")
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
ELEMENT = re.compile(r"<[^<>]+>|^\[[^\]]*\]$|^\w+ = .*$|\{[^{}]*\}", re.MULTILINE)
ATTRIBUTE = re.compile(r' ?[\w:]+="[^"]*"|"\w+": [^,\n]*,?')


def pick(values: Any, rng: Rng) -> Any:
    """One of the values, which keep their types."""
    values = list(values)
    return values[int(rng.integers(len(values)))]


def _replaced(pattern: re.Pattern[str], text: str, rng: Rng, new: Callable[[str], str]) -> str:
    """The text with one match of a pattern, if there is any, turned into something new."""
    matches = list(pattern.finditer(text))
    if not matches:
        return text
    match: re.Match[str] = pick(matches, rng)
    return text[: match.start()] + new(match.group()) + text[match.end() :]


def flipped(data: bytes, rng: Rng) -> bytes:
    """One to three other bytes."""
    changed = bytearray(data or b"0")
    for at in rng.integers(len(changed), size=rng.integers(1, 4)):
        changed[at] ^= int(rng.integers(1, 256))
    return bytes(changed)


def _cut_out(text: str, rng: Rng) -> str:
    start, end = sorted(rng.integers(len(text), size=2).tolist())
    return text[:start] + text[end:]


def _scaled(text: str, rng: Rng) -> str:
    factor = pick([-1.0, 0.001, 0.1, 0.9, 1.1, 1.5, 10.0, 1000.0], rng)
    return _replaced(NUMBER, text, rng, lambda number: f"{float(number) * factor:g}")


def _swapped(pattern: re.Pattern[str]) -> Change:
    """Put one match in the place of another."""
    return lambda text, rng: _replaced(pattern, text, rng, lambda _: pick(pattern.findall(text), rng))


def _nested(text: str, rng: Rng) -> str:
    depth, at = pick([50, 600, 20_000], rng), int(rng.integers(len(text)))
    opening, closing = pick([("<body>", "</body>"), ("[", "]"), ('{"a":', "}")], rng)
    return f"{text[:at]}{opening * depth}{closing * depth}{text[at:]}"


def _encoded(text: str, rng: Rng) -> bytes:
    return text.replace("o", "ö").encode(pick(["latin-1", "utf-16", "utf-32", "cp1252"], rng), "replace")


TEXTS: dict[str, Change] = {
    "bytes flipped": lambda text, rng: flipped(text.encode(), rng),
    "end cut off": lambda text, rng: text[: rng.integers(len(text))],
    "part cut out": _cut_out,
    "element deleted": lambda text, rng: _replaced(ELEMENT, text, rng, lambda _: ""),
    "element doubled": lambda text, rng: _replaced(ELEMENT, text, rng, lambda element: element * 2),
    "attribute deleted": lambda text, rng: _replaced(ATTRIBUTE, text, rng, lambda _: ""),
    "number replaced": lambda text, rng: _replaced(NUMBER, text, rng, lambda _: pick(NUMBERS, rng)),
    "number scaled": _scaled,
    "numbers swapped": _swapped(NUMBER),
    "words swapped": _swapped(WORDS),
    "elements swapped": _swapped(ELEMENT),
    "nested deeply": _nested,
    "other encoding": _encoded,
    "zero byte": lambda text, rng: text[: (at := int(rng.integers(len(text))))] + "\0" + text[at:],
    "empty": lambda _text, _rng: "",
}


def damage_text(path: Path, rng: Rng) -> tuple[str, str]:
    """Damage a text; what was done, and what must become of it where JSON with strict readers is no JSON any more."""
    name, text = pick(TEXTS, rng), path.read_text("utf-8")
    changed = TEXTS[name](text, rng)
    data = changed if isinstance(changed, bytes) else changed.encode()
    path.write_bytes(data)
    known = {".json": json.loads, ".toml": tomllib.loads}.get(path.suffix)
    return name, "" if known is None or is_strict(data, known) else REFUSED


def is_strict(data: bytes, read: Callable[..., Any] = json.loads) -> bool:
    """Whether this is JSON, or TOML, without keys that are there twice, NaN and infinity."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise ValueError
        return dict(pairs)

    try:
        options = {"object_pairs_hook": once} if read is json.loads else {}
        value = read(data.decode("utf-8-sig").replace("\r\n", "\n"), **options)
    except (ValueError, RecursionError):
        return False
    return all(not isinstance(leaf, float) or np.isfinite(leaf) for _, _, leaf in _leaves(value))


def _leaves(value: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Every (container, key, value) inside of a value."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in pairs:
        yield value, key, inner
        yield from _leaves(inner)


def is_problem(value: Any) -> bool:
    """Whether a routing problem is one: a symmetric matrix of finite distances, indices of its rows."""
    matrix = np.array(value["distances"], float)
    indices = [value["start"], *value["onboard"], *(i for s in value["shipments"] for i in s.values())]
    good = (matrix == matrix.T).all() and (matrix >= 0).all() and np.isfinite(matrix).all()
    return bool(good) and all(type(i) is int and 0 <= i < len(matrix) for i in indices)


def damage_values(value: Any, rng: Rng) -> tuple[str, str, str]:
    """JSON text of a value that is wrong in one place; what is wrong, and what must become of it."""
    places = list(_leaves(value))
    tables = [inner for _, _, inner in places if isinstance(inner, dict)] + [value]
    numbers = [p for p in places if isinstance(p[2], int | float) and not isinstance(p[2], bool)]
    kind = pick(["key twice", "unknown key", "no number", "other type", "key missing", "other number"], rng)
    must, mark, text = REFUSED, "\x01", ""
    if kind in ("key twice", "unknown key"):
        table = pick([t for t in tables if t], rng)
        key = pick(table, rng)
        table[mark] = table[key]
        text = key if kind == "key twice" else "surprise"
    elif kind == "key missing":
        table = pick([t for t in tables if t], rng)
        del table[pick(table, rng)]
        must = ""
    else:
        holder, key, found = pick(numbers, rng)
        others: Any = {
            "no number": [float("nan"), float("inf"), -float("inf")],
            "other type": ["x", [], {}, True, None, str(found)],
            "other number": [-1, 0, -found, found * 1e6, 1e300, 2**63, 10**30, 0.5],
        }[kind]
        holder[key] = pick(others, rng)
        must = "" if kind == "other number" else REFUSED
    return kind, json.dumps(value).replace(json.dumps(mark), json.dumps(text)), must


def damage_toml(text: str, rng: Rng) -> tuple[str, str, str]:
    """The same of TOML."""
    lines = text.splitlines()
    where = pick([k for k, line in enumerate(lines) if re.match(r"[\w.]+ = ", line)], rng)
    key, _, value = lines[where].partition(" = ")
    kind = pick(["key twice", "unknown key", "no number", "other type", "other value"], rng)
    others = {
        "key twice": [f"{lines[where]}\n{lines[where]}"],
        "unknown key": [f"{lines[where]}\nsurprise = {v}" for v in ("1", '"a"', "nan")],
        "no number": [f"{key} = {v}" for v in ("nan", "inf", "-inf", "[nan]")],
        "other type": [f"{key} = {v}" for v in ("1979-05-27", "[[]]", "{ a = {} }", "12:30:00")],
        "other value": [
            f"{key} = {v}" for v in ("-1", '""', "true", '"\\u0000"', f"[{value}]", "1e300", "9" * 30)
        ],
    }
    lines[where] = pick(others[kind], rng)
    return kind, "\n".join(lines) + "\n", "" if kind == "other value" else REFUSED


def damage_file(path: Path, rng: Rng) -> str:
    """Damage any file; it is other than before."""
    data = path.read_bytes()
    lines = data.splitlines(keepends=True)
    middle = int(rng.integers(len(lines))) if lines else 0
    changes: dict[str, Callable[[], bytes]] = {
        "bytes flipped": lambda: flipped(data, rng),
        "end cut off": lambda: data[: int(rng.integers(len(data)))],
        "end added": lambda: data + data[-20:],
        "emptied": lambda: b"",
        "line twice": lambda: b"".join((*lines[: middle + 1], *lines[middle:])),
        "line missing": lambda: b"".join((*lines[:middle], *lines[middle + 1 :])),
        "zeros": lambda: bytes(len(data)),
    }
    name: str = pick(changes, rng)
    path.write_bytes(changes[name]())
    return name


def rows_of(path: Path) -> Any:
    """Values of a Parquet file, read without care; none of another file."""
    try:
        rows = pa.parquet.read_table(path).to_pylist() if path.suffix == ".parquet" else []
        return str([list(row.values()) for row in rows])
    except (OSError, ValueError, pa.ArrowException):
        return "nothing"


IMPOSSIBLE = {
    "nd_feasible": [7.3, -2.0, "many", True],
    "ipl_locations": [-0.1, 1e308],
    "task_distance_m": [-5.0, 1e308],
    "completion_time_s": [1e308, "long"],
    "objects": [0, -6, 6.5, "6", None],
    "assistance": [None, ""],
    "likert_useful": [0, 6, 2.5, "good"],
    "user": [None],
}


def damage_table(rows: list[dict[str, Any]], path: Path, rng: Rng) -> tuple[str, str]:
    """Write a table of people that is wrong in one way; what is wrong, and what must become of it."""
    kind = pick(
        ["row twice", "all twice", "unknown answers", "impossible", "not finite", "column missing", "file"],
        rng,
    )
    k, must = int(rng.integers(len(rows))), REFUSED
    names = list(rows[0])
    if kind == "row twice":
        rows.insert(int(rng.integers(len(rows))), rows[k])
    elif kind == "all twice":
        rows += rows
    elif kind == "unknown answers":
        rows = [{**row, pick(["likert_ease", "likert", "Likert_useful", "LIKERT_x"], rng): 3} for row in rows]
    elif kind == "impossible":
        column = pick(IMPOSSIBLE, rng)
        value = pick(IMPOSSIBLE[column], rng)
        rows = [{**row, column: row.get(column, 3)} for row in rows]
        rows[k][column] = value
        kind = f"impossible {column}"
        rows = _of_one_type(rows, column)
    elif kind == "not finite":
        column, must = pick([n for n in names if isinstance(rows[k][n], float)], rng), ""
        rows[k] = {**rows[k], column: pick([float("nan"), float("inf"), -float("inf"), None], rng)}
    elif kind == "column missing":
        gone, must = pick(names, rng), ""
        rows = [{name: value for name, value in row.items() if name != gone} for row in rows]
    pa.parquet.write_table(pa.Table.from_pylist(rows), path)
    if kind == "file":
        kind, must = f"file {damage_file(path, rng)}", ""
    return kind, must


def _of_one_type(rows: list[dict[str, Any]], column: str) -> list[dict[str, Any]]:
    """Rows whose column can be written: as text where one is, all true where one is."""
    kinds = {type(row[column]) for row in rows if row[column] is not None}
    if str in kinds and len(kinds) > 1:
        return [{**row, column: None if row[column] is None else str(row[column])} for row in rows]
    if bool in kinds:
        return [{**row, column: True} for row in rows]
    return [{**row, column: float(row[column])} for row in rows] if kinds == {int, float} else rows
