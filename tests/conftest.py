"""Fixtures shared by the tests: the apartment as shipped, and a small house written for tests."""

import functools
import os
import signal
import ssl
import sys

# Before NumPy is loaded: on small matrices, threads of OpenBLAS cost more than they gain.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Before Numba is loaded: colours of its messages would take standard output away from a test in which it compiles.
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

import pytest
from hypothesis import settings

from experiments.house import House
from experiments.trials.fingerprint import plugin_digest
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.footprint import footprint
from mjsim.house.compiled.house import compiled_house
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.scene.scene import compose
from planner.navmesh import NavMesh

# Whether a test passes must not depend on how busy the machine is.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")


@pytest.fixture(scope="session")
def catalogue():
    """The apartment's catalogue."""
    return Catalogue.load("apartment")


@pytest.fixture(scope="session")
def house():
    """The apartment with its navmesh and geodesics; do not change it."""
    return House.load()


@pytest.fixture(scope="session")
def house_model(catalogue):
    """The tidy apartment, without objects or person."""
    return compiled_house(catalogue).model


@pytest.fixture(scope="session")
def house_footprint(house_model):
    return footprint(house_model)


@pytest.fixture(scope="session")
def navmesh(house_footprint):
    """Navigable floor of the apartment."""
    return NavMesh.build(house_footprint.obstacles, house_footprint.bounds)


@pytest.fixture(scope="session")
def episode(catalogue, navmesh):
    """A disorganized apartment with 24 objects."""
    return sample_episode(catalogue, navmesh, objects=24, seed=5)


@pytest.fixture(scope="session")
def scene(episode, catalogue):
    """The composed `episode`; do not change it."""
    return compose(episode, catalogue)


@pytest.fixture(scope="session", autouse=True)
def certificates_read_once():
    """Each HTTP client reads the certificates of all authorities, which takes longer than many tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ssl, "create_default_context", functools.cache(ssl.create_default_context))
        yield


@pytest.fixture(autouse=True)
def signals_as_in_a_terminal():
    """Under `nohup`, and in the background of a shell, tests would inherit that signals are ignored."""
    defaults = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in defaults.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    """Makes a module of a user's own importable, here and in commands that run in the folder of the test."""

    names = []

    def write(text, name="own_code"):
        names.append(name)
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, name, raising=False)
        plugin_digest.cache_clear()  # it may be known from a module of that name in another test
        return name

    yield write
    for name in names:
        sys.modules.pop(name, None)


@pytest.fixture(scope="module")
def frequent_checkpoints():
    """Every 2 s instead of every 10 s, so that short runs have several. A replay takes them from the record."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("experiments.record.writer.CHECKPOINT_PERIOD", 2.0)
        yield


@pytest.fixture
def undrawn(monkeypatch):
    """Figures of reports stay empty, as drawing them takes longer than the statistics."""
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda _, file, **__: file.write("<svg></svg>"))


@pytest.fixture
def step_singly():
    """Makes a world take one control step per action, as for a viewer."""

    def limit(world):
        step = world.step
        world.step = lambda action, limit=1: step(action, 1)  # noqa: ARG005

    return limit


@pytest.fixture(scope="session")
def small_house(tmp_path_factory):
    """Folder of a house of two rooms, 3 m x 4 m each, with two receptacles and three object models."""
    folder = tmp_path_factory.mktemp("small_house")
    write_small_house(folder)
    return folder


@pytest.fixture(scope="session")
def small_catalogue(small_house):
    """Categories `solids` (cube, wedge) -> crate in the west, and `rounds` (ball) -> tray in the east."""
    return Catalogue.load(str(small_house / "catalogue.toml"))


@pytest.fixture
def fresh_house(tmp_path):
    """Catalogue of a small house with a content of its own, so that nothing of it is compiled yet."""
    write_small_house(tmp_path)
    (tmp_path / "house.xml").write_text(
        (tmp_path / "house.xml").read_text().replace('model="small"', f'model="{tmp_path.name}"')
    )
    return tmp_path / "catalogue.toml"


@pytest.fixture(scope="session")
def cramped_catalogue(tmp_path_factory):
    """The small house with a crate on whose floor there is room for four cubes."""
    folder = tmp_path_factory.mktemp("cramped_house")
    write_small_house(folder)
    (folder / "crate.xml").write_text(_receptacle(0.14), encoding="utf-8")
    return Catalogue.load(str(folder / "catalogue.toml"))


def write_small_house(folder):
    for name, text in _SMALL_HOUSE.items():
        (folder / name).write_text(text.replace("FOLDER", str(folder)), encoding="utf-8")


def _receptacle(half):
    wall = half - 0.01
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <default><geom type="box" condim="6" solref="0.008 1"/></default>
  <worldbody>
    <body name="receptacle">
      <geom pos="0 0 0.02" size="{half} {half} 0.02"/>
      <geom pos="{wall} 0 0.15" size="0.01 {half} 0.15"/>
      <geom pos="-{wall} 0 0.15" size="0.01 {half} 0.15"/>
      <geom pos="0 {wall} 0.15" size="{half} 0.01 0.15"/>
      <geom pos="0 -{wall} 0.15" size="{half} 0.01 0.15"/>
      <site name="volume" type="box" pos="0 0 0.2" size="{wall} {wall} 0.16"/>
      <site name="approach" pos="0 -{half + 0.35} 0"/>
    </body>
  </worldbody>
</mujoco>
"""


