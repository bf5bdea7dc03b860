"""Public names of a package that are imported at their first use."""

TYPE_CHECKING = False  # as in `typing`, whose import would take most of the time of `import mjsim`

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any


def lazy_names(
    package: str, modules: "Mapping[str, Iterable[str]]"
) -> "tuple[Callable[[str], Any], Callable[[], list[str]]]":
    """Make the functions `__getattr__` and `__dir__` of a package.

    Args:
        package: Name of the package.
        modules: Module within the package -> names that the package exports from it.
    """
    module_of = {name: module for module, names in modules.items() for name in names}

    def load(name: str) -> "Any":
        import importlib

        if name not in module_of:
            public = ", ".join(sorted(module_of))
            raise AttributeError(
                f"module {package!r} has no attribute {name!r}; names loaded at first use: {public}"
            )
        return getattr(importlib.import_module(f"{package}.{module_of[name]}"), name)

    def names() -> list[str]:
        import sys

        return sorted({*vars(sys.modules[package]), *module_of})

    return load, names
