"""README, documents and examples of user code import only what the API reference lists."""

import ast
import importlib
import inspect
import json
import re
from collections import Counter
from pathlib import Path
from types import FunctionType

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = {"experiments", "hud", "mjsim", "planner"}
PUBLIC = re.findall(r"^::: (\S+)$", (ROOT / "docs/api.md").read_text(encoding="utf-8"), re.MULTILINE)
NAMES = {module: frozenset(importlib.import_module(module).__all__) for module in PUBLIC}
EXAMPLES = [
    ROOT / "studies/examples" / f"{n}.py" for n in ("behaviour_cloning", "breadcrumbs", "demonstrations")
]
PAGES = [
    ROOT / "README.md",
    *sorted(ROOT.glob("docs/**/*.md")),
    *sorted(ROOT.glob("docs/**/*.ipynb")),
    *EXAMPLES,
]


def code_of(page: Path) -> list[str]:
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".py":
        return [text]
    if page.suffix == ".ipynb":
        cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
        return [re.sub(r"^%.*", "", "".join(cell["source"]), flags=re.MULTILINE) for cell in cells]
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def used(code: str) -> set[tuple[str, str]]:
    """Names of the four packages that code uses, with their modules. A name is empty if a module is imported."""
    found = set()
    for node in ast.walk(ast.parse(code)):
        match node:
            case ast.Import(names):
                found |= {(alias.name, "") for alias in names}
            case ast.ImportFrom(module=str(module), names=names):
                found |= {(module, alias.name) for alias in names}
            case ast.Attribute(value=ast.Name(id="mjsim"), attr=name):
                found.add(("mjsim", name))
    return {(module, name) for module, name in found if module.split(".")[0] in PACKAGES}


def is_public(module: str, name: str) -> bool:
    return module in NAMES and (not name or name in NAMES[module])


def test_the_public_modules_are_few_and_list_their_names():
    assert 0 < len(PUBLIC) == len(NAMES) <= 12
    for module, names in NAMES.items():
        assert names, module
        assert {name for name in names if not hasattr(importlib.import_module(module), name)} == set(), module


def test_a_public_name_has_one_path():
    paths = Counter(name for names in NAMES.values() for name in names)
    assert {name for name, count in paths.items() if count > 1} == set()


@pytest.mark.parametrize(
    "code",
    [
        "import mjsim.world.world",
        "from mjsim.world import World",
        "from planner import greedy",
        "mjsim.maker",
    ],
)
def test_an_internal_path_is_found(code):
    assert not all(is_public(*path) for path in used(code)) and used(code)


def test_documents_and_examples_use_public_paths():
    paths = {(page.name, *path) for page in PAGES for code in code_of(page) for path in used(code)}
    assert len({page for page, _, _ in paths}) > 10, "the imports of the pages were not found"
    assert {path for path in paths if not is_public(*path[1:])} == set()


@pytest.mark.parametrize("module", PUBLIC)
def test_every_public_function_class_and_method_has_a_docstring(module):
    """Ruff asks for them where they may not be left out as echoes."""
    public = {name: getattr(importlib.import_module(module), name) for name in NAMES[module]}
    defined = {
        name: value for name, value in public.items() if inspect.isclass(value) or inspect.isfunction(value)
    }
    for name, value in list(defined.items()):
        own = vars(value).items() if inspect.isclass(value) else ()
        defined |= {
            f"{name}.{key}": getattr(value, key)
            for key, member in own
            if not key.startswith("_")
            and isinstance(member, FunctionType | property | classmethod | staticmethod)
        }
    assert [name for name, value in defined.items() if not inspect.getdoc(value)] == []
