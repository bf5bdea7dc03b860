"""Compiles every model that an installed wheel ships, with stock MuJoCo."""

import mujoco

import mjsim
from mjsim.model.assets import models_root


def main() -> None:
    """Compile all, and make sure that they come from the wheel rather than from a checkout."""
    root = models_root()
    if "site-packages" not in str(root) or "site-packages" not in str(mjsim.__file__):
        raise SystemExit(f"models come from {root}, not from the installed wheel")
    paths = sorted(
        [*root.glob("houses/*/house.xml"), *root.glob("receptacles/*.xml"), *root.glob("objects/*.xml")]
    )
    for path in paths:
        mujoco.MjModel.from_xml_path(str(path))
    if len(paths) < 31:
        raise SystemExit(f"only {len(paths)} models were shipped")
    print(f"{len(paths)} models compile from {root.name}/ inside the wheel")


if __name__ == "__main__":
    main()
