"""The public surface of mjsim, as a list: a name that appears or goes is a decision, and shows up here."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import mjsim

ROOT = Path(__file__).parents[2]
STUBS = [path for name in ("experiments", "mjsim") for path in sorted((ROOT / name).rglob("__init__.pyi"))]
PUBLIC = [
    "IDLE", "WAIT", "ActionResult", "Catalogue", "Disorder", "Episode", "FollowPath", "MjsimError", "Move",
    "ObjectStatus", "Observation", "PersonParameters", "Pick", "Place", "Refusal", "Scene", "StepAction", "StepResult",
    "Stop", "Wait", "Walker", "World", "WorldOptions", "compose", "load_catalogue", "make", "navigable_floor",
    "path_length", "point_along", "sample_episode",
]  # fmt: skip


def test_the_public_names_are_these():
    assert sorted(mjsim.__all__) == sorted(PUBLIC)
    assert set(PUBLIC) <= set(dir(mjsim))


@pytest.mark.parametrize("name", PUBLIC)
def test_every_name_resolves_to_something_documented(name):
    value = getattr(mjsim, name)
    assert name in {"IDLE", "WAIT", "StepAction"} or (value.__name__ == name and value.__doc__)


@pytest.mark.parametrize("stub", STUBS, ids=lambda stub: stub.parent.name)
def test_type_checkers_see_the_names_that_a_package_loads(stub):
    package = importlib.import_module(".".join(stub.parent.relative_to(ROOT).parts))
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    listed = next(ast.literal_eval(n.value) for n in tree.body if isinstance(n, ast.Assign))
    imports = [n for n in tree.body if isinstance(n, ast.ImportFrom)]
    assert sorted(listed) == sorted(a.name for n in imports for a in n.names) == sorted(package.__all__)
    for node in imports:
        module = importlib.import_module(f"{package.__name__}.{node.module}")
        for alias in node.names:
            assert getattr(package, alias.name) is getattr(module, alias.name)


def test_an_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="maker"):
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


@pytest.mark.slow
def test_the_readme_runs_as_it_stands_and_needs_mjsim_alone():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    code = readme.split("```python\n")[1].split("```")[0]
    assert "experiments" not in code
    assert "None" in run(code) or "Refusal" in run(code)
