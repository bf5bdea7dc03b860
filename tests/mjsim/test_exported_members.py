"""The public surface of mjsim, as a list: a name that appears or goes is a decision, and shows up here."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import mjsim
import mjsim.render

PUBLIC = [
    "IDLE", "WAIT", "ActionResult", "Catalogue", "Disorder", "Episode", "FollowPath", "MjsimError", "Move",
    "ObjectStatus", "Observation", "PersonParameters", "Pick", "Place", "Refusal", "Scene", "StepAction", "StepResult",
    "Stop", "Wait", "Walker", "World", "WorldOptions", "compose", "load_catalogue", "make", "navigable_floor",
    "path_length", "point_along", "sample_episode",
]  # fmt: skip


def test_the_public_names_are_these():
    assert mjsim.__all__ == PUBLIC
    assert set(PUBLIC) <= set(dir(mjsim))


@pytest.mark.parametrize("name", PUBLIC)
def test_every_name_resolves_to_something_documented(name):
    value = getattr(mjsim, name)
    assert name in {"IDLE", "WAIT", "StepAction"} or (value.__name__ == name and value.__doc__)


@pytest.mark.parametrize("name", mjsim.render.__all__)
def test_every_name_of_rendering_is_found_where_type_checkers_see_it(name):
    tree = ast.parse(Path(inspect.getfile(mjsim.render)).read_text(encoding="utf-8"))
    module = next(
        n.module
        for n in ast.walk(tree)
        if isinstance(n, ast.ImportFrom) and name in [a.name for a in n.names]
    )
    assert getattr(mjsim.render, name) is getattr(importlib.import_module(str(module)), name)


def test_type_checkers_see_the_same_names():
    tree = ast.parse(Path(inspect.getfile(mjsim)).read_text(encoding="utf-8"))
    block = next(n for n in tree.body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    imports = [n for n in block.body if isinstance(n, ast.ImportFrom)]
    assert sorted(a.name for n in imports for a in n.names) == sorted(PUBLIC)
    for node in imports:
        for alias in node.names:
            assert getattr(mjsim, alias.name) is getattr(sys.modules[str(node.module)], alias.name)


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(AttributeError, match=r"'maker'.* make,"):
        _ = mjsim.maker


def run(code):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()


def test_import_mjsim_loads_none_of_the_simulator():
    heavy = {
        "OpenGL",
        "dm_control",
        "dm_env",
        "experiments",
        "gymnasium",
        "mujoco",
        "numba",
        "numpy",
        "planner",
    }
    assert run(f"import sys, mjsim; print(sorted({heavy} & set(sys.modules)))") == "[]"


@pytest.mark.slow
@pytest.mark.parametrize("imports", ["mjsim, gymnasium", "gymnasium, mjsim", "gymnasium"])
def test_gymnasium_finds_the_environment_by_its_module_in_any_order_of_import(imports):
    name = "mjsim.environments:mjsim/Rearrange-v0"
    made = run(f"import {imports}; print(gymnasium.make({name!r}, objects=1).spec.id)")
    assert made == "mjsim/Rearrange-v0"


def test_the_readme_runs_as_it_stands_and_needs_mjsim_alone():
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    code = readme.split("```python\n")[1].split("```")[0]
    assert "experiments" not in code
    assert "None" in run(code) or "Refusal" in run(code)
