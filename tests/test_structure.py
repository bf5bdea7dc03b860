"""Structure of the packages: few folders with few imports between them, and no circles at any level."""

from graphlib import TopologicalSorter

import grimp
import pytest

# package -> most direct subpackages, most imports between them; modules beside them are counted by CONTAINED
BOUNDS = {"experiments": (9, 29), "mjsim": (12, 36)}
# package -> modules that may be directly in it, besides subpackages
CONTAINED = {"experiments": {"errors", "house"}, "mjsim": {"__main__"}}
MODULES = 550  # most modules in the four packages
ACYCLIC = ("experiments", "hud", "mjsim", "planner")


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(*sorted({*BOUNDS, *ACYCLIC}), cache_dir=None)


def is_package(graph: grimp.ImportGraph, name: str) -> bool:
    return bool(graph.find_children(name))


def edges(graph: grimp.ImportGraph, package: str) -> dict[str, set[str]]:
    """Child -> other children that it, or anything below it, imports. The package stands for its `__init__`."""
    depth = package.count(".") + 2
    children = graph.find_children(package)
    found = {package: graph.find_modules_directly_imported_by(package) & children}
    for child in children:
        modules = {child, *graph.find_descendants(child)}
        imported = set().union(*map(graph.find_modules_directly_imported_by, modules))
        found[child] = {".".join(name.split(".")[:depth]) for name in imported} & {package, *children} - {
            child
        }
    return found


@pytest.mark.parametrize("package", BOUNDS)
def test_a_package_has_few_folders_with_few_imports_between_them(
    graph: grimp.ImportGraph, package: str
) -> None:
    folders = {child for child in graph.find_children(package) if is_package(graph, child)}
    most, most_imports = BOUNDS[package]
    assert len(folders) <= most, sorted(folders)
    between = {
        (one, other) for one, others in edges(graph, package).items() for other in others
        if {one, other} <= folders
    }  # fmt: skip
    assert len(between) <= most_imports, sorted(between)


@pytest.mark.parametrize("package", CONTAINED)
def test_a_module_is_in_a_folder(graph: grimp.ImportGraph, package: str) -> None:
    loose = {child for child in graph.find_children(package) if not is_package(graph, child)}
    assert {name.removeprefix(f"{package}.") for name in loose} == CONTAINED[package]


def test_the_packages_have_few_modules(graph: grimp.ImportGraph) -> None:
    assert 400 < len(graph.modules) <= MODULES


@pytest.mark.parametrize("package", ACYCLIC)
def test_imports_between_the_children_of_a_folder_form_no_circle(
    graph: grimp.ImportGraph, package: str
) -> None:
    for folder in {package, *graph.find_descendants(package)}:
        if is_package(graph, folder):
            TopologicalSorter(edges(graph, folder)).prepare()  # raises a CycleError that names the circle
