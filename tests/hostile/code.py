"""A user's own code that fails in every way: participants, conditions, planners, and what an environment is made of."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from user_code import condition, participant, planner

from hostile.files import Rng, pick
from hostile.warm_commands import REFUSED, Case

LIMIT = "0.5"  # s that a call may take
RUN = "run --objects 2 --fidelity event --no-regret --no-floor-plan --no-video --time-limit 20 --out out"
RAISED = """
1 / 0
raise KeyError('x')
raise SystemExit(0)
raise SystemExit('text')
os._exit(0)
sys.exit()
raise GeneratorExit
raise StopIteration
raise MemoryError
raise RecursionError
raise BrokenPipeError
raise ImportError
raise OSError(28, 'No space')
raise type('Odd', (BaseException,), {})()
raise type('Mute', (Exception,), {'__str__': None})()
raise ValueError('x' * 100_000)
raise ValueError('a\\nb')
raise UnicodeDecodeError('a', b'b', 0, 1, 'c')
import no_such_module
assert False
time.sleep(600)
[0 for _ in iter(int, 1)]
"""
FAULTS = {
    participant: """
return None
return 'left'
return (1, 2)
return Move
return [Move()]
return Move(forward=float('nan'))
return Move(forward='x')
return Move(forward=1e308)
return Move(forward=None)
return Pick(object=5)
return Pick(object='')
return Pick(object='no such')
return Place()
return Pick()
return Wait(until=float('nan'))
return Wait(until=-1)
return Wait(until='x')
return Wait(until=1e308)
return FollowPath([], (0, 0), 0.1)
return FollowPath([[0, 0], [0, float('nan')]], (0, 0), 0.1)
return FollowPath([[0, 0], [1e6, 1e6]], (0, 0), 0.1)
return FollowPath(None, None, None)
percept.__dict__.clear()
os.chdir('/')
sys.stdout = None
sys.path.clear()
""",
    condition: """
return None
return 5
return replace(state, markers=None)
return replace(state, message=b'hi')
return replace(state, clock=float('nan'))
return replace(state, clock=1e400)
return replace(state, markers=[None])
return replace(state, checklist_title='\\ud800')
return replace(state, message=Message(None, MessageKind.INFO))
return replace(state, markers=[Marker('cone', (0, 0, 0), (1, 1, 1), (1, 1, 1, 1), '')])
return replace(state, markers=[Marker('box', (0, 0, 1e309), (1, 1, 1), (1, 1, 1, 1), '')])
return replace(state, checklist=5)
return view
return type(state)
os.chdir('/')
""",
    planner: """
return None
return plan.visits
return 5
return replace(plan, cost=plan.cost / 2)
return replace(plan, cost='x')
return replace(plan, visits=plan.visits[:-1])
return replace(plan, visits=plan.visits[::-1])
return replace(plan, visits=())
return replace(plan, visits=None)
return replace(plan, visits=(5,))
return replace(plan, cost=float('nan'))
return replace(plan, lower_bound=plan.cost + 1)
return replace(plan, cost=-1)
object.__setattr__(plan, 'cost', float('nan')); return plan
return replace(plan, cost=0, lower_bound=0)
problem.distances.flags.writeable = True; problem.distances[:] = 0; return replace(plan, cost=0)
""",
}
HARMLESS = re.compile(
    r"os\.chdir|sys\.(stdout|path)|Pick\(\)|Place\(\)|no such'|object=''|1e308|until=-1|__dict__|1e6"
)
MODULES = (  # that cannot be loaded, or hold nothing of use
    "1 / 0",
    "raise SystemExit(0)",
    "import os; os._exit(0)",
    "def build(: pass",
    "\0",
    "",
    "build = hud_state = Own = 5",
    "build = hud_state = Own = None",
    "def build(house, rng): return None\nhud_state = Own = build",
    "class Own:\n    def __init__(self, *a): 1 / 0\nbuild = hud_state = Own",
    "import no_such_module",
    "import own_code; own_code.x",
)


def code_case(folder: Path, rng: Rng) -> Case:
    """A command with code of a user's own."""
    make = pick(FAULTS, rng)
    statements = (RAISED + FAULTS[make]).strip().replace("\n\n", "\n").splitlines()
    statement, after = pick(statements, rng), pick([0, 0, 1, 30], rng)
    kind, text = f"{make.__name__}: {statement}", make(statement, after)
    must, message = REFUSED, "own_code"
    if rng.uniform() < 0.15:
        text = pick(MODULES, rng)
        kind = f"{make.__name__} of the module {text!r}"
    elif HARMLESS.search(statement) or after:  # or comes too late
        must, message = "", ""
    (folder / "own_code.py").write_text(text)
    words = [*RUN.split(), "--call-limit", LIMIT]
    if make is participant and not rng.integers(8):  # in workers of its own
        batch = "batch --objects 2 --fidelity event --no-regret --assistance none --seeds 0:2 --workers 1"
        words = [
            *batch.split(),
            "--user",
            "own_code:build",
            "--call-limit",
            LIMIT,
            "--time-limit",
            "5",
            "--out",
            "out",
        ]
        return Case("batch", kind, words, "", message=message)
    if make is participant:
        words += ["--user", "own_code:build", "--assistance", "none"]
    elif make is condition:
        words += ["--assistance", "own_code:hud_state"]
    elif rng.uniform() < 0.5:
        if "sleep" in statement or "iter(" in statement:  # another tour is given, and the output says so
            must = message = ""
        return Case(
            "plan",
            kind,
            ["plan", "problem.json", "--planner", "own_code:Own", "--time-limit", "2"],
            must,
            message=message,
        )
    else:
        words += ["--planner", "own_code:Own", "--assistance", "optimal"]
    return Case("run", kind, words, must, message=message)


