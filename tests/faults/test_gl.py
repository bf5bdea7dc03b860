"""No OpenGL: what draws nothing works, and a run keeps its record and says what is missing."""

import json
import os
import subprocess
import sys

import mujoco
import pytest

from experiments.record import records
from experiments.record.files import read_json
from experiments.session.first_person import FilmConfig
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from faults.conftest import BRIEF, FAST, PROBLEM, ROOT, one_line
from mjsim.render import context
from mjsim.values.errors import RenderError


@pytest.mark.slow
@pytest.mark.parametrize("choice", ["foo", "osmesa", "off"])
def test_what_draws_nothing_needs_no_opengl(choice, tmp_path, mjsim):
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    plan = mjsim("plan", "problem.json", MUJOCO_GL=choice)
    assert (plan.returncode, plan.stderr) == (0, "")
    run = mjsim("run", *FAST, "--no-video", "--no-floor-plan", "--out", "out", MUJOCO_GL=choice)
    assert run.returncode == 0
    assert read_json(tmp_path / "out" / records.METRICS)["ended"] == "all delivered"


@pytest.mark.slow
def test_a_command_starts_no_other_process_for_opengl(tmp_path):
    """As GLFW does when it is imported: a signal to the group of processes would make those print tracebacks."""
    (tmp_path / "own.py").write_text(
        "import sys\nstarted = []\n"
        "sys.addaudithook(lambda e, a: started.append(a) if e == 'subprocess.Popen' else None)\n"
        "from experiments.cli.main import main\ncode = main(sys.argv[1:])\n"
        "print(code, started, 'glfw' in sys.modules)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "MUJOCO_GL"} | {"PYTHONPATH": str(ROOT)}
    words = ["house", "--objects", "2", "--seed", "0", "--out", "house.xml"]
    done = subprocess.run(
        [sys.executable, "own.py", *words], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.stdout.splitlines()[-1] == "0 [] False"


@pytest.mark.slow
@pytest.mark.parametrize("choice", ["foo", pytest.param("osmesa", marks=pytest.mark.long)])
def test_a_run_without_opengl_keeps_its_record(choice, tmp_path, mjsim):
    """A floor plan is drawn on a picture of the house, which is in the cache if the house was drawn before."""
    run = mjsim("run", *FAST, "--out", "out", MUJOCO_GL=choice)
    assert run.returncode == 1
    warnings = [line for line in run.stderr.splitlines() if line.startswith("mjsim: ")]
    missing = [" no video", *([] if (tmp_path / "out" / records.TOPDOWN).exists() else [" no floor plan"])]
    assert [line.partition(":")[2].partition(":")[0] for line in warnings] == missing
    assert all(choice in line for line in warnings) and "Traceback" not in run.stderr
    assert read_json(tmp_path / "out" / records.METRICS)["ended"] == "all delivered"
    assert mjsim("replay", "out", MUJOCO_GL=choice).returncode == 0
    film = mjsim("replay", "out", "--video", "film.mp4", MUJOCO_GL=choice)
    assert film.returncode == 1 and choice in one_line(film.stderr)
    assert not (tmp_path / "film.mp4").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("choice", "advice"), [("foo", "unset MUJOCO_GL"), ("osmesa", "apt-get install")])
def test_the_doctor_says_what_to_do(choice, advice, mjsim):
    done = mjsim("doctor", MUJOCO_GL=choice)
    assert done.returncode == 1 and done.stderr == ""
    assert advice in done.stdout.splitlines()[-1]


@pytest.mark.slow
def test_the_doctor_works_where_mujoco_does_not(tmp_path, mjsim):
    (tmp_path / "mujoco.py").write_text("raise ImportError('libmujoco.so is damaged')")
    done = mjsim("doctor", PYTHONPATH=f"{tmp_path}")
    assert done.returncode == 1 and done.stderr == ""
    assert "libmujoco.so is damaged" in done.stdout
    run = mjsim("run", "--out", "out", PYTHONPATH=f"{tmp_path}")
    assert run.returncode == 1 and "mjsim doctor" in one_line(run.stderr)


class Driver:
    """A GL context that is lost after so many uses."""

    def __init__(self, gl, uses, error):
        self._gl, self._uses, self._error = gl, uses, error

    def make_current(self):
        self._uses -= 1
        if self._uses < 0:
            raise self._error
        self._gl.make_current()


def opengl_error():
    """Imported late: PyOpenGL looks at its first import for a display, or for none."""
    from OpenGL.error import GLError

    return GLError(12302)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("uses", "error"), [(20, opengl_error), (0, lambda: mujoco.FatalError("gladLoadGL error"))]
)
def test_a_driver_that_fails_late_costs_the_pictures_alone(
    uses, error, house, tmp_path, tmp_path_factory, monkeypatch
):
    """As a GPU that is lost: at the first frame, or in the middle of the film; the house was never drawn before."""
    cache = tmp_path_factory.mktemp("cache")
    monkeypatch.setattr("experiments.trials.floor_plan.cache_base", lambda: cache)
    context.gl_info()
    lost = Driver(context._PROCESS._gl, uses, error())
    monkeypatch.setattr(context._PROCESS, "_gl", lost)
    warnings = []
    out = tmp_path / "out"
    metrics = run_trial(BRIEF, out, film=FilmConfig(320, 240), house=house, on_warning=warnings.append)
    assert metrics["ended"] == "all delivered" and metrics["frames_sha256"] is None
    assert [warning.partition(": ")[0] for warning in warnings] == ["no video", "no floor plan"]
    assert all("\n" not in warning for warning in warnings)
    assert not {records.VIDEO, records.TOPDOWN} & {path.name for path in out.iterdir()}
    assert replay(out, house=house).ended == "all delivered"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("name", ["osmesa", "glfw"])
def test_a_backend_that_cannot_be_loaded_is_not_blamed_on_egl(name, monkeypatch):
    monkeypatch.setattr(context, "chosen_gl", lambda: name)
    monkeypatch.setitem(sys.modules, f"mujoco.{name}", None)
    with pytest.raises(RenderError, match="install it, or unset MUJOCO_GL to draw with egl"):
        context._backend()
