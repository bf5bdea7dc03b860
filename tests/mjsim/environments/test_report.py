"""The report tells what a machine has, and what to do when drawing is impossible."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjsim.render import diagnostics
from mjsim.render.context import GlInfo, is_software
from mjsim.render.diagnostics import advise, egl_vendors, environment_report

CHECKOUT = Path(__file__).resolve().parents[3]
GPU = GlInfo("NVIDIA Corporation", "NVIDIA H100/PCIe/SSE2", "4.6.0", False)
CPU = GlInfo("Mesa", "llvmpipe (LLVM 15.0.6, 256 bits)", "4.5", True)


@pytest.fixture(scope="module")
def found():
    """The report of this machine."""
    return environment_report()


def test_report_of_this_machine_is_usable_and_truthful(found):
    assert found.usable
    assert found.versions["mujoco"] == mujoco.__version__
    assert found.versions["numpy"] == np.__version__
    assert found.gl is not None
    assert found.gl.renderer in "\n".join(found.lines())


def test_the_report_says_how_much_compiled_code_there_is(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "code").write_bytes(bytes(3_000_000))
    assert f"compiled code: 3 MB in {tmp_path};" in "\n".join(environment_report().lines())


def test_vendor_files_come_in_the_order_they_are_tried(tmp_path):
    for name in ("50_mesa.json", "10_nvidia.json", "notes.txt"):
        (tmp_path / name).write_text("{}")
    assert egl_vendors(tmp_path) == ("10_nvidia.json", "50_mesa.json")
    assert egl_vendors(tmp_path / "absent") == ()


def test_advice_names_what_to_install():
    assert advise({"mujoco": "3.17.0"}, ("10_nvidia.json",), GPU) == ()
    assert "pip install ortools" in advise({"ortools": None}, (), GPU)[0]
    assert "apt-get install libegl1" in advise({}, (), None)[0]
    assert "nvidia-smi" in advise({}, ("10_nvidia.json", "50_mesa.json"), CPU)[0]
    assert "10_nvidia.json is missing" in advise({}, ("50_mesa.json",), CPU)[0]


def test_software_rasterisers_are_recognised():
    assert is_software(CPU.renderer)
    assert is_software("softpipe")
    assert not is_software(GPU.renderer)


@pytest.mark.slow
def test_a_machine_without_opengl_still_gets_a_report():
    """Rendering switched off stands in for a missing library: importing must work, the report must say why."""
    code = (
        "from mjsim.render.diagnostics import environment_report as e; r = e(); "
        "print(r.usable, r.gl, 'MUJOCO_GL' in r.problem, 'libegl1' in r.advice[-1], 'unusable' in str(r.lines()))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={"MUJOCO_GL": "off", "PATH": ""},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.split() == ["False", "None", "True", "True", "True"]


def test_missing_distribution_makes_the_report_unusable(found):
    report = dataclasses.replace(found, versions={"mujoco": None})
    assert not report.usable
    assert "mujoco not installed" in report.lines()


def test_dm_control_may_be_missing_where_it_cannot_be_installed_like_the_others(found, monkeypatch):
    report = dataclasses.replace(found, versions={"dm-control": None})
    monkeypatch.setattr(diagnostics, "WITHOUT_LABMAZE", (3, 0))
    assert report.usable
    assert advise(report.versions, (), GPU)[0].endswith("pip install --no-deps dm-control")
    monkeypatch.setattr(diagnostics, "WITHOUT_LABMAZE", (4, 0))
    assert not report.usable
    assert advise(report.versions, (), GPU) == ("dm-control is missing: pip install dm-control",)


@pytest.mark.slow
def test_doctor_imports_what_it_lists(tmp_path):
    """Shapely before 2.0.6 is installed next to numpy 2 without complaint and cannot be imported."""
    (tmp_path / "shapely").mkdir()
    (tmp_path / "shapely" / "__init__.py").write_text("raise AttributeError('_ARRAY_API not found')")
    done = _command_line("doctor", f"{tmp_path}:{CHECKOUT}")
    assert done.returncode == 1
    assert ", cannot be imported (AttributeError: _ARRAY_API not found)" in done.stdout
    assert "shapely is broken" in done.stdout


def _install_fake(folder, *packages):
    for package in packages:
        (folder / package).mkdir()
        (folder / package / "__init__.py").touch()
    info = folder / "gadgets-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: gadgets\nVersion: 1.0\n")
    lines = [f"{package}/__init__.py,,\n" for package in packages]
    (info / "RECORD").write_text("".join([*lines, "gadgets-1.0.dist-info/METADATA,,\n"]))


def _command_line(words, path):
    return subprocess.run(
        [sys.executable, "-m", "mjsim", *words.split()],
        env={**os.environ, "PYTHONPATH": path, "PYTHONSAFEPATH": "1"},
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
def test_doctor_names_a_distribution_that_hides_packages(tmp_path):
    _install_fake(tmp_path, "planner", "hud")
    done = _command_line("doctor", f"{tmp_path}:{CHECKOUT}")
    assert done.returncode == 1
    for package in ("planner", "hud"):
        assert f"imports {package} from {tmp_path.resolve() / package} instead of" in done.stdout
        assert (
            f"the distribution gadgets installs a package {package} too: pip uninstall gadgets" in done.stdout
        )


@pytest.mark.slow
def test_doctor_names_a_distribution_that_hides_nothing_yet(tmp_path):
    _install_fake(tmp_path, "hud")
    done = _command_line("doctor", f"{CHECKOUT}:{tmp_path}")
    assert done.returncode == 0, done.stdout
    assert "gadgets" in done.stdout and "instead of" not in done.stdout


def test_a_folder_called_experiments_ahead_of_ours_is_named_at_every_command(tmp_path):
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments" / "__init__.py").touch()
    done = _command_line("doctor", f"{tmp_path}:{CHECKOUT}")
    assert done.returncode == 1
    assert f"imports experiments from {tmp_path.resolve() / 'experiments'} instead of" in done.stderr