OPTIONS: dict[str, tuple[Any, ...]] = {
    "objects": ("six", (2,), (3, 1), 0, -1, True, 1.5, 10**9, None, [2, 3], float("nan"), (1, "2"), b"1", {}),
    "observations": (5, None, (), ("nope",), (None,), b"state", {"state"}, "state", ("state", "rgb", 5)),
    "actions": ("nope", 5, None, (), lambda: None),
    "reward": (
        "nope",
        5,
        None,
        lambda *_: None,
        lambda *_: float("nan"),
        lambda *_: "1",
        lambda *_: [1],
        lambda *_: 1j,
    ),
    "time_limit": (0, -1, float("nan"), float("inf"), "x", True, 1e308, (), [1]),
    "episodes": ((), 0, -1, "x", (None,), 1.5, float("nan"), {}, (5,)),
    "slots": (0, -1, 1, 1.5, "x", float("nan"), 10**12, (), True),
    "keep": (0, -1, 1.5, "x", float("inf"), ()),
    "camera": (None, 5, "rgb", {}, ()),
    "person": (None, 5, "tall", {}, ()),
    "world": (None, 5, "event", {}, ()),
    "house": (5, None, "", "nope", "\0", "keep.txt", ".", ()),
    "physics_errors": ("x", None, 5, True, ()),
    "navigable": (5, "x", lambda *_: None, lambda *_: 5),
    "render_mode": ("x", 5, (), ["rgb_array"]),
    "surprise": (1,),
}
ACTIONS: tuple[Any, ...] = (
    float("nan"),
    None,
    "x",
    [1],
    [float("nan")] * 4,
    [1e308] * 4,
    ["a"] * 4,
    [[0] * 4],
    5,
    [],
    {},
    np.zeros(5),
    [None] * 4,
)
SENSED = (
    lambda _: None,
    lambda _: np.full(2, np.nan),
    lambda _: "x",
    lambda _: np.zeros(3),
    lambda _: 1 / 0,
    lambda: 0,
    5,
    None,
)


def environment_case(folder: Path, rng: Rng) -> Case:  # noqa: ARG001 - nothing is damaged
    """An environment with an unusable option, sensor, reward or action."""
    kind = pick(["option", "option", "option", "action", "sensor"], rng)
    if kind == "option":
        name = pick(OPTIONS, rng)
        value = pick(OPTIONS[name], rng)
        return Case("environment", f"{name}={value!r:.60}", call=lambda: _play({name: value}))
    if kind == "action":
        value = pick(ACTIONS, rng)
        return Case("environment", f"action {value!r:.60}", call=lambda: _play({}, value))
    number = int(rng.integers(len(SENSED)))
    return Case("environment", f"sensor {number}", must=REFUSED, call=lambda: _sense(SENSED[number]))


def _sense(read: Any) -> None:
    from dm_env import specs

    from mjsim.environments.sensors import Sensor
    from mjsim.values.errors import MjsimError

    try:
        _play({"observations": (Sensor("mine", lambda _: specs.Array((2,), np.float64), read),)})
    except (ZeroDivisionError, TypeError) as error:  # a user's own error is raised as it is
        raise MjsimError(str(error)) from error


def _play(options: dict[str, Any], *actions: Any) -> None:
    """A few steps; what is observed and rewarded must be as the spaces say."""
    from mjsim.environments.gymnasium_environment import RearrangeEnv

    environment = RearrangeEnv(**{"objects": 2, **options})
    environment.reset(seed=0)
    for action in actions or [environment.action_space.sample()]:
        seen, reward, *_ = environment.step(action)
        if not (environment.observation_space.contains(seen) and np.isfinite(reward)):
            raise AssertionError(f"seen and rewarded: {seen}, {reward}")
