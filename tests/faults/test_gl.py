"""No OpenGL: what draws nothing works, and a run keeps its record and says what is missing."""

import json

import pytest

from experiments.files import read_json
from experiments.runs import records
from faults.conftest import FAST, one_line

PROBLEM = {"distances": [[0, 1], [1, 0]], "shipments": [{"pickup": 0, "delivery": 1}]}


@pytest.mark.parametrize("choice", ["foo", "osmesa", "off"])
def test_what_draws_nothing_needs_no_opengl(choice, tmp_path, mjsim):
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    plan = mjsim("plan", "problem.json", MUJOCO_GL=choice)
    assert (plan.returncode, plan.stderr) == (0, "")
    run = mjsim("run", *FAST, "--no-video", "--no-floor-plan", "--out", "out", MUJOCO_GL=choice)
    assert run.returncode == 0
    assert read_json(tmp_path / "out" / records.METRICS)["ended"] == "all delivered"


@pytest.mark.parametrize("choice", ["foo", "osmesa"])
def test_a_run_without_opengl_keeps_its_record(choice, tmp_path, mjsim):
    run = mjsim("run", *FAST, "--out", "out", MUJOCO_GL=choice)
    assert run.returncode == 1
    warnings = [line for line in run.stderr.splitlines() if line.startswith("mjsim: ")]
    assert [line.partition(":")[2].partition(":")[0] for line in warnings] == [" no video", " no floor plan"]
    assert all(choice in line for line in warnings) and "Traceback" not in run.stderr
    assert read_json(tmp_path / "out" / records.METRICS)["ended"] == "all delivered"
    assert mjsim("replay", "out", MUJOCO_GL=choice).returncode == 0
    film = mjsim("replay", "out", "--video", "film.mp4", MUJOCO_GL=choice)
    assert film.returncode == 1 and choice in one_line(film.stderr)
    assert not (tmp_path / "film.mp4").exists()


@pytest.mark.parametrize(("choice", "advice"), [("foo", "unset MUJOCO_GL"), ("osmesa", "apt-get install")])
def test_the_doctor_says_what_to_do(choice, advice, mjsim):
    done = mjsim("doctor", MUJOCO_GL=choice)
    assert done.returncode == 1 and done.stderr == ""
    assert advice in done.stdout.splitlines()[-1]


def test_the_doctor_works_where_mujoco_does_not(tmp_path, mjsim):
    (tmp_path / "mujoco.py").write_text("raise ImportError('libmujoco.so is damaged')")
    done = mjsim("doctor", PYTHONPATH=f"{tmp_path}")
    assert done.returncode == 1 and done.stderr == ""
    assert "libmujoco.so is damaged" in done.stdout
    run = mjsim("run", "--out", "out", PYTHONPATH=f"{tmp_path}")
    assert run.returncode == 1 and "mjsim doctor" in one_line(run.stderr)
