"""Other software that hides, or installs over, the packages beside mjsim: their names are common words."""

import importlib.util
from importlib import metadata
from pathlib import Path

PACKAGES = ("planner", "hud", "experiments")


def hidden_package(name: str) -> str | None:
    """What to do about a package that Python would not import from beside mjsim; None if all is well."""
    own = Path(__file__).resolve().parents[2] / name
    spec = importlib.util.find_spec(name)
    folders = list(spec.submodule_search_locations or ()) if spec else []
    if not folders:
        return f"the package {name} is missing at {own}: reinstall mjsim"
    found = Path(folders[0]).resolve()
    if found == own:
        return None
    return (
        f"Python imports {name} from {found} instead of {own}: rename that folder, or take {found.parent} off "
        "PYTHONPATH and sys.path"
    )


def shared_names() -> tuple[str, ...]:
    """What to do about other distributions that install a package of one of our names."""
    installed = metadata.packages_distributions()
    return tuple(
        f"the distribution {other} installs a package {name} too: pip uninstall {other}, or install mjsim in an "
        "environment of its own"
        for name in PACKAGES
        for other in sorted(set(installed.get(name, ())) - {"mjsim"})
    )
