"""The cache of compiled kernels."""

import subprocess
import sys
from pathlib import Path

import pytest

CALLEE = "from {room}.kernels import kernel\n\n\n@kernel\ndef factor():\n    return {factor}\n"
CALLER = (
    "from {room}.kernels import kernel\nfrom callee import factor\n\n\n"
    "@kernel\ndef twice(x):\n    return 2 * factor() * x\n\n\nprint(twice(1))\n"
)


@pytest.mark.parametrize("room", ["mjsim", "planner"])
def test_a_kernel_is_compiled_anew_when_one_that_it_calls_has_changed(tmp_path: Path, room: str) -> None:
    """The caller's own file stays as it is."""
    (tmp_path / "caller.py").write_text(CALLER.format(room=room), encoding="utf-8")
    printed = []
    for factor in (1, 10, 10):
        (tmp_path / "callee.py").write_text(CALLEE.format(room=room, factor=factor), encoding="utf-8")
        run = subprocess.run(
            [sys.executable, "-c", "import caller"], cwd=tmp_path, capture_output=True, text=True
        )
        assert not run.stderr
        printed.append(run.stdout.strip())
    assert printed == ["2", "20", "20"]
