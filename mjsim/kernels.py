"""How numeric kernels are compiled: with numba, cached on disk where that is possible."""

import hashlib
from collections.abc import Callable
from types import ModuleType
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile a function at its first call; a later process loads the machine code from the cache.

    numba refuses to decorate when no cache folder is writable (a read-only installation without a home). The
    kernel then works all the same, compiled anew in each process.
    """
    try:
        compiled = numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:
        return cast(F, numba.njit(nogil=True)(function))
    _heed_imports(compiled, function)
    return cast(F, compiled)


def _heed_imports(compiled: Any, function: Callable[..., Any]) -> None:
    """Let the cache of a kernel expire with the modules whose kernels are compiled into it.

    numba looks at the kernel's own file alone, and would go on with what a kernel of another file was like before.
    """
    root, stamps = function.__module__.partition(".")[0], set()
    for value in list(function.__globals__.values()):
        inside = vars(value).values() if isinstance(value, ModuleType) and _is_of(value, root) else (value,)
        stamps |= {repr(stamp) for stamp in map(_stamp_of, inside) if stamp is not None}
    file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if file is not None and hasattr(file, "_source_stamp"):
        file._source_stamp = (file._source_stamp, hashlib.sha1("".join(sorted(stamps)).encode()).hexdigest())


def _is_of(module: ModuleType, root: str) -> bool:
    return module.__name__.partition(".")[0] == root


def _stamp_of(value: Any) -> Any:
    """What numba's cache of a kernel is valid for; None for what is no kernel."""
    file = getattr(getattr(value, "_cache", None), "_cache_file", None)
    return getattr(file, "_source_stamp", None)
