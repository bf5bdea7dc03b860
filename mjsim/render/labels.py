"""Instance and category labels for segmentation images."""

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
_SAME = 1e-6  # tolerance in metres for recognizing the same geom in two models


@dataclass(frozen=True, eq=False)
class Labels:
    """A mapping from geom ids to instance numbers and category numbers. The background is always -1."""

    # instance names, indexed by instance number: `house`, `person`, the receptacle keys and the object names
    instances: tuple[str, ...]
    # category names, indexed by category number: `house`, `person`, `receptacle` and the object categories
    categories: tuple[str, ...]
    # instance number of each geom, followed by -1 for the background, shape (ngeom + 1,)
    instance_of_geom: NDArray[np.int32]
    # category number of each instance, followed by -1 for the background
    category_of_instance: NDArray[np.int32]

    @classmethod
    def of(cls, scene: Scene) -> "Labels":
        """Create the labels for a composed scene. Scenes of equal episodes have equal labels."""
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
        """Count the pixels of each visible instance in an array of geom ids. Keys are instance names."""
        seen = self.instance_of_geom[segmentation].ravel()
        counts = np.bincount(seen[seen >= 0], minlength=len(self.instances))
        return {name: int(count) for name, count in zip(self.instances, counts, strict=True) if count}


def _receptacle_geoms(scene: Scene, key: str) -> NDArray[np.intp]:
    """Return the ids of a receptacle's geoms. Geoms merged into the house are recognized by their poses."""
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
    for body in range(root + 1, model.nbody):  # in MuJoCo, a parent body precedes its children
        inside[body] = inside[model.body_parentid[body]]
    return inside
