"""The environment's entry in Gymnasium's registry, made without importing Gymnasium."""

import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from types import ModuleType

ENVIRONMENT_ID = "mjsim/Rearrange-v0"
_REGISTRY = "gymnasium.envs.registration"


def register_when_gymnasium_loads() -> None:
    """Make `gymnasium.make("mjsim/Rearrange-v0")` work, now if Gymnasium is loaded, else once it is."""
    if _REGISTRY in sys.modules:
        _register()
    elif not any(isinstance(finder, _GymnasiumFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _GymnasiumFinder())


def _register() -> None:
    from gymnasium.envs.registration import register, registry

    if ENVIRONMENT_ID not in registry:
        register(id=ENVIRONMENT_ID, entry_point="mjsim.environments.gymnasium_environment:RearrangeEnv")


class _GymnasiumFinder(importlib.abc.MetaPathFinder):
    """Registers the environment when Gymnasium's registry is imported; Gymnasium 1.0 dropped its entry points."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """The spec of Gymnasium's registry, which registers the environment once it has run; None for the rest."""
        spec = (
            importlib.machinery.PathFinder.find_spec(fullname, path, target)
            if fullname == _REGISTRY
            else None
        )
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                _register()

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
