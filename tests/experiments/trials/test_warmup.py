"""Kernels compiled ahead: nobody waits for them in a first run."""

import subprocess
import sys

import pytest

# A process of its own: what other tests have compiled would hide what the warm-up leaves out.
_SCRIPT = """
import sys
from pathlib import Path
from numba.core.dispatcher import Dispatcher
from mjsim.values.actions import Move
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.values.episode import Episode
from mjsim.house.scene.scene import compose
from experiments.trials.warmup import compile_kernels
from mjsim.world.world import World

def compiled():
    modules = [m for name, m in list(sys.modules.items()) if name.startswith(("mjsim.", "planner."))]
    kernels = {v for m in modules for v in vars(m).values() if isinstance(v, Dispatcher)}
    return {k.py_func.__module__ + "." + k.py_func.__name__: len(k.signatures) for k in kernels}

print(sum(compiled().values()))
compile_kernels()
before = compiled()
episode = Episode.from_json(Path(sys.argv[1]).read_text(encoding="utf-8"))
world = World(compose(episode, Catalogue.load(episode.house)))
for _ in range(100):
    world.step(Move(1.4, turn=0.4))
after = compiled()
print(len(after), {name: (before.get(name), n) for name, n in after.items() if n != before.get(name)})
"""


@pytest.mark.slow
def test_importing_compiles_nothing_and_after_the_warm_up_nothing_is_left(tmp_path, episode):
    path = tmp_path / "episode.json"
    path.write_text(episode.to_json(), encoding="utf-8")
    ran = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(path)], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    imported, walked = ran.stdout.splitlines()
    count, new = walked.split(" ", 1)
    assert imported == "0"
    assert int(count) > 5
    assert new == "{}"
