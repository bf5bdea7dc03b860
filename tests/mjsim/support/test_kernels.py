"""Machine code of kernels on disk."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from experiments.trials.warmup import NOT_KEPT, NOTICE
from mjsim.support import files, kernels

CALLEE = "from mjsim.support.kernels import kernel\n\n\n@kernel\ndef factor():\n    return {factor}\n"
CALLER = (
    "from mjsim.support.kernels import kernel\n"
    "from planner.callee import factor\nfrom planner.limits import OFFSET\n\n\n"
    "@kernel\ndef twice(x):\n    return 2 * factor() * x + OFFSET\n\n\n"
    "print(twice(1), sum(twice.stats.cache_hits.values()))\n"
)


def _project(root):
    """A project of two packages with the real `mjsim.support.kernels` and two kernels."""
    for package in ("mjsim", "planner"):
        (root / package).mkdir()
        (root / package / "__init__.py").touch()
    (root / "mjsim" / "support").mkdir()
    for module in (files, kernels):
        shutil.copy(module.__file__, root / "mjsim" / "support")
    (root / "planner/caller.py").write_text(CALLER, encoding="utf-8")
    _set(root, factor=1, offset=0)


def _set(root, factor, offset):
    (root / "planner/callee.py").write_text(CALLEE.format(factor=factor), encoding="utf-8")
    (root / "planner/limits.py").write_text(f"OFFSET = {offset}\n", encoding="utf-8")


def _run(root, cache):
    run = subprocess.run(
        [sys.executable, "-c", "import planner.caller"],
        cwd=root,
        env={
            **os.environ,
            "NUMBA_CACHE_DIR": str(cache),
            "PYTHONPATH": str(root),
            "PYTHONDONTWRITEBYTECODE": "1",  # bytecode looks current if a module changes within a second
        },
        capture_output=True,
        text=True,
    )
    assert not run.stderr
    return run.stdout.strip()


@pytest.mark.slow
def test_a_kernel_is_compiled_anew_when_one_that_it_calls_or_a_constant_has_changed(tmp_path):
    _project(tmp_path)
    printed = []
    for factor, offset in ((1, 0), (10, 0), (10, 0), (10, 5)):
        _set(tmp_path, factor, offset)
        printed.append(_run(tmp_path, tmp_path / "cache"))
    assert printed == ["2 0", "20 0", "20 1", "25 0"]  # the result, and whether it came from disk


@pytest.mark.slow
def test_an_unrelated_edit_recompiles_nothing_and_unused_machine_code_goes(tmp_path):
    _project(tmp_path)
    cache = tmp_path / "cache"
    _run(tmp_path, cache)
    (tmp_path / "planner/other.py").write_text("x = 1\n", encoding="utf-8")
    assert _run(tmp_path, cache) == "2 1"
    old = set(cache.iterdir())
    (cache / "of-somebody-else").mkdir()
    long_ago = time.time() - kernels.UNUSED - 1
    for path in cache.rglob("*"):
        os.utime(path, (long_ago, long_ago))
    _set(tmp_path, factor=3, offset=0)
    _run(tmp_path, cache)
    new = set(cache.iterdir())
    assert not old & new
    assert len(new) == 3  # of the two modules, and of somebody else


@pytest.mark.slow
def test_kernels_work_where_nothing_can_be_cached(tmp_path):
    """Neither where no folder can be made, nor where numba refuses."""
    _project(tmp_path)
    assert _run(tmp_path, Path("/proc/self/nowhere")) == "2 0"
    function = eval("lambda x: x + 1")  # it has no file
    assert kernels.kernel(function)(2) == 3


@pytest.mark.slow
@pytest.mark.parametrize("kept", [True, False])
def test_compiling_is_announced_once(tmp_path, kept):
    """No user may take a first command for one that hangs, or an unwritable cache for a cost that is paid once."""
    source, cache = tmp_path / "script.py", tmp_path / "cache" if kept else Path("/proc/self/nowhere")
    source.write_text(
        "from experiments.trials.warmup import announce_compiling\n"
        "from mjsim.support.kernels import kernel\n\n\n"
        "@kernel\ndef after(x):\n    return x + 1\n\n\n"
        "announce_compiling()\nprint(after(1), after(1.5))\n"
    )
    paths = os.pathsep.join((str(Path(__file__).parents[3]), *sys.path))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": paths}
    run = subprocess.run([sys.executable, source], env=environment, capture_output=True, text=True)
    assert run.stdout.strip() == "2 2.5"
    assert run.stderr == f"mjsim: {NOTICE if kept else NOT_KEPT.format(folder=cache)}\n"


def test_specialized_code_is_that_of_the_kernel():
    @kernels.kernel
    def total(pair):
        return pair[0].sum() + pair[1]

    code = kernels.specialized(total, (np.ones(2), 1.0))
    assert code((np.array([2.0, 3.0, 4.0]), 5.0)) == 14.0 == total((np.array([2.0, 3.0, 4.0]), 5.0))
    assert len(total.signatures) == 1 and code is not total
