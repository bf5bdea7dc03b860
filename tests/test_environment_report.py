"""The report tells what a machine has, and what to do when drawing is impossible."""

import dataclasses
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np

from mjsim.diagnostics import advise, egl_vendors, environment_report
from mjsim.render.context import GlInfo, is_software

GPU = GlInfo("NVIDIA Corporation", "NVIDIA H100/PCIe/SSE2", "4.6.0", False)
CPU = GlInfo("Mesa", "llvmpipe (LLVM 15.0.6, 256 bits)", "4.5", True)


def test_report_of_this_machine_is_usable_and_truthful():
    report = environment_report()
    assert report.usable
    assert report.versions["mujoco"] == mujoco.__version__
    assert report.versions["numpy"] == np.__version__
    assert report.gl is not None
    assert report.gl.renderer in "\n".join(report.lines())


def test_vendor_files_come_in_the_order_they_are_tried(tmp_path: Path):
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


def test_a_machine_without_opengl_still_gets_a_report():
    """Rendering switched off stands in for a missing library: importing must work, the report must say why."""
    code = (
        "from mjsim.diagnostics import environment_report as e; r = e(); "
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


def test_missing_distribution_makes_the_report_unusable():
    report = dataclasses.replace(environment_report(), versions={"mujoco": None})
    assert not report.usable
    assert "mujoco not installed" in report.lines()
