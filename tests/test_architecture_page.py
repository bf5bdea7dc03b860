"""The architecture page is true: its paths and names exist, its tables follow the contracts, its diagrams the code."""

import functools
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/architecture.md").read_text("utf-8")
PROSE = re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL)
# Rows of tables, items of lists and paragraphs, each with the code that it quotes
BLOCKS = [re.findall(r"`([^`\n]+)`", block) for block in re.split(r"\n(?=\||- |\d\. )|\n\n", PROSE)]
SEQUENCES = re.findall(r"```mermaid\nsequenceDiagram\n(.*?)```", PAGE, re.DOTALL)
ROLES = dict(re.findall(r"^\| (\w+) \| (`.+) \|$", PAGE, re.MULTILINE))
PACKAGES = ("experiments", "mjsim", "planner", "hud")
SOURCES = ("*.py", "*.js", "*.toml", "*.html")


def is_path(code):
    return re.fullmatch(r"[\w.-]+/[\w./-]*|[\w.-]+\.(?:py|js|md|toml)", code) is not None


def paths(quoted):
    """Paths among quoted code. A short one is relative to the folder of a path before it in the same block."""
    found = []
    for code in filter(is_path, quoted):
        bases = [ROOT, *(p if p.is_dir() else p.parent for p in reversed(found))]
        found.append(next((base / code for base in bases if (base / code).exists()), ROOT / code))
    return found


@functools.cache
def words(path):
    """Words in a file, or in the source files of a folder."""
    files = [path] if path.is_file() else [one for kind in SOURCES for one in path.rglob(kind)]
    texts = (one.read_text("utf-8") for one in files if "node_modules" not in one.parts)
    return frozenset(word for text in texts for word in re.findall(r"\w+", text))


def code_of(role):
    """Source of the files of a participant of the diagrams."""
    files = [
        one
        for path in paths(re.findall(r"`([^`]+)`", ROLES[role]))
        for one in ([path] if path.is_file() else path.rglob("*.py"))
    ]
    return "\n".join(one.read_text("utf-8") for one in files)


def test_each_path_exists():
    found = [path for quoted in BLOCKS for path in paths(quoted)]
    assert len(found) > 100
    assert [str(path) for path in found if not path.exists()] == []


@pytest.mark.parametrize("quoted", [q for q in BLOCKS if q], ids=lambda quoted: quoted[0])
def test_each_name_is_in_a_file_that_the_same_block_names(quoted):
    files = paths(quoted) or [ROOT / package for package in PACKAGES]
    names = [code for code in quoted if code.isidentifier() and code not in PACKAGES]
    assert [name for name in names if not any(name in words(path) for path in files)] == []


@pytest.mark.parametrize("package", ["experiments", "mjsim"])
def test_the_folders_are_those_of_the_import_contracts_in_their_order(package):
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    contracts = settings["importlinter"]["contracts"]
    (layers,) = [contract["layers"] for contract in contracts if contract.get("containers") == [package]]
    expected = [name for layer in layers for name in layer.split(" | ")]
    assert re.findall(rf"^\| `{package}/(\w+)(?:/|\.py)` \|", PAGE, re.MULTILINE) == expected


@pytest.mark.parametrize("sequence", SEQUENCES, ids=["page", "trial"])
def test_the_diagrams_call_methods_and_send_values_that_exist(sequence):
    roles = dict(re.findall(r"participant (\w+) as (\w+)", sequence))
    arrows = re.findall(r"(\w+)--?>>(\w+): (.+)", sequence)
    assert len(arrows) > 15
    for sender, receiver, text in arrows:
        called = re.match(r"(\w+)\(", text)
        if called:
            assert f"def {called[1]}(" in code_of(roles[receiver]), text
        elif value := re.match(r"[A-Z][a-z]\w+", text):
            ends = code_of(roles[sender]) + code_of(roles[receiver])
            assert f"class {value[0]}" in ends, text
