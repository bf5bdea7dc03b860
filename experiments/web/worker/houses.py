"""Houses and the pictures of their objects, loaded once a process and shared with the processes forked from it."""

import functools
import gc
import os
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context

from experiments.house import House
from experiments.trials import warmup
from experiments.web.worker.encoders import Image, data_url
from hud.options.minimap import FLOORPLAN
from mjsim.formats.gltf.cache import cached_floor, cached_scene
from mjsim.formats.gltf.store import scenes_folder
from mjsim.render import render_house_map, render_pictures

DRAWING_TIMEOUT = 60.0  # s
_pictures: dict[str, dict[str, Image]] = {}


@functools.cache
def house(name: str) -> House:
    """A house by its name or path."""
    return House.load(name)


def pictures(name: str) -> dict[str, Image]:
    """Pictures of a house's objects and receptacles."""
    if name not in _pictures:
        _pictures[name] = render_pictures(house(name).catalogue)
    return _pictures[name]


@functools.cache
def encoded_pictures(name: str, floor_plan: bool) -> dict[str, str]:
    """The pictures of a house as data URLs, and its floor plan if that is needed; to be called where one draws."""
    found = dict(pictures(name))
    if floor_plan:
        found[FLOORPLAN] = render_house_map(house(name).catalogue, house(name).bounds)
    return {key: data_url(picture) for key, picture in found.items()}


def scene_files(house: House) -> tuple[str, str]:
    """Folder of the files of a house's scene on the server, and path of its floor for the house's person.

    They are made unless they are there, which takes seconds.

    Raises:
        AssetError: The house shows something that cannot be exported.
        OSError: The files cannot be written.
    """
    scene = cached_scene(house.catalogue, scenes_folder())
    folder = f"/scene/{scene.name}/"
    return folder, folder + cached_floor(house.catalogue, scene, house.person.body_radius)


def preload(name: str) -> None:
    """Load a house, its pictures and the kernels before workers are forked; they retry and report what fails here.

    It uses one thread and no OpenGL, neither of which survives a fork: a process of its own draws the pictures. Another
    one makes the files from which browsers draw.
    """
    with suppress(Exception):
        loaded = house(name)
        _begin(scene_files, loaded)
        with get_context("fork").Pool(1) as drawing:
            drawn = drawing.apply_async(render_pictures, (loaded.catalogue,))
            warmup.compile_kernels(loaded)  # a little of each trial also leaves hashes and versions in memory
            _pictures[name] = drawn.get(DRAWING_TIMEOUT)
        encoded_pictures(name, False)
    gc.freeze()  # collecting garbage would copy what is shared


def _begin(work: Callable[[House], object], house: House) -> None:
    """Have work done by a process that nobody waits for. The fork server may have no children but its workers."""
    between = os.fork()
    if not between:
        try:
            if not os.fork():
                work(house)
        finally:  # whatever comes: who needs the result tries again and reports it
            os._exit(0)
    os.waitpid(between, 0)