def _object(geom, top, asset=""):
    return f"""
<mujoco>
  <compiler angle="radian"/>
  {asset}
  <worldbody>
    <body name="object">
      {geom}
      <site name="grip_0" pos="0 0 {top}"/>
      <site name="grip_1" pos="0 0 {top}" quat="0 0 0 1"/>
    </body>
  </worldbody>
</mujoco>
"""


_SMALL_HOUSE = {
    "house.xml": """
<mujoco model="small">
  <compiler angle="radian"/>
  <default>
    <default class="wall"><geom type="box"/></default>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1" pos="3 2 0"/>
    <geom name="south" class="wall" pos="3 -0.1 1.25" size="3.2 0.1 1.25"/>
    <geom name="north" class="wall" pos="3 4.1 1.25" size="3.2 0.1 1.25"/>
    <geom name="west" class="wall" pos="-0.1 2 1.25" size="0.1 2 1.25"/>
    <geom name="east" class="wall" pos="6.1 2 1.25" size="0.1 2 1.25"/>
    <geom name="partition_south" class="wall" pos="3 0.75 1.25" size="0.05 0.75 1.25"/>
    <geom name="partition_north" class="wall" pos="3 3.25 1.25" size="0.05 0.75 1.25"/>
    <geom name="lintel" class="wall" pos="3 2 2.25" size="0.05 0.5 0.25"/>
    <geom name="lamp" type="sphere" pos="1.5 2 2.3" size="0.2" group="1" contype="0" conaffinity="0"/>
    <site name="room:west" type="box" pos="1.5 2 1" size="1.5 2 1"/>
    <site name="room:east:1" type="box" pos="4.5 1 1" size="1.5 1 1"/>
    <site name="room:east:2" type="box" pos="4.5 3 1" size="1.5 1 1"/>
    <site name="mount:crate" pos="0.3 3.7 0"/>
    <site name="mount:tray" pos="5.7 3.6 0" quat="0.70710678 0 0 -0.70710678"/>
  </worldbody>
</mujoco>
""",
    "crate.xml": _receptacle(0.3),
    "tray.xml": _receptacle(0.25),
    "cube.xml": _object('<geom type="box" pos="0 0 0.05" size="0.05 0.05 0.05" mass="0.2"/>', 0.1),
    "wedge.xml": _object(
        '<geom type="mesh" mesh="wedge" mass="0.2"/>',
        0.08,
        '<asset><mesh name="wedge" vertex="-.08 -.05 0 .08 -.05 0 -.08 .05 0 .08 .05 0 -.08 -.05 .08 -.08 .05 .08"/>'
        "</asset>",
    ),
    "ball.xml": _object(
        '<geom type="sphere" pos="0 0 0.06" size="0.06" mass="0.1" condim="6" friction="1 0.01 0.003"/>', 0.12
    ),
    "catalogue.toml": """
[house]
label = "Small house"
model = "house.xml"

[rooms]
west = "West room"
east = "East room"

[categories.solids]
label = "Solids"
receptacle = "crate"
objects = ["cube", "wedge"]

[categories.rounds]
label = "Rounds"
receptacle = "tray"
objects = ["ball"]

[receptacles.crate]
label = "Crate"
place = "in the corner"
room = "west"
model = "FOLDER/crate.xml"

[receptacles.tray]
label = "Tray"
place = "by the wall"
room = "east"
model = "FOLDER/tray.xml"

[objects.cube]
label = "Cube"
model = "FOLDER/cube.xml"

[objects.wedge]
label = "Wedge"
model = "FOLDER/wedge.xml"

[objects.ball]
label = "Ball"
model = "FOLDER/ball.xml"
""",
}
