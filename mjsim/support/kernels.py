"""Compilation of numeric kernels with numba, cached on disk where a folder is writable; for all four packages.

It imports numba only once a kernel is declared.
"""

import functools
import os
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from platformdirs import user_cache_path

from mjsim.support.files import ROOT, digest_of

F = TypeVar("F", bound=Callable[..., Any])

MARK = b"@kernel\n"
UNUSED = 30 * 24 * 3600  # s after which machine code that no process has asked for is deleted

# A division by zero gives infinity or NaN, as in numpy: the check for it would cost a tenth of a trial's time.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_IMPORT = re.compile(r"^from ((?:mjsim|planner|experiments)[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)


def kernel(function: F) -> F:
    """Compile a function at its first call; a later process loads the machine code from disk.

    Where no cache folder is writable (no home, a full disk), each process compiles again.
    """
    import numba

    return cast(F, _cached(functools.partial(numba.njit, **_OPTIONS), function))


def inlined(function: F) -> F:
    """Compile a function as a part of each kernel that calls it: for small ones that take many arrays."""
    import numba

    return cast(F, numba.njit(forceinline=True, **_OPTIONS)(function))


def c_function(signature: str, function: Callable[..., Any]) -> Any:
    """Compile a function of numbers for callers in C, with types such as `float64(int64)`.

    The `ctypes` of the result is a pointer that is valid for as long as the result exists.
    """
    import numba

    return _cached(functools.partial(numba.cfunc, signature), function)


def _cached(compiler: Callable[..., Any], function: Callable[..., Any]) -> Any:
    """Compile a function, with the machine code on disk where that is possible."""
    from numba import config

    folder, chosen = cache_folder(Path(function.__code__.co_filename)), config.CACHE_DIR
    if folder is not None:
        config.CACHE_DIR = str(folder)  # read when decorating; kernels of other packages keep their folder
        try:
            return compiler(cache=True)(function)
        except RuntimeError:  # numba cannot cache it
            pass
        finally:
            config.CACHE_DIR = chosen
    return compiler()(function)


def cache_base() -> Path:
    """Folder of all that can be computed again: `NUMBA_CACHE_DIR`, else the user's cache folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    return Path(chosen) if chosen else user_cache_path("mjsim", appauthor=False)


@functools.cache
def cache_folder(source: Path) -> Path | None:
    """Folder for the machine code of a module's kernels, None where none is writable.

    Its name holds a digest of all that is compiled in: numba itself notices a change in a kernel's own file only, not
    in the kernels that it calls.
    """
    base = cache_base()
    try:
        folder = base / f"mjsim-{source.stem}-{digest_of(*sorted(_compiled_in(source) | {Path(__file__)}))}"
        if not folder.is_dir():
            _delete_unused(base)
            folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)  # in use; fails where the folder is not writable
    except OSError:
        return None
    return folder


def _compiled_in(source: Path) -> set[Path]:
    """The module, the modules whose kernels or constants it imports, and those that they import."""
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


def _delete_unused(base: Path) -> None:
    for folder in base.glob("mjsim-*"):
        if time.time() - folder.stat().st_mtime > UNUSED:
            shutil.rmtree(folder, ignore_errors=True)
