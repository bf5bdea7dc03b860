"""Draw a figure of the four levels of difficulty in the paper."""

from pathlib import Path

import numpy as np

from experiments.house import House
from experiments.record.run_directory import check_file
from experiments.trials.floor_plan import planned_path, task_picture
from experiments.trials.setup import first_state, solver_source, trial_episode
from experiments.trials.trial_config import TrialConfig
from tools.gallery import save_png

LEVELS, LEVEL_OBJECTS = "levels.png", (6, 12, 18, 24)


def make_levels(out: Path, seed: int, *, replace: bool) -> Path:
    """Draw a house at the four levels, with the shortest route at the first one. Return the picture's path.

    Raises:
        RecordError: The picture already exists.
    """
    path = out / LEVELS
    check_file(path, replace=replace)
    pictures = []
    for objects in LEVEL_OBJECTS:
        config = TrialConfig(objects=objects, assistance="optimal", seed=seed)
        house = House.load(config.house)
        episode, way = trial_episode(config, house), None
        if objects == LEVEL_OBJECTS[0]:
            route = solver_source(config, house).plan(first_state(house, episode), None, shown=True)
            visits = [(visit.kind.value, visit.object) for visit in route.visits]
            way = planned_path(house, episode, {"visits": visits})
        pictures.append(task_picture(house, episode, f"{objects} objects", way))
    out.mkdir(parents=True, exist_ok=True)
    save_png(path, np.vstack([np.hstack(pictures[:2]), np.hstack(pictures[2:])]))
    return path
