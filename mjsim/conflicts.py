"""Other software that hides, or installs over, the packages beside mjsim: their names are common words."""

import importlib.util
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

DISTRIBUTION = "mjsim"
PACKAGES = ("planner", "hud", "experiments")


class Conflict(NamedTuple):
    """A package of this distribution whose name somebody else uses too.

    Attributes:
        package: Its name.
        hidden: Whether Python imports the other one.
        message: What is in the way, and what to do.
    """

    package: str
    hidden: bool
    message: str


def hidden_package(name: str) -> Conflict | None:
    """The conflict of a package that Python would not import from beside mjsim; None if all is well."""
    own = Path(__file__).resolve().parents[1] / name
    spec = importlib.util.find_spec(name)
    if spec is None or not spec.submodule_search_locations:
        return Conflict(name, True, f"the package {name} is missing at {own}: reinstall {DISTRIBUTION}")
    found = Path(next(iter(spec.submodule_search_locations))).resolve()
    if found == own:
        return None
    return Conflict(
        name,
        True,
        f"Python imports {name} from {found} instead of {own}: rename that folder, or take {found.parent} off "
        "PYTHONPATH and sys.path",
    )


def package_conflicts() -> tuple[Conflict, ...]:
    """Every conflict of `PACKAGES`: what is hidden, and other distributions that install the same name."""
    hidden = [conflict for name in PACKAGES if (conflict := hidden_package(name))]
    installed = metadata.packages_distributions()
    shared = [
        Conflict(
            name,
            False,
            f"the distribution {other} installs a package {name} too: pip uninstall {other}, or install "
            f"{DISTRIBUTION} in an environment of its own",
        )
        for name in PACKAGES
        for other in sorted(set(installed.get(name, ())) - {DISTRIBUTION})
    ]
    return (*hidden, *shared)
