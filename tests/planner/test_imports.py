"""The planner can be used without the simulator."""

import subprocess
import sys

CODE = """
import sys
import planner
for name in planner.__all__:
    getattr(planner, name)
print(*{"OpenGL", "cv2", "dm_control", "experiments", "hud", "mujoco", "starlette"} & set(sys.modules))
"""


def test_the_whole_planner_loads_no_physics_no_drawing_and_no_server():
    ran = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == []
