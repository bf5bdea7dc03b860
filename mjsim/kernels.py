"""How numeric kernels are compiled: with numba, cached on disk where that is possible."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile a function at its first call; a later process loads the machine code from the cache.

    numba refuses to decorate when no cache folder is writable (a read-only installation without a home). The
    kernel then works all the same, compiled anew in each process.
    """
    try:
        return cast(F, numba.njit(cache=True, nogil=True)(function))
    except RuntimeError:
        return cast(F, numba.njit(nogil=True)(function))
