"""Import of objects from mesh files, of houses from scenes of other simulators, and of episodes.

For users of `mjsim import` (docs/import.md); needs the extra `import`.
"""

from importlib.util import find_spec

from mjsim.values.errors import AssetError

EXTRA = ("coacd", "collada", "fast_simplification", "manifold3d", "networkx", "PIL", "trimesh", "yaml")


def require_extra() -> None:
    """Check that the libraries of the extra are installed (else `AssetError`); trimesh loads some of them late."""
    if missing := [name for name in EXTRA if find_spec(name) is None]:
        raise AssetError(
            f"importing needs {', '.join(missing)}: pip install 'mjsim[import]' adds what is missing"
        )
