"""Compile numeric kernels with numba, and cache the machine code on disk.

numba is imported when the first kernel is declared.
"""

import functools
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from platformdirs import user_cache_path

from mjsim.support.files import ROOT, digest_of, remove_leftovers

F = TypeVar("F", bound=Callable[..., Any])

MARK = b"@kernel\n"
UNUSED = 30 * 24 * 3600  # age after which unused cache folders are deleted, in seconds

# As in NumPy, division by zero gives infinity or NaN. Raising an exception would make trials 10% slower.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_IMPORT = re.compile(r"^from ((?:mjsim|planner|experiments)[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)


def kernel(function: F) -> F:
    """Compile a function when it is first called, or load its machine code from the disk cache.

    If the cache folder is not writable, each process compiles the function again.
    """
    import numba

    return cast(F, _cached(functools.partial(numba.njit, **_OPTIONS), function))


def specialized(function: F, *arguments: Any) -> F:
    """Return the machine code of a kernel for arguments that have the same types as the given ones.

    Calls skip numba's selection of the machine code, which takes about 20 us for arguments with many fields.
    Arguments of other types lead to wrong results.
    """
    import numba

    return cast(F, cast(Any, function).compile(tuple(map(numba.typeof, arguments))))


def inlined(function: F) -> F:
    """Inline a function into the kernels that call it. Use this for small functions with many arguments."""
    import numba

    return cast(F, numba.njit(forceinline=True, **_OPTIONS)(function))


def c_function(signature: str, function: Callable[..., Any]) -> Any:
    """Compile a Python function to a C callback with a numba signature such as `float64(int64)`.

    The attribute `ctypes` of the result is the function pointer. It is valid as long as the result exists.
    """
    import numba

    return _cached(functools.partial(numba.cfunc, signature), function)


def _cached(compiler: Callable[..., Any], function: Callable[..., Any]) -> Any:
    from numba import config

    folder, chosen = cache_folder(Path(function.__code__.co_filename)), config.CACHE_DIR
    if folder is not None:
        config.CACHE_DIR = str(folder)  # numba reads this setting when the decorator is applied
        try:
            return compiler(cache=True)(function)
        except RuntimeError:  # numba cannot cache this function
            pass
        finally:
            config.CACHE_DIR = chosen
    return compiler()(function)


def cache_base() -> Path:
    """Return the parent of all cache folders, which is `NUMBA_CACHE_DIR` or the user's cache folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) if chosen else user_cache_path("mjsim", appauthor=False)


@functools.cache
def cache_folder(source: Path) -> Path | None:
    """Return the cache folder for a module's compiled kernels, or None if it is not writable.

    The name of the folder contains a digest of all modules that the kernels use. numba itself detects changes
    in the file of a kernel, but not in other kernels that it calls.
    """
    base = cache_base()
    try:
        folder = base / f"mjsim-{source.stem}-{digest_of(*sorted(_compiled_in(source) | {Path(__file__)}))}"
        if not folder.is_dir():
            base.mkdir(parents=True, exist_ok=True)
            remove_leftovers(base, UNUSED, "mjsim-")
            folder.mkdir(exist_ok=True)
        os.utime(folder)  # marks the folder as used, and fails if it is not writable
    except OSError:
        return None
    return folder


def _compiled_in(source: Path) -> set[Path]:
    found, new = set(), {source}
    while new:
        path = new.pop()
        found.add(path)
        for module, imported in _IMPORT.findall(path.read_text(encoding="utf-8")):
            folder, names = ROOT.joinpath(*module.split(".")), re.findall(r"\w+", imported)
            used = {folder / f"{name}.py" for name in names}
            if any(name.isupper() for name in names) or _has_kernels(folder.with_suffix(".py")):
                used.add(folder.with_suffix(".py"))
            new |= {other for other in used if other.is_file()} - found
    return found


@functools.cache
def _has_kernels(path: Path) -> bool:
    return path.is_file() and MARK in path.read_bytes()
