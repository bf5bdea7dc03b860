"""Instance and category labels of segmentation images."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.scene import Scene
from mjsim.values.errors import RenderError

BACKGROUND = -1
HOUSE, PERSON, RECEPTACLE = "house", "person", "receptacle"
_PERSON_ROOT = "avatar/base"
_SAME = 1e-6  # tolerance in metres when matching a geom between two models


@dataclass(frozen=True, eq=False)
class Labels:
    """Maps geom ids to instances and categories. The background, -1, stays -1."""

    # `house`, `person`, receptacle keys and object names, by instance number
    instances: tuple[str, ...]
    # `house`, `person`, `receptacle` and the objects' categories, by category number
    categories: tuple[str, ...]
    # instance number of each geom, then -1 for the background, shape (ngeom + 1,)
    instance_of_geom: NDArray[np.int32]
    # category number of each instance, then -1 for the background
    category_of_instance: NDArray[np.int32]

    @classmethod
    def of(cls, scene: Scene) -> "Labels":
        """Create the labels of a composed scene. Equal episodes have equal labels."""
        model, keys = scene.model, tuple(scene.receptacles)
        instances = (HOUSE, PERSON, *keys, *scene.index.names)
        of_geom = np.zeros(model.ngeom + 1, np.int32)
        of_geom[-1] = BACKGROUND
        person = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, _PERSON_ROOT)
        if person >= 0:
            of_geom[:-1][model.body_rootid[model.geom_bodyid] == person] = 1
        for number, key in enumerate(keys, start=2):
            of_geom[:-1][_receptacle_geoms(scene, key)] = number
        owner = scene.index.geom_owner
        of_geom[:-1][owner >= 0] = owner[owner >= 0] + 2 + len(keys)
        kinds = [placed.category for placed in scene.episode.objects]
        categories = (HOUSE, PERSON, RECEPTACLE, *scene.catalogue.categories)
        of_instance = [0, 1, *[2] * len(keys), *(categories.index(kind, 3) for kind in kinds), BACKGROUND]
        return cls(instances, categories, of_geom, np.array(of_instance, np.int32))

    def instance_map(self, segmentation: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert an array of geom ids to instance numbers."""
        return np.asarray(self.instance_of_geom[segmentation])

    def category_map(self, segmentation: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert an array of geom ids to category numbers."""
        return np.asarray(self.category_of_instance[self.instance_of_geom[segmentation]])

    def pixel_counts(self, segmentation: NDArray[np.int32]) -> dict[str, int]:
        """Return the number of pixels of each visible instance, by name, in an array of geom ids."""
        seen = self.instance_of_geom[segmentation].ravel()
        counts = np.bincount(seen[seen >= 0], minlength=len(self.instances))
        return {name: int(count) for name, count in zip(self.instances, counts, strict=True) if count}


def _receptacle_geoms(scene: Scene, key: str) -> NDArray[np.intp]:
    """Find the geoms of a receptacle. If they were merged into the house, match them by their poses."""
    model = scene.model
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, f"{key}/receptacle")
    if body >= 0:
        return np.flatnonzero(_descends(model, body)[model.geom_bodyid])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    alone = mujoco.MjModel.from_xml_path(str(scene.catalogue.receptacles[key].path))
    posed = mujoco.MjData(alone)
    mujoco.mj_kinematics(alone, posed)
    mount = data.site(f"mount:{key}")
    expected = posed.geom_xpos @ mount.xmat.reshape(3, 3).T + mount.xpos
    static = np.flatnonzero(model.geom_bodyid == 0)
    apart = np.linalg.norm(data.geom_xpos[static, None] - expected[None], axis=2)
    alike = (model.geom_type[static, None] == alone.geom_type[None]) & np.isclose(
        model.geom_rbound[static, None], alone.geom_rbound[None], atol=_SAME
    )
    same = alike & (apart < _SAME)
    if not same.any(axis=0).all():
        raise RenderError(
            f"the scene's model lacks {int((~same.any(axis=0)).sum())} geoms of receptacle {key!r}; compose the scene "
            "from the catalogue that it carries"
        )
    return np.asarray(static[same.any(axis=1)])


def _descends(model: Any, root: int) -> NDArray[np.bool_]:
    inside = np.zeros(model.nbody, dtype=bool)
    inside[root] = True
    for body in range(root + 1, model.nbody):  # MuJoCo lists parents before their children
        inside[body] = inside[model.body_parentid[body]]
    return inside
