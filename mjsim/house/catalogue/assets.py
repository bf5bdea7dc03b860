"""Where the authored houses, receptacles and objects lie on disk."""

from pathlib import Path

from mjsim.values.errors import AssetError


def models_root() -> Path:
    """Folder that holds `houses/`, `receptacles/` and `objects/`; `AssetError` where there is none.

    An installed wheel carries it inside the package; a checkout has it beside the package.
    """
    package = Path(__file__).resolve().parents[2]
    candidates = (package / "models", package.parent / "models")
    for candidate in candidates:
        if (candidate / "houses").is_dir():
            return candidate
    looked = " or ".join(str(c) for c in candidates)
    raise AssetError(f"no models folder at {looked}; reinstall mjsim, or run it from a full checkout")
