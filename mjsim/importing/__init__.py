"""Import objects from mesh files, and houses and episodes from other simulators (docs/import.md).

The `import` extra of this package must be installed.
"""

from importlib.util import find_spec

from mjsim.values.errors import AssetError

EXTRA = ("coacd", "collada", "fast_simplification", "manifold3d", "networkx", "PIL", "trimesh", "yaml")


def require_extra() -> None:
    """Raise an AssetError if a library of the `import` extra is not installed."""
    if missing := [name for name in EXTRA if find_spec(name) is None]:
        raise AssetError(
            f"importing needs {', '.join(missing)}: pip install 'mjsim[import]' adds what is missing"
        )
