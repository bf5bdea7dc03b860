"""Tries an installed wheel: imports every module, compiles every model, and shows a world to dm-control."""

import importlib
import pkgutil

import mujoco

import mjsim
from mjsim.house.catalogue.house_ref import models_root

PACKAGES = ("mjsim", "planner", "hud", "experiments")
PRELOAD = "experiments.web.worker.preload"  # does its work when a server of processes imports it
MODELS = ("houses/*/house.xml", "receptacles/*.xml", "objects/*.xml")


def main() -> None:
    """Try everything; the first failure ends the process."""
    root = models_root()
    if "site-packages" not in str(root) or "site-packages" not in str(mjsim.__file__):
        raise SystemExit(f"models come from {root}, not from the installed wheel")
    modules, skipped = import_all()
    paths = sorted(path for pattern in MODELS for path in root.glob(pattern))
    for path in paths:
        mujoco.MjModel.from_xml_path(str(path))
    if len(paths) < 31:
        raise SystemExit(f"only {len(paths)} models were shipped")
    environment = mjsim.make(objects=2, seed=0)
    environment.reset()
    before = environment.physics.time()
    environment.step(environment.action_spec().generate_value())
    if not environment.physics.time() > before:
        raise SystemExit("dm-control's Physics does not share the state of the world")
    missing = f", {len(skipped)} need {', '.join(sorted(set(skipped)))}" if skipped else ""
    print(f"{modules} modules import{missing}; {len(paths)} models compile; dm-control shares the world")


def import_all() -> tuple[int, list[str]]:
    """Import all modules. Return how many, and for each of the others the distribution that it lacks."""
    count, lacking = 0, list[str]()
    for package in PACKAGES:
        path = importlib.import_module(package).__path__
        for module in pkgutil.walk_packages(path, f"{package}.", onerror=lambda _: None):
            if module.name.endswith("__main__") or module.name == PRELOAD:
                continue
            try:
                importlib.import_module(module.name)
                count += 1
            except ModuleNotFoundError as error:
                if (error.name or package).split(".")[0] in PACKAGES:
                    raise
                lacking.append(str(error.name))
    return count, lacking


if __name__ == "__main__":
    main()
