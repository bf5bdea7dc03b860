"""Importers for objects in mesh files, houses from other simulators, and episodes (docs/import.md).

The extra `import` must be installed.
"""

from importlib.util import find_spec

from mjsim.values.errors import AssetError

EXTRA = ("coacd", "collada", "fast_simplification", "manifold3d", "networkx", "PIL", "trimesh", "yaml")


def require_extra() -> None:
    """Raise `AssetError` if a library of the extra is missing. Otherwise, some would fail later, inside trimesh."""
    if missing := [name for name in EXTRA if find_spec(name) is None]:
        raise AssetError(
            f"importing needs {', '.join(missing)}: pip install 'mjsim[import]' adds what is missing"
        )
