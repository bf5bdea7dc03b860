"""Load houses and the pictures of their objects only once, and share them with forked processes."""

import functools
import gc
import os
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context

from experiments.house import House
from experiments.session.house_pictures import draw_largest_room
from experiments.trials import warmup
from experiments.trials.trial_config import TrialConfig
from experiments.web.state import Pictures
from experiments.web.worker.encoders import Image, data_url
from experiments.web.worker.marker_picture import MarkerPicture, marker_picture
from hud.state import FLOORPLAN
from mjsim.formats.gltf.cache import cached_floor, cached_scene, view_path
from mjsim.formats.gltf.store import scenes_folder
from mjsim.render import render_house_map, render_pictures

DRAWING_TIMEOUT = 60.0  # timeout for drawing the pictures, in seconds
_pictures: dict[str, dict[str, Image]] = {}


@functools.cache
def house(name: str) -> House:
    return House.load(name)


def pictures(name: str) -> dict[str, Image]:
    if name not in _pictures:
        _pictures[name] = render_pictures(house(name).catalogue)
    return _pictures[name]


@functools.cache
def encoded_pictures(name: str, floor_plan: bool) -> dict[str, str]:
    """Return a house's pictures as data URLs, with the floor plan if requested. This requires OpenGL."""
    found = dict(pictures(name))
    if floor_plan:
        found[FLOORPLAN] = render_house_map(house(name).catalogue, house(name).bounds)
    return {key: data_url(picture) for key, picture in found.items()}


def shown_pictures(config: TrialConfig, shown: House, *, explained: bool = False) -> Pictures:
    """Return the pictures of a trial's house, with labels in the language of the trial. This requires OpenGL.

    If the markers are to be `explained`, one picture shows those of the trial's condition.
    """
    catalogue = shown.catalogue
    category = next(one for one in catalogue.categories.values() if one.objects)
    model, receptacle = catalogue.objects[category.objects[0]], catalogue.receptacles[category.receptacle]
    labels = {f"object:{model.key}": model.label, f"receptacle:{receptacle.key}": receptacle.label}
    found = encoded_pictures(config.house, "minimap" in config.assistance)
    markers = marker_picture(house(config.house), config) if explained else MarkerPicture()
    return Pictures({**found, "markers": markers.picture} if markers.roles else found, labels, markers.roles)


def scene_files(house: House) -> tuple[str, str]:
    """Return the URL paths of a house's scene and floor file. Missing files are created, which takes seconds.

    Raises:
        AssetError: Part of the house cannot be exported.
        OSError: The files cannot be written.
    """
    scene = cached_scene(house.catalogue, scenes_folder())
    folder = f"/scene/{scene.name}/"
    return folder, folder + cached_floor(house.catalogue, scene, house.person.body_radius)


def make_files(house: House) -> None:
    """Create the scene files and the picture on the welcome page, unless they exist.

    If the picture cannot be drawn, its file is empty, so that the server does not wait for it.
    """
    scene_files(house)
    path = view_path(house.catalogue, scenes_folder())
    if path.is_file() and path.stat().st_size:
        return
    path.unlink(missing_ok=True)
    try:
        draw_largest_room(house, path)
    except Exception:  # such as a machine without OpenGL
        path.touch()
        raise


def preload(name: str) -> None:
    """Load a house, its pictures and the compiled kernels before workers are forked. Errors are ignored.

    Threads and OpenGL contexts do not survive a fork. One child process therefore draws the pictures, and
    another one exports the scene and then draws the welcome page's picture.
    """
    with suppress(Exception):
        loaded = house(name)
        _begin(make_files, loaded)
        with get_context("fork").Pool(1) as drawing:
            drawn = drawing.apply_async(render_pictures, (loaded.catalogue,))
            warmup.compile_kernels(loaded)  # also caches hashes and versions
            _pictures[name] = drawn.get(DRAWING_TIMEOUT)
        encoded_pictures(name, False)
    gc.freeze()  # prevents garbage collection from copying shared memory pages


def _begin(work: Callable[[House], object], house: House) -> None:
    """Run `work` in a detached process, because the fork server may only have workers as children."""
    between = os.fork()
    if not between:
        try:
            if not os.fork():
                work(house)
        finally:  # workers repeat the work and report errors
            os._exit(0)
    os.waitpid(between, 0)
